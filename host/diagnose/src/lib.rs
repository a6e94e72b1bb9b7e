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

mod across;
mod alike;
mod anchor;
#[cfg(test)]
mod arm_tests;
mod bench;
mod bodies;
mod burst;
mod by_motion;
mod change;
mod clamped;
mod coherent;
mod columns;
mod descent;
mod described;
mod drive_off;
mod engine;
mod exceeded;
pub mod experiment;
mod fault;
mod finish;
mod fit;
mod floor;
mod judge;
mod lead;
mod limits;
mod locate;
mod misfit;
mod model;
mod motion;
mod one_way;
#[cfg(test)]
mod one_way_tests;
mod orders;
pub mod outcome;
mod payload;
#[cfg(test)]
mod pendulum_tests;
mod pictures;
#[cfg(test)]
mod planar_tests;
mod position_reading;
mod predicted;
mod profile;
mod proof;
mod pull;
mod quiet;
#[cfg(test)]
mod recorded_tests;
mod refit;
mod rows;
pub mod sanity;
mod search;
mod sentences;
#[cfg(test)]
mod short_tests;
mod simplex;
mod slopes;
mod solve;
mod stated;
#[cfg(test)]
mod test_made;
pub mod testable;
mod touched;
mod transmission;
mod treated;
mod type_b;
pub mod voltage;
mod waves;
mod winding;
mod zeros;

pub use clamped::clamped;
pub use drive_off::sensor_zeros;
pub use engine::diagnose;
use outcome::DataFault;
pub use outcome::Diagnosis;
pub use sentences::{values_alike, what_falls};

use rig_shared::effects::Kind;

use rig_data::prepare::PrepareError;
use rig_data::runs::Run;

/// Settings of a diagnosis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Effects that are left out of the library.
    pub without: Vec<Kind>,
    /// True to fit recordings even if their data have certain faults.
    pub even_if_wrong: bool,
    /// Number of threads; 0 for all that the machine has.
    pub threads: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Zero of each joint's sensor and its standard deviation, from [`sensor_zeros`]; empty if not recorded.
    pub sensor_zeros: Vec<[f64; 2]>,
    /// Recordings of clamped joints, from [`clamped`]; only their voltage is fitted.
    pub clamped: Vec<Run>,
    /// True if the description's format has no field for a constant torque. The constant is then fitted with the
    /// friction, as in an identification.
    pub no_offsets: bool,
}

impl Options {
    /// Returns true if recordings with these faults are fitted.
    fn fits(&self, faults: &[DataFault]) -> bool {
        (faults.iter()).all(|fault| !fault.certain || self.even_if_wrong && fault.leaves_rows())
    }
}

/// Reasons why a diagnosis is not possible.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// Reading or preparing has failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// No recording.
    #[error("No training recording was given; name at least one with --data.")]
    NoRecording,
    /// The robot has no valid model.
    #[error("The robot's model cannot be built: {0}")]
    Model(String),
    /// A recording that is not usable as one with the drive off.
    #[error(
        "{label} cannot be taken as recorded with the drive off: {what}; record a few seconds with the rig disarmed."
    )]
    DriveOff {
        /// Name of the recording.
        label: String,
        /// Reason, a clause.
        what: String,
    },
    /// A recording that is not usable as one with clamped joints.
    #[error("{label} cannot be taken as recorded with the joints clamped: {what}.")]
    Clamped {
        /// Name of the recording.
        label: String,
        /// Reason and remedy, a clause.
        what: String,
    },
    /// Two recordings that hold the same samples.
    #[error(
        "{again} holds samples of {label}: a copy, or a piece cut out of it, says nothing of the noise, and is no motion that was not learnt from; give each sample once."
    )]
    Copy {
        /// Name of the first.
        label: String,
        /// Name of the second.
        again: String,
    },
    /// A recording without torque, current and voltage.
    #[error(
        "{0} has neither torque nor current (a column tau1 or i1), and no motor voltage to go by instead (u1, or duty1 with supply); record one of them, or give its column that name."
    )]
    NoVoltage(String),
}
