//! The robot description: read from TOML or URDF, written back.
//!
//! Joint-side SI units throughout; angles grow in the positive sense of the joint axis.

use serde::{Deserialize, Serialize};

/// A serial robot as a file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Name for titles and files.
    pub name: String,
    /// Gravity acceleration in the base frame, m/s².
    pub gravity: [f64; 3],
    /// Joints from the base outwards.
    #[serde(rename = "joint")]
    pub joints: Vec<Joint>,
    /// Effects beyond the standard model, as `diagnose` adds them; kept as read.
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<toml::Table>,
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
    /// The position controller, for simulation; absent means the recording's torque is applied.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controller: Option<Controller>,
}

/// Inertial parameters of a link in its own frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertial {
    /// kg
    pub mass: f64,
    /// m·c, kg·m
    pub first_moment: [f64; 3],
    /// Ixx Ixy Ixz Iyy Iyz Izz about the origin of the frame, kg·m²
    pub inertia: [f64; 6],
}

/// Limits of a joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointLimits {
    /// Lowest and highest position, rad or m.
    pub position: [f64; 2],
    /// Highest speed, rad/s or m/s.
    pub velocity: f64,
    /// Highest acceleration, rad/s² or m/s².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<f64>,
    /// Highest torque or force, N·m or N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
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

/// Motor and gear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Motor turns per joint turn (negative where the gear reverses).
    pub gear_ratio: f64,
    /// kg·m², on the motor side
    #[serde(default)]
    pub rotor_inertia: f64,
    /// N·m/A, on the motor side
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
    /// 0 where brushed
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pole_pairs: Option<u32>,
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
