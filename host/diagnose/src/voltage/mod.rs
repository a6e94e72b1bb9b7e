//! The gap workflow for one joint driven by a known voltage, without measured torque or current.
//!
//! Without torque, the model runs freely from the recorded start of each recording with the recorded voltage. The gap
//! is that of the position, in rad (or m). Identifiable are torque per volt, back-EMF, the drive's inertia and
//! friction, relative to the link's inertia and weight, which must be described. `search` adds one effect at a time by
//! the motion of left-out recordings (Stone 1974). `train_rms`, `holdout_rms`, waterfall and floor refer to the
//! position. Each recording is simulated from its first row to its last without using the measured motion in between
//! (`LONGEST` at most, then it restarts).
//!
//! If references and voltage show the controller, the loop is closed (`law`) and no recorded voltage drives. An effect
//! that makes the hold-out motion worse is rejected.
//!
//! A fit starts with the equation of motion on short pieces (`start`), continues with windows of one second and ends
//! with whole recordings. A free run that leaves the recorded motion has diverged ([`FreeRun`]); its errors are no
//! residual.
//!
//! Leaves out: several joints; effects between motor and link and on the encoder; periodic torques; warming; filters
//! and delays of the controller.

#[cfg(test)]
mod closed_loop_tests;
mod controllers;
mod describe;
mod driven;
mod faults;
mod fit;
mod free_run;
mod halt;
mod law;
mod log;
mod plant;
mod reading;
mod replay;
mod search;
mod sentences;
#[cfg(test)]
mod servo;
mod significance;
mod simulation;
mod start;
mod stepper;
#[cfg(test)]
mod tests;
mod validation;
mod workflow;

pub use driven::DrivenError;
pub use free_run::FreeRun;
pub use halt::Cause;
pub use replay::{ReplayError, VoltageReplay, replay_voltage};
pub use sentences::terms as controller_terms;
pub use validation::{DrivenBy, VoltageChecked, VoltageValidation, validate_voltage};
pub use workflow::diagnose_voltage;
