//! Reasons why results cannot be compared.

use rig_identify::IdentifyError;
use rig_model::robot::RobotError;

/// Reasons why results cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The robot has axes that follow a joint.
    #[error(transparent)]
    Robot(#[from] Box<RobotError>),
    /// Fewer than two sets.
    #[error("{0} set of recordings cannot be compared with itself; give at least two.")]
    TooFew(usize),
    /// Two sets have one name.
    #[error(
        "Two sets are named \"{0}\"; give every set a name of its own with --set NAME=FILE[,FILE…]."
    )]
    TwoOfAName(String),
    /// Two recordings share rows.
    #[error(
        "{first} and {second} hold the same rows: about {percent} % of the shorter recording is in the other one, too. A copy counts its noise twice and confirms nothing; give every recording once, and cut recordings so that no part is in two of them."
    )]
    SameRows {
        /// Label of a recording.
        first: String,
        /// Label of another one.
        second: String,
        /// Estimated share of the shorter recording, in per cent.
        percent: f64,
    },
    /// A recording cannot be read.
    #[error("{0}")]
    Read(String),
    /// A set cannot be identified.
    #[error("Set \"{set}\" cannot be identified: {why}")]
    Set {
        /// Name of the set.
        set: String,
        /// Reason.
        why: IdentifyError,
    },
    /// The robot has no valid model.
    #[error("The robot's model cannot be built: {0}")]
    Model(String),
    /// The covariance of a set cannot be inverted.
    #[error(
        "The covariance of set \"{0}\" is singular, so its errors are not known in every direction; give the set a longer recording."
    )]
    Singular(String),
    /// The tolerance is not a positive number.
    #[error(
        "The tolerance {0} is not possible; give a share of the torque above 0 and at most 1, such as 0.05 for 5 %."
    )]
    Tolerance(f64),
}
