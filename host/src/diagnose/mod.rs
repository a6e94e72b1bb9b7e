//! The gap workflow: where simulation and data disagree, which physical effect is missing, what it takes away on data not
//! used, and when to stop.

pub mod outcome;
pub mod runs;

pub use outcome::Diagnosis;
pub use runs::{JointRun, Run};

use crate::prepare::{PrepareError, Recording};
use crate::robot::Robot;

/// Why a diagnosis is not possible.
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
}

/// How a diagnosis is made.
#[derive(Clone, Debug)]
pub struct Options {
    /// Seed of whatever is drawn at random.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1 }
    }
}

/// Says what the robot's model lacks, and gives the description with the effects found and the parameters fitted again.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(
    _robot: &Robot,
    training: &[&dyn Recording],
    _holdout: &[&dyn Recording],
    _options: &Options,
    _progress: &mut dyn FnMut(f64),
) -> Result<(Diagnosis, Robot), DiagnoseError> {
    if training.is_empty() {
        return Err(DiagnoseError::NoRecording);
    }
    Err(DiagnoseError::Model(
        "the search for effects is not part of this build.".into(),
    ))
}
