//! Reasons why a diagnosis is not possible.

use rig_data::prepare::PrepareError;

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
