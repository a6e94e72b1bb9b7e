//! The gap workflow: where simulation and data disagree, which physical effect is missing, what it takes away on data not
//! used, and when to stop.

pub mod experiment;
pub mod outcome;
pub mod runs;
pub mod sanity;
pub mod testable;

pub use outcome::Diagnosis;
pub use runs::{JointRun, Run};

use crate::prepare::PrepareError;

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
