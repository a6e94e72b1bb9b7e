//! Errors of a validation.

use rig_data::prepare::PrepareError;
use rig_identify::IdentifyError;
use rig_model::simulate::SimulateError;

/// Reasons why a description cannot be validated.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// No recording.
    #[error("No recording was given; name at least one.")]
    NoRecording,
    /// The description predicts no torque.
    #[error(
        "The description of {robot} states neither inertia nor friction, so it predicts no torque; `rig identify` writes a description that does."
    )]
    NothingKnown {
        /// Name of the robot.
        robot: String,
    },
    /// Reading or preparing a recording failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The torque could not be predicted.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The model could not be built.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}
