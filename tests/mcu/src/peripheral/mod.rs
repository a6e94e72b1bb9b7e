//! The chip's peripherals, one file each, from the reference manual RM0440 rev 8 and, for the core's own, from the
//! ARMv7-M Architecture Reference Manual (DDI 0403E).
//!
//! Everything not modelled is refused by name: an unlisted register, a reserved bit, or a bit without a modelled
//! effect. A refusal ends the run; nothing is accepted silently.

pub mod adc;
pub mod comp;
pub mod dac;
pub mod dma;
pub mod dmamux;
pub mod exti;
pub mod flash;
pub mod gpio;
pub mod iwdg;
pub mod lpuart;
pub mod pwr;
pub mod rcc;
mod refusal;
mod register;
pub mod syscfg;
pub mod tim;
pub mod wwdg;

pub use refusal::{Refusal, told};
pub use register::{Bank, Register};
