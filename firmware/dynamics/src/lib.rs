//! Dynamics of the IRp-6 with its drives, in the precision of the controller: torques of the motors for a motion, and
//! the motion under torques of the motors.
//!
//! The mathematics is that of `rig-shared`, which desktop and controller share. This crate has the numbers of the robot
//! ([`irp6`]), the functions that are measured ([`Arm`]), the states at which they are measured ([`states`]), and an
//! image for the chip (`main.rs`).
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod arm;
pub mod irp6;
mod states;
#[cfg(test)]
mod tests;

pub use arm::{Arm, Fault};
pub use irp6::JOINTS;
pub use states::{STATES, State, states};
