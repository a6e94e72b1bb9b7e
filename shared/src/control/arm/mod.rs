//! Control laws of arms: chains of links, with or without coupled drives.
//!
//! Every law implements one trait, [`Law`]: a pure step from measurement and reference to joint torques. The position
//! laws of the one-link rig ([`law`](crate::control::law)) implement it too, for a chain of one joint.
//!
//! | law | source |
//! | --- | --- |
//! | [`pid`] | independent PID in the coordinates of the motors, with gravity and friction compensation |
//! | [`computed_torque`] | Craig 1986; Khalil & Dombre 2002, sec. 14.4 |
//! | [`adaptive`] | Slotine & Li 1987, with any independent set of parameters |
//! | [`hybrid`] | Raibert & Craig 1981 (selection), in operational space (Khatib 1987) |
//! | [`impedance`] | Hogan 1985, with a measured force |
//!
//! No law allocates, and none is called by the firmware. Torques are joint-side and limited joint by joint.
//! [`ArmModel::motor_torque`] gives those of the motors.
//!
//! Leaves out: elastic joints, flexible links, and the dynamics of the current loops.

pub mod adaptive;
pub mod computed_torque;
mod fault;
mod friction;
pub mod hybrid;
pub mod impedance;
mod input;
mod model;
mod one_link;
mod operational;
pub mod pid;
mod regressor;
mod task;
#[cfg(test)]
mod tests;

pub use fault::ControlFault;
pub use input::{Inputs, Law, Limited};
pub use model::{ArmModel, ArmMotors};
pub use operational::Operational;
pub use regressor::PassiveRegressor;
pub use task::{AXES, Task, TaskMotion};
