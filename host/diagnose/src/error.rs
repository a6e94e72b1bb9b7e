//! Reasons why a diagnosis is not possible.

use rig_data::prepare::PrepareError;
use rig_model::robot::RobotError;

/// Reasons why a diagnosis is not possible.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The robot has axes that follow a joint.
    #[error(transparent)]
    Robot(#[from] Box<RobotError>),
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
        /// Reason.
        what: NotDriveOff,
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

/// Reasons why a recording is not usable as one with the drive off.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotDriveOff {
    /// Its modes say that the rig drives.
    #[error("its column mode holds {mode}, in which the rig drives; disarmed is {disarmed}")]
    Driven {
        /// The recorded mode.
        mode: f64,
        /// Number of the mode with the drive off.
        disarmed: u8,
    },
    /// A joint moves, and no mode was recorded.
    #[error(
        "joint {joint} goes from {low:.3} to {high:.3} in it, and no column mode says that the drive was off"
    )]
    Moves {
        /// The joint, from 1.
        joint: usize,
        /// Lowest position, rad or m.
        low: f64,
        /// Highest position, rad or m.
        high: f64,
    },
    /// It is too short.
    #[error(
        "it lasts {seconds:.2} s and has {samples} samples; {least_seconds} s and {least_samples} samples are needed"
    )]
    TooShort {
        /// Its duration, s.
        seconds: f64,
        /// Its samples.
        samples: usize,
        /// Least duration, s.
        least_seconds: f64,
        /// Least number of samples.
        least_samples: usize,
    },
}

/// Reasons why a recording is not usable as one with clamped joints.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(crate) enum NotClamped {
    /// A joint moves.
    #[error("joint {joint} goes from {low:.4} to {high:.4} in it; clamp it")]
    Moves {
        /// The joint, from 1.
        joint: usize,
        /// Lowest position, rad or m.
        low: f64,
        /// Highest position, rad or m.
        high: f64,
    },
    /// It has no motor voltage.
    #[error("it has no motor voltage; record u1, or duty1 with supply")]
    NoVoltage,
}
