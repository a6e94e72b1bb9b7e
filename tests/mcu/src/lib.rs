//! The emulated microcontroller: runs the firmware's own image, down to the registers, closed around the
//! emulated rig.
//!
//! [`cpu`] is the processor behind a trait, `unicorn` its implementation; [`nvic`] takes its exceptions,
//! [`chip`] holds time and the peripherals ([`peripheral`], a file each, from the reference manual), [`board`]
//! the half bridges, the rig and its sensors, and [`emulation`] runs it all. An access that is not modelled ends
//! the run by name.
//!
//! Everything is deterministic: time is counted in the processor's cycles, estimated by class ([`cost`],
//! [`accelerator`]); instructions are counted exactly.

pub mod accelerator;
pub mod board;
pub mod chip;
pub mod cost;
pub mod cpu;
pub mod emulation;
pub mod image;
pub mod map;
pub mod nvic;
pub mod peripheral;
#[cfg(feature = "unicorn")]
pub mod rig;
pub mod ripple;
pub mod time;
#[cfg(feature = "unicorn")]
pub mod unicorn;
