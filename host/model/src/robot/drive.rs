//! A motor and its gear.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::ball_screw_crank::BallScrewCrank;

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
    /// Limits of the motor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<MotorLimits>,
    /// A ball screw on a crank instead of a constant ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screw: Option<BallScrewCrank>,
}

/// Limits of a motor, all on the motor side. They hold beside those of the joints.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotorLimits {
    /// Lowest and highest angle of the motor, rad
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 2]>,
    /// rad/s
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<f64>,
    /// N·m
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
}
