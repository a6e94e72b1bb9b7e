//! The whole emulated board: the processor's exceptions, sleep and reset, and the run.

mod error;
mod exceptions;
mod reset;
mod run;
mod stack;
mod state;

pub use error::EmulationError;
pub use state::{Cost, Emulation, Silenced};
