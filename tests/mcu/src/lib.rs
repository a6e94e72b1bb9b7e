//! The emulated microcontroller: runs the firmware's own image, down to the registers, in a closed loop with the
//! emulated rig.
//!
//! [`cpu`] is the processor behind a trait, `unicorn` its implementation. [`nvic`] handles exceptions. [`chip`] has
//! time and the peripherals ([`peripheral`], one file each, from the reference manual). [`board`] has the half bridges,
//! the rig and its sensors. [`emulation`] runs all of it. An access that is not modelled ends the run and is named.
//!
//! Everything is deterministic. Time is counted in processor cycles, estimated by class ([`cost`], [`accelerator`]);
//! instructions are counted exactly.

pub mod accelerator;
pub mod amplifier;
pub mod board;
pub mod chip;
pub mod cost;
pub mod cpu;
pub mod emulation;
pub mod ill_board;
pub mod image;
pub mod line_noise;
pub mod map;
pub mod nvic;
pub mod peripheral;
#[cfg(feature = "unicorn")]
pub mod rig;
pub mod ripple;
pub mod time;
#[cfg(feature = "unicorn")]
pub mod unicorn;
