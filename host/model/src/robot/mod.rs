//! The robot description: read from TOML or URDF, written back.
//!
//! Joint-side SI units throughout; angles grow in the positive sense of the joint axis.
//!
//! Frames follow the modified Denavit–Hartenberg convention (Craig, *Introduction to Robotics*, 1989,
//! eq. 3.6; Khalil & Dombre 2002, sec. 3.2): frame i−1 → i is
//! RotX(alpha) · TransX(a) · RotZ(theta + σ̄q) · TransZ(d + σq), with σ = 1 where prismatic, σ̄ = 1 − σ.

mod angles;
mod array;
mod band;
mod bare;
mod bodies;
mod check;
mod check_drives;
mod degrees;
mod dh;
mod drives;
mod effects;
mod encoding;
mod error;
mod inertia;
mod numbers;
mod screw;
mod sizes;
mod text;
mod unlikely;
mod urdf;
mod voltage_controller;
mod workspace;
mod worth;
mod written;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};

use self::array::exact;

pub use band::IdentifiedBand;
pub use band::MOST_LEAD;
pub use check::EFFECT_NAMES;
pub use check::{sound, written};
pub use effects::sane;
pub use effects::{Placed, RobotEffect, title_of, unit_of};
use encoding::{Decoded, decoded};
pub use error::{Place, RobotError};
pub use screw::Screw;
pub use urdf::is_placeholder;
pub use urdf::{Original, Urdf};
pub use voltage_controller::Demand;
pub use voltage_controller::{AntiWindup, VoltageController};
pub use workspace::Region;
pub use worth::{CONTRADICTED, DESCRIBED, Origin, Quantity, STAND_IN, Worth, worth};

/// Largest robot description that is read. The largest published URDF files have a hundredth of this size.
pub const MAX_BYTES: u64 = 16 << 20;

/// Description that `rig init one-link` writes: the one-link rig. Every line has its unit and meaning.
pub const ONE_LINK_TEMPLATE: &str = include_str!("../../../robots/one-link.toml");

/// The EMPS axis (Janot, Gautier, Brunot 2019) without prior inertial or friction values.
pub const EMPS: &str = include_str!("../../../robots/emps.toml");

/// The IRp-6 with its ball screws, absolute drives and coupled wrist. Each figure has its source.
pub const IRP6_TEMPLATE: &str = include_str!("../../../robots/irp6.toml");

/// A planar arm with two direct drives, like the EDDA. Every figure is representative.
pub const EDDA_TEMPLATE: &str = include_str!("../../../robots/edda.toml");

/// The Stäubli TX40 with its coupled wrist, for its published recording.
pub const TX40: &str = include_str!("../../../robots/tx40.toml");

/// The double pendulum of the DFKI whose public recordings the project reproduces.
pub const DOUBLE_PENDULUM: &str = include_str!("../../../robots/double-pendulum.toml");

/// The pendulum on a Dynamixel XL330. Its public recordings have a voltage and no current.
pub const XL330: &str = include_str!("../../../robots/xl330.toml");

/// A serial robot as a file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Name for titles and files.
    pub name: String,
    /// Gravity acceleration in the base frame, m/s².
    #[serde(deserialize_with = "exact")]
    pub gravity: [f64; 3],
    /// Joints from the base outwards.
    #[serde(rename = "joint")]
    pub joints: Vec<Joint>,
    /// Regions that points of the links must not leave.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub workspace: Vec<Region>,
    /// Effects beyond the standard model, as `diagnose` adds them.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<RobotEffect>,
    /// Band of the identification, if the values were identified.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified: Option<IdentifiedBand>,
    /// Source of the values. It decides how far they are trusted ([`worth`]). Not stored in the file.
    #[serde(skip)]
    pub origin: Origin,
    /// Frame of the last URDF link in the frame of the last joint. Identity if no URDF was read. Not stored in the
    /// file.
    #[serde(skip)]
    pub last_link: nalgebra::Isometry3<f64>,
}

/// Revolute or prismatic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Rotation about z; σ = 0.
    Revolute,
    /// Translation along z; σ = 1.
    Prismatic,
}

impl JointKind {
    /// Units of position and effort (torque or force), ASCII.
    pub const fn units(self) -> (&'static str, &'static str) {
        match self {
            Self::Revolute => ("rad", "N*m"),
            Self::Prismatic => ("m", "N"),
        }
    }
}

/// One joint with the link that it moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Name, unique in the robot.
    pub name: String,
    /// Kind of joint.
    pub kind: JointKind,
    /// Modified Denavit–Hartenberg: rotation about x of frame i−1, rad.
    pub alpha: f64,
    /// Translation along x of frame i−1, m.
    pub a: f64,
    /// Rotation about z of frame i, rad (offset where revolute).
    pub theta: f64,
    /// Translation along z of frame i, m (offset where prismatic).
    pub d: f64,
    /// Prior inertial parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertial: Option<Inertial>,
    /// Limits of the joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<JointLimits>,
    /// Prior friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<JointFriction>,
    /// The drive; absent means an ideal torque source on the joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive: Option<Drive>,
    /// The position controller, for simulation; absent means that the recorded torque is applied.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controller: Option<Controller>,
    /// The position controller and supply of a joint whose motor voltage is known; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voltage_controller: Option<VoltageController>,
}

impl Joint {
    /// Returns the motor turns per joint turn, with sign; 1 without a drive, or if only a screw moves the joint.
    pub fn gear_ratio(&self) -> f64 {
        let ratio = self.drive.as_ref().map(|drive| drive.gear_ratio);
        ratio.filter(|ratio| *ratio != 0.0).unwrap_or(1.0)
    }
}

/// Inertial parameters of a link in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertial {
    /// kg
    pub mass: f64,
    /// m·c, kg·m
    #[serde(deserialize_with = "exact")]
    pub first_moment: [f64; 3],
    /// Ixx Ixy Ixz Iyy Iyz Izz about the origin of the frame, kg·m²
    #[serde(deserialize_with = "exact")]
    pub inertia: [f64; 6],
}

impl Inertial {
    /// Returns one kilogram at a point, m.
    pub fn point([x, y, z]: [f64; 3]) -> Self {
        let [xx, yy, zz] = [y * y + z * z, x * x + z * z, x * x + y * y];
        Self {
            mass: 1.0,
            first_moment: [x, y, z],
            inertia: [xx, -x * y, -x * z, yy, -y * z, zz],
        }
    }

    /// Returns mass, first moment and inertia in the order of the standard parameters.
    pub fn parameters(&self) -> [f64; 10] {
        let [x, y, z] = self.first_moment;
        let [xx, xy, xz, yy, yz, zz] = self.inertia;
        [self.mass, x, y, z, xx, xy, xz, yy, yz, zz]
    }
}

/// Limits of a joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointLimits {
    /// Lowest and highest position, rad or m; −∞ and ∞ if a revolute joint turns without limit.
    #[serde(deserialize_with = "exact")]
    pub position: [f64; 2],
    /// Lowest and highest position for designed motions, rad or m, if narrower than the joint's range (a URDF's
    /// `safety_controller`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub soft_position: Option<[f64; 2]>,
    /// Highest speed, rad/s or m/s.
    pub velocity: f64,
    /// Highest acceleration, rad/s² or m/s².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<f64>,
    /// Highest torque or force, N·m or N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
}

impl JointLimits {
    /// Returns the range for designed motions.
    pub fn for_motions(&self) -> [f64; 2] {
        self.soft_position.unwrap_or(self.position)
    }
}

/// Joint-side friction of the standard model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointFriction {
    /// N·m or N
    pub coulomb: f64,
    /// N·m·s/rad or N·s/m
    pub viscous: f64,
    /// Constant torque at the joint, N·m or N
    #[serde(default)]
    pub offset: f64,
}

/// Motor and gear. Motor position = gear_ratio·q + Σ couples·q_j + contribution of the screw + zero.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Motor turns per joint turn (negative if the gear reverses); 0 (key absent) if a screw moves the joint.
    #[serde(default)]
    pub gear_ratio: f64,
    /// Motor turns per turn of other joints, by their names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub couples: BTreeMap<String, f64>,
    /// Motor position with all joints at zero (without the contribution of a screw), rad
    #[serde(default)]
    pub zero: f64,
    /// kg·m², on the motor side
    #[serde(default)]
    pub rotor_inertia: f64,
    /// Inertia of gear and shaft seen at the joint, without the rotors, kg·m² (kg where prismatic). In a coupled drive
    /// it may be negative: the rotors of other drives may add more to this joint than its identified total.
    #[serde(default)]
    pub joint_inertia: f64,
    /// Coulomb friction on the motor side, N·m
    #[serde(default)]
    pub coulomb: f64,
    /// Viscous friction on the motor side, N·m·s/rad
    #[serde(default)]
    pub viscous: f64,
    /// N·m/A, on the motor side; 0 (key absent) if unknown: motor currents then cannot be used
    #[serde(default)]
    pub torque_constant: f64,
    /// Ω
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resistance: Option<f64>,
    /// H
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inductance: Option<f64>,
    /// Counts per motor turn after quadrature
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder_counts_per_rev: Option<f64>,
    /// Value of the recording's `duty` column that means full supply; 1 if absent
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duty_full_scale: Option<f64>,
    /// Number of pole pairs; 0 if brushed
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pole_pairs: Option<u32>,
    /// A ball screw on a crank instead of a constant ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screw: Option<Screw>,
}

/// Cascade of a proportional position loop and a proportional velocity loop:
/// τ = torque_gain · (velocity_gain · (position_gain · (ref − q) − q̇)).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Controller {
    /// 1/s
    pub position_gain: f64,
    /// Controller output per rad/s (or m/s) of velocity error
    pub velocity_gain: f64,
    /// N·m (or N) per unit of controller output
    #[serde(default = "one")]
    pub torque_gain: f64,
}

fn one() -> f64 {
    1.0
}

/// Returns the commented description that `rig init <kind>` writes, or `None` for an unknown kind.
pub fn template(kind: &str) -> Option<&'static str> {
    match kind {
        "one-link" => Some(ONE_LINK_TEMPLATE),
        "edda" => Some(EDDA_TEMPLATE),
        "irp6" => Some(IRP6_TEMPLATE),
        "emps" => Some(EMPS),
        "tx40" => Some(TX40),
        "double-pendulum" => Some(DOUBLE_PENDULUM),
        "xl330" => Some(XL330),
        _ => None,
    }
}

impl Robot {
    /// Reads a description. The extension selects TOML or URDF; for other extensions the first character does.
    pub fn load(path: &Path) -> Result<Self, RobotError> {
        Ok(Description::load(path)?.robot)
    }

    /// Reads TOML text; `path` only names the source in messages. [`Description::load`] also returns the remarks.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, RobotError> {
        Ok(text::read(text, path)?.0)
    }

    /// Reads URDF text (serial chain; fixed joints are merged) and converts it to modified
    /// Denavit–Hartenberg frames; `path` only names the source in messages.
    ///
    /// Every joint keeps the URDF's zero and positive sense: z of its frame is the URDF axis.
    pub fn from_urdf(text: &str, path: &Path) -> Result<Self, RobotError> {
        let chain = urdf::read(text, path)?;
        let robot = dh::convert(&chain).robot;
        urdf::check_sizes(&chain, &robot, path)?;
        Ok(robot)
    }

    /// Returns the description as TOML with units in comments. [`Robot::from_toml`] reads back an equal description.
    pub fn to_toml(&self) -> Result<String, RobotError> {
        written::write(self)
    }

    /// Returns the index (from 0) of the joint called `name`.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|j| j.name == name)
    }
}

/// A file that describes a robot.
#[derive(Debug)]
pub struct Description {
    /// The robot.
    pub robot: Robot,
    /// The file itself, if it is URDF.
    pub urdf: Option<Original>,
    /// Remarks for the user, one sentence each.
    pub remarks: Vec<String>,
}

impl Description {
    /// Reads a description. The extension selects TOML or URDF; for other extensions the first character does.
    ///
    /// # Errors
    /// [`RobotError`] with the fault of the file and its line.
    pub fn load(path: &Path) -> Result<Self, RobotError> {
        let (text, from) = read_text(path)?;
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        let urdf = match extension.as_deref() {
            Some("toml") => false,
            Some("urdf") => true,
            _ => text.trim_start().starts_with('<'),
        };
        if !urdf {
            let (robot, mut remarks) = text::read(&text, path)?;
            remarks.extend(robot.implausible_bodies(None));
            remarks.extend(robot.limits_in_degrees());
            remarks.extend(robot.unlikely_values());
            return Ok(Self {
                remarks,
                robot,
                urdf: None,
            });
        }
        let original = Original::read(text, path)?;
        let robot = original.robot().clone();
        let mut remarks = original.remarks().to_vec();
        remarks.extend(from.map(|name| {
            format!(
                "{} was read as {name}; a URDF that is written from it is UTF-8.",
                path.display()
            )
        }));
        remarks.extend(robot.implausible_bodies(Some(&original)));
        remarks.extend(robot.limits_in_degrees());
        remarks.extend(robot.unlikely_values());
        Ok(Self {
            robot,
            urdf: Some(original),
            remarks,
        })
    }
}

/// Reads the whole file as text. Returns its encoding too if that is not UTF-8. Refuses a directory, and a file that is
/// too large, empty or not text.
fn read_text(path: &Path) -> Result<(String, Option<&'static str>), RobotError> {
    let failed = |source| RobotError::Read {
        path: path.into(),
        source,
    };
    if std::fs::metadata(path).map_err(failed)?.is_dir() {
        return Err(RobotError::Directory { path: path.into() });
    }
    let mut bytes = Vec::new();
    // One byte more than allowed: this detects an oversized file even if its length is unknown.
    let mut limited = File::open(path).map_err(failed)?.take(MAX_BYTES + 1);
    limited.read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(RobotError::TooLarge { path: path.into() });
    }
    let Decoded { text, from } = decoded(&bytes).map_err(|wrong| RobotError::NotText {
        path: path.into(),
        offset: wrong.offset,
        line: wrong.line,
    })?;
    if text.trim().is_empty() {
        return Err(RobotError::Empty { path: path.into() });
    }
    Ok((text, from))
}

#[cfg(test)]
mod drives_test;
#[cfg(test)]
mod tests;
