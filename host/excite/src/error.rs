//! Errors of a design or a trajectory file.

use std::path::PathBuf;

use rig_shared::multibody::MultibodyError;

use rig_data::DataError;
use rig_identify::IdentifyError;
use rig_model::robot::Place;
use rig_model::simulate::SimulateError;
use rig_output::WriteError;

/// Reasons why there is no trajectory.
#[derive(Debug, thiserror::Error)]
pub enum ExciteError {
    /// Joints without limits.
    #[error(
        "{} no limits, and a motion is only designed within limits; give position and velocity at least, as [joint.limits] in TOML, as <limit lower=\"…\" upper=\"…\" velocity=\"…\" effort=\"…\"/> in a URDF",
        limitless(joints)
    )]
    NoLimits {
        /// Their names.
        joints: Vec<String>,
    },
    /// Limits that are too wide.
    #[error(
        "the limits of joint \"{joint}\" let it move at {velocity:e} (SI units), and a motion is sized by them; give the velocity, or the acceleration, that its drive can do"
    )]
    Boundless {
        /// Its name.
        joint: String,
        /// Velocity within the limits, rad/s or m/s.
        velocity: f64,
    },
    /// An option outside its range.
    #[error("the {name} is {value}, but {right}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Given value.
        value: String,
        /// Valid values.
        right: String,
    },
    /// No motion fits.
    #[error(
        "no motion was found within the limits: the {limit} limit of joint \"{joint}\" is too tight; widen it, choose another start position, or a longer period"
    )]
    Infeasible {
        /// Its name.
        joint: String,
        /// position, velocity, acceleration, torque, crank, motor angle, motor speed, motor torque or workspace
        limit: &'static str,
    },
    /// The limits leave no room for a staged motion.
    #[error("no {kind} fits joint \"{joint}\": {why}")]
    NoRoom {
        /// The kind of motion.
        kind: &'static str,
        /// The joint's name.
        joint: String,
        /// Reason and remedy.
        why: String,
    },
    /// Poses without a wrist sensor.
    #[error(
        "poses are for the readings of a wrist sensor, and robot \"{robot}\" has no [wrist_sensor]; add this table to the TOML description (of a URDF, `rig init --from` writes one), or design a motion (without the number of poses), which finds the load by the joint torques"
    )]
    NoSensor {
        /// Name of the robot.
        robot: String,
    },
    /// Poses that do not turn gravity enough.
    #[error(
        "within the limits, gravity turns too little in the frame of the wrist sensor, so poses at rest cannot tell the centre of mass from the biases of the moments; widen the limits of the joints that tilt the flange, or design a motion (without the number of poses)"
    )]
    NoTilt,
    /// The base parameters cannot be found.
    #[error(transparent)]
    Base(#[from] IdentifyError),
    /// The model cannot be built or simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Lengths do not match the chain.
    #[error(transparent)]
    Multibody(#[from] MultibodyError),
    /// A sampled trajectory cannot be read or written.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A file cannot be read.
    #[error("cannot read the trajectory {}: {source}; give the path of a .toml or .csv file that `rig excite` wrote", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// An unknown file extension.
    #[error("{} ends neither in .toml (the trajectory's parameters) nor in .csv (its samples); name one of them", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A file too large to be a parametric trajectory.
    #[error("{} is larger than 1 MiB, but a trajectory file is a short text; is this a recording?", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// Invalid TOML, or TOML that describes no trajectories.
    #[error("{}:{place}: {message}", path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// Position in the file.
        place: Place,
        /// One sentence: the error and a remedy.
        message: String,
    },
    /// The file belongs to another robot.
    #[error("{} moves {found}, but robot \"{robot}\" has {expected}; design a trajectory for this robot with `rig excite`", path.display())]
    OtherRobot {
        /// The file.
        path: PathBuf,
        /// The robot's name.
        robot: String,
        /// The joints in the file.
        found: String,
        /// The robot's joints.
        expected: String,
    },
    /// A trajectory file of several joints for the rig, which has one.
    #[error(
        "{} moves {joints} joints, but the rig has one; design the motion with `rig excite` from the rig's description",
        path.display()
    )]
    SeveralJoints {
        /// The file.
        path: PathBuf,
        /// Number of joints.
        joints: usize,
    },
    /// A sampled trajectory with uneven sampling.
    #[error("{}, row {row}: the samples of a trajectory must be evenly spaced in time, without gaps; sample it at one rate", path.display())]
    Uneven {
        /// The file.
        path: PathBuf,
        /// Line, or number of the message, from 1.
        row: u64,
    },
}

/// Returns the joints with the right form of "have".
fn limitless(joints: &[String]) -> String {
    let list = joints.join("\", \"");
    match joints.len() {
        1 => format!("joint \"{list}\" has"),
        _ => format!("joints \"{list}\" have"),
    }
}

/// Returns the error of an option: its name, its value and a remedy.
pub(super) fn wrong(name: &'static str, value: String, right: String) -> ExciteError {
    ExciteError::Option { name, value, right }
}
