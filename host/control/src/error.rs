//! Reasons why a closed loop cannot be simulated or evaluated.

use rig_data::DataError;
use rig_identify::IdentifyError;
use rig_model::robot::RobotError;
use rig_model::simulate::SimulateError;
use rig_shared::control::arm::ControlFault;

/// Reason why a closed loop cannot be simulated or evaluated.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// The robot has axes that follow a joint.
    #[error(transparent)]
    Robot(#[from] Box<RobotError>),
    /// The simulation of the robot.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The base parameters of the model.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The recording.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A law gave no torque.
    #[error("After {time:.3} s the law {law} gave no torque. {fault}")]
    Law {
        /// Name of the law.
        law: &'static str,
        /// When, s.
        time: f64,
        /// The reason.
        fault: ControlFault,
    },
    /// The loop is unstable.
    #[error(
        "The loop with {law} is unstable: joint \"{joint}\" moves at {speed:.3} {unit} after {time:.3} s, {factor:.0} times its limit. Give a smaller --bandwidth, a faster --rate, or another model."
    )]
    Unstable {
        /// Name of the law.
        law: &'static str,
        /// The joint.
        joint: String,
        /// Its speed, rad/s or m/s.
        speed: f64,
        /// Unit of the speed.
        unit: &'static str,
        /// When, s.
        time: f64,
        /// Speed over the limit.
        factor: f64,
    },
    /// Two descriptions are not of one robot.
    #[error(
        "{what} has {found} joints, and the robot has {expected}; give a description of the same robot."
    )]
    OtherRobot {
        /// The description.
        what: String,
        /// Joints of the robot.
        expected: usize,
        /// Joints of the description.
        found: usize,
    },
    /// Other axes follow the joints in the model than in the robot.
    #[error(
        "The axes that follow joints in {0} are not those of the robot (joint, ratio, offset); describe the same robot."
    )]
    OtherFollowers(String),
    /// A joint of the model is of another kind than the robot's.
    #[error(
        "{what} describes another robot: its joint \"{name}\" is {found}, and the robot's joint {place} (\"{own}\") is {expected}; give a description of the same robot."
    )]
    OtherKind {
        /// The description.
        what: String,
        /// Place of the joint, from 1.
        place: usize,
        /// Name of the robot's joint.
        own: String,
        /// Kind of the robot's joint.
        expected: &'static str,
        /// Name of the joint in the description.
        name: String,
        /// Its kind.
        found: &'static str,
    },
    /// A description cannot be the model of a law.
    #[error("{what} cannot be the model of a law: {reason}")]
    Model {
        /// The description.
        what: String,
        /// The reason.
        reason: SimulateError,
    },
    /// A setting is out of range.
    #[error("{name} {value} is not possible: {right}.")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The value.
        value: String,
        /// What would be right.
        right: &'static str,
    },
    /// The tool cannot press on the surface.
    #[error("{0}")]
    Unreachable(String),
}

/// Returns an error if `value` of the setting `name` is not within `range`.
pub(crate) fn within(
    name: &'static str,
    value: f64,
    range: core::ops::RangeInclusive<f64>,
    right: &'static str,
) -> Result<(), ControlError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(ControlError::Setting {
        name,
        value: value.to_string(),
        right,
    })
}
