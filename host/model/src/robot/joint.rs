//! A joint, the link that it moves, and their values.

use serde::{Deserialize, Serialize};

use super::array::exact;
use super::drive::Drive;
use super::voltage_controller::VoltageController;

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
    /// Highest speed, rad/s or m/s; ∞ if it is not known.
    #[serde(default = "unknown_speed", skip_serializing_if = "is_unknown_speed")]
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

    /// Returns the highest speed, rad/s or m/s, if it is known.
    pub fn known_velocity(&self) -> Option<f64> {
        Some(self.velocity).filter(|velocity| velocity.is_finite())
    }
}

fn unknown_speed() -> f64 {
    f64::INFINITY
}

fn is_unknown_speed(velocity: &f64) -> bool {
    *velocity == f64::INFINITY
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
