//! Validation: predictions of a description for recordings that were not used for its fit. Nothing is refitted.
//!
//! Two checks per recording. *Torque*: the model's torque for the measured motion is compared with the measured torque.
//! Preparation and evaluation are those of [`rig_identify`]'s hold-out, so that both figures are comparable. *Motion*:
//! the closed loop of model and controller, driven by the recorded reference from the recording's first state, is
//! compared with the measured position and torque; model errors accumulate over time here. If the description lacks the
//! controller of a joint, a substitute controller would affect the result more than the model. Then the recorded
//! torques drive the model and a controller corrects deviations from the recorded motion ([`replay`]); a warning
//! reports it.
//!
//! A recording may state that the drive applied more than its controller's output. Column `added<k>`: torque or force
//! on joint k beside the controller's, N·m or N. Column `pulses`: added to the output of the first joint's controller,
//! in its unit, and so multiplied by the description's `torque_gain`. Both are part of `tau<k>`, the whole torque of
//! the drive: measured and simulated torque are compared as wholes, and the description's torque limit acts on the
//! whole. (For the pulses of EMPS this was measured: `u1` minus the controller's law for `ref1` and `q1` is the column
//! `pulses`, and the torque balance has no room for a further force.)
//!
//! Effects beyond the standard model: their torque along the measured motion is subtracted from the measured torque,
//! sensor errors from the readings; the simulated motion contains all of them. Payloads are masses of the model.
//!
//! ```no_run
//! use rig_data::Source;
//! use rig_model::robot::Robot;
//! use rig_validate::{Options, validate};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::load("model.toml".as_ref())?;
//! let recording = Source::open("holdout.csv".as_ref(), &robot)?;
//! let found = validate(&robot, &[&recording], &Options::default(), &mut |_| ())?;
//! println!("{}", found.warnings.join("\n"));
//! # Ok(())
//! # }
//! ```
//!
//! Limits: the torque check excludes effects between motor and link or on the voltage (a warning reports it); no
//! uncertainty of the description's parameters; no measured inputs other than reference and added torque.

#[cfg(test)]
mod effects_tests;
mod error;
mod motion;
mod options;
pub mod replay;
mod result;
#[cfg(test)]
mod tests;
mod torque;
mod treatment;
mod validation;

pub use error::ValidateError;
pub use options::Options;
pub use result::{Checked, Motion, MotionCheck, MotionSeries, TorqueCheck, Validation};
pub use validation::validate;
