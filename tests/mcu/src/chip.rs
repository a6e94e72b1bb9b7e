//! The chip: time, clocks, peripherals and the lines between them, behind the processor's bus.

mod bus;
mod error;
mod event;
mod halt;
mod lines;
mod pins;
mod reset;
mod state;

pub use error::ChipError;
pub use state::{CONTROL_EXCEPTION, Chip, Reading};
