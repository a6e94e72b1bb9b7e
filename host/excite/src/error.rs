//! Errors of a design or a trajectory file.

use std::path::PathBuf;

use rig_shared::multibody::MultibodyError;

use rig_data::DataError;
use rig_identify::IdentifyError;
use rig_model::robot::Place;
use rig_model::simulate::SimulateError;
use rig_output::{WriteError, format_significant};

/// Reasons why there is no trajectory.
#[derive(Debug, thiserror::Error)]
pub enum ExciteError {
    /// Joints without limits.
    #[error(
        "{} no limits of both position and velocity, and a motion is only designed within limits; give both at least, as [joint.limits] in TOML, as <limit lower=\"…\" upper=\"…\" velocity=\"…\" effort=\"…\"/> in a URDF",
        limitless(joints)
    )]
    NoLimits {
        /// Their names.
        joints: Vec<String>,
    },
    /// Limits that are too wide.
    #[error(
        "the limits of joint \"{joint}\" let it move at {} (SI units), and a motion is sized by them; give the velocity, or the acceleration, that its drive can do",
        format_significant(*velocity, 4)
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
    /// A range of a motor that no pose within the limits of the joints reaches.
    #[error(
        "the motor of joint \"{joint}\" may turn between {} and {} rad ([joint.drive.limits] position), but within the limits of the joints it turns between {} and {} rad: give a range that overlaps, or correct gear_ratio, zero or the position limits",
        format_significant(limit[0], 4), format_significant(limit[1], 4), format_significant(turned[0], 4), format_significant(turned[1], 4)
    )]
    MotorAngle {
        /// The joint's name.
        joint: String,
        /// Described range, rad.
        limit: [f64; 2],
        /// Range over all poses, rad.
        turned: [f64; 2],
    },
    /// A torque limit that cannot start a motion at any pose.
    #[error(
        "{} of joint \"{joint}\" is {} {unit}, but to hold the arm against gravity and to move it against dry friction takes {} {unit} or more at every pose within the limits ({} for gravity, {} for friction): give more than that, or correct masses, gravity, friction, gear_ratio or the position limits",
        of.words(), format_significant(*limit, 3), format_significant(*gravity + *coulomb, 3),
        format_significant(*gravity, 3), format_significant(*coulomb, 3), unit = of.unit()
    )]
    Weak {
        /// The joint's name.
        joint: String,
        /// Whose limit it is.
        of: LimitedTorque,
        /// The limit, N·m or N.
        limit: f64,
        /// The least holding torque, N·m or N.
        gravity: f64,
        /// The Coulomb friction, N·m or N.
        coulomb: f64,
    },
    /// A limit so low that a motion over the range would take too long.
    #[error(
        "a motion over the range of joint \"{joint}\" needs a period of {} s at its {limit} of {} {unit}{}, but a period lasts 3600 s at most: correct the limit, narrow the position limits, or give the period",
        format_significant(*period, 3), format_significant(*value, 3), used_share(*share)
    )]
    Slow {
        /// The joint's name.
        joint: String,
        /// The words for the limit.
        limit: &'static str,
        /// The described limit.
        value: f64,
        /// Share of it that the motion may use.
        share: f64,
        /// Its unit.
        unit: &'static str,
        /// The period that it needs, s.
        period: f64,
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
        "poses are for the readings of a wrist sensor, and robot \"{robot}\" has no [wrist_sensor]; write this table into a TOML description (`rig init --from` makes one of a URDF, with the table as a comment to be filled in), or design a motion (without the number of poses), which finds the load by the joint torques"
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
    /// A file that holds something else than the parameters of a motion.
    #[error(
        "{} holds {found}, not the parameters of a motion; give the .toml file that `rig excite --out motion.toml` writes",
        path.display()
    )]
    NoParameters {
        /// The file.
        path: PathBuf,
        /// What it holds.
        found: &'static str,
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
    /// A sampled trajectory whose units are not those of the robot.
    #[error("{}: {what}", path.display())]
    Units {
        /// The file.
        path: PathBuf,
        /// What is wrong with which column, and what would be right.
        what: String,
    },
    /// A sampled trajectory with uneven sampling.
    #[error("{}, row {row}: the samples of a trajectory must be evenly spaced in time, without gaps; sample it at one rate", path.display())]
    Uneven {
        /// The file.
        path: PathBuf,
        /// Line, or number of the message, from 1.
        row: u64,
    },
    /// Samples that do not show the motion between them.
    #[error(
        "{}: the samples come at {} Hz, too seldom for this motion: every second one of joint \"{joint}\" tells the others within {} % of its motion only, and {} % are needed; give samples at a higher rate, or the .toml file of `rig excite`",
        path.display(), format_significant(*rate, 4), format_significant(100.0 * missed, 2), format_significant(100.0 * most, 2)
    )]
    Coarse {
        /// The file.
        path: PathBuf,
        /// The joint's name.
        joint: String,
        /// Samples a second.
        rate: f64,
        /// Share of the motion that every second sample misses.
        missed: f64,
        /// Largest share for an interpolation.
        most: f64,
    },
}

impl ExciteError {
    /// Returns the joint of which a described value leaves no motion, and the keys that lead from its table to the value;
    /// `None` if it is no value of one joint.
    pub fn described_value(&self) -> Option<(&str, &'static [&'static str])> {
        match self {
            Self::MotorAngle { joint, .. } => Some((joint, &["drive", "limits", "position"])),
            Self::Weak { joint, of, .. } => Some((
                joint,
                match of {
                    LimitedTorque::Motor => &["drive", "limits", "torque"],
                    LimitedTorque::Joint(_) => &["limits", "torque"],
                },
            )),
            Self::Infeasible { joint, limit } => Some((
                joint,
                match *limit {
                    "position" => &["limits", "position"],
                    "velocity" => &["limits", "velocity"],
                    "acceleration" => &["limits", "acceleration"],
                    "torque" => &["limits", "torque"],
                    "crank" => &["drive", "screw"],
                    "motor angle" => &["drive", "limits", "position"],
                    "motor speed" => &["drive", "limits", "velocity"],
                    "motor torque" => &["drive", "limits", "torque"],
                    _ => return None,
                },
            )),
            _ => None,
        }
    }
}

/// Whose torque limit cannot move the arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitedTorque {
    /// The joint's, with the limit of its own motor at a constant ratio; true if it is revolute.
    Joint(bool),
    /// The motor's, on its side of coupled drives or of a screw.
    Motor,
}

impl LimitedTorque {
    fn words(self) -> &'static str {
        match self {
            Self::Joint(_) => {
                "the torque limit ([joint.limits], or [joint.drive.limits] times the gear ratio)"
            }
            Self::Motor => "the motor torque limit ([joint.drive.limits])",
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Joint(false) => "N",
            Self::Joint(true) | Self::Motor => "N·m",
        }
    }
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

/// Says which share of a limit is used; nothing if all of it is.
pub(crate) fn used_share(share: f64) -> String {
    match share < 1.0 {
        true => format!(
            " (of which a share of {} is used)",
            format_significant(share, 3)
        ),
        false => String::new(),
    }
}
