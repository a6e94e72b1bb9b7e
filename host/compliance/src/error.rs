//! Reasons why a stiffness or a compliance cannot be computed.

use rig_data::prepare::PrepareError;
use rig_model::robot::RobotError;

/// Reasons why a stiffness or a compliance cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum ComplianceError {
    /// The robot has axes that follow a joint.
    #[error(transparent)]
    Robot(#[from] Box<RobotError>),
    /// Reading a recording failed.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The robot has no valid model.
    #[error("The robot's model cannot be built: {0}")]
    Model(String),
    /// A pose, an option or a stiffness is impossible. The text is a whole sentence.
    #[error("{0}")]
    Option(String),
    /// The motors do not move all joints at a pose.
    #[error(
        "At the pose {pose} the motors do not move all joints independently: the Jacobian of the drives is singular; give another pose."
    )]
    SingularDrives {
        /// The pose.
        pose: String,
    },
    /// A recording cannot be used. The text is a whole sentence.
    #[error("{0}")]
    Recording(String),
}
