//! Diagnosis of the gap between simulation and data: which physical effect is missing, how much it reduces the hold-out
//! residual, and when to stop.
//!
//! ```no_run
//! use rig_data::Source;
//! use rig_diagnose::{Options, diagnose};
//! use rig_model::robot::Robot;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::load("arm.urdf".as_ref())?;
//! let training = Source::open("train.csv".as_ref(), &robot)?;
//! let holdout = Source::open("holdout.csv".as_ref(), &robot)?;
//! let (found, model) = diagnose(&robot, &[&training], &[&holdout], &Options::default(), &mut |_| ())?;
//! for step in &found.steps {
//!     println!("{} at {}: {:?}", step.effect, step.joint, step.parameters);
//! }
//! println!("{}", model.to_toml()?);
//! # Ok(())
//! # }
//! ```

// The stages; docs/architecture.md has them in the order of a diagnosis.
mod acceptance;
mod columns;
mod description;
mod engine;
pub mod evidence;
pub mod experiment;
pub mod faults;
mod fit;
mod link_encoder;
mod models;
mod motor_voltage;
mod recordings;
mod result;
mod rows;
mod search;
pub mod voltage;

mod error;
mod gap;
mod levels;
mod options;
pub mod outcome;
#[cfg(test)]
mod tests;

pub use engine::diagnose;
pub use error::{DiagnoseError, NotDriveOff};
pub use options::Options;
pub use outcome::Diagnosis;
pub use recordings::clamped::clamped;
pub use recordings::drive_off::sensor_zeros;
pub use result::sentences::effect::values_alike;
pub use result::sentences::residual::what_falls;
