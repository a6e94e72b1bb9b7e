//! The controller of a joint whose output is a share of the supply voltage, and the supply.

use serde::{Deserialize, Serialize};

/// Behaviour of the integral of the position error while the output is at its limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AntiWindup {
    /// It grows as it does below the limit.
    #[default]
    None,
    /// It stops while the error drives the output further beyond the limit (conditional integration).
    Clamping,
}

/// PID controller with feed-forward of the reference. Its output is a share of the supply voltage: share =
/// proportional·e + integral·∫e − derivative·q̇ + velocity_feedforward·ṙ + acceleration_feedforward·r̈ + bias with e =
/// r − q, within ± `limit`; voltage = share·(supply\[0\] + supply\[1\]·|share|).
///
/// Gains are per rad, or per m for a prismatic joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VoltageController {
    /// 1/rad
    pub proportional: f64,
    /// 1/(rad·s)
    #[serde(default)]
    pub integral: f64,
    /// s/rad, on the velocity of the joint
    #[serde(default)]
    pub derivative: f64,
    /// s/rad, on the velocity of the reference
    #[serde(default)]
    pub velocity_feedforward: f64,
    /// s²/rad, on the acceleration of the reference
    #[serde(default)]
    pub acceleration_feedforward: f64,
    /// Constant share of the supply.
    #[serde(default)]
    pub bias: f64,
    /// Largest share of the supply; absent if there is no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// What the integral does at the limit.
    #[serde(default)]
    pub anti_windup: AntiWindup,
    /// Supply voltage without load, V, and its change up to a share of one, V.
    pub supply: [f64; 2],
}

/// Inputs of a [`VoltageController`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// Reference less position, rad or m.
    pub error: f64,
    /// Its integral over time, rad·s or m·s.
    pub integral: f64,
    /// Velocity of the joint, rad/s or m/s.
    pub velocity: f64,
    /// Velocity of the reference, rad/s or m/s.
    pub reference_velocity: f64,
    /// Acceleration of the reference, rad/s² or m/s².
    pub reference_acceleration: f64,
}

impl VoltageController {
    /// Returns the share of the supply before the limit.
    pub fn unlimited_share(&self, at: &Demand) -> f64 {
        self.proportional * at.error + self.integral * at.integral - self.derivative * at.velocity
            + self.velocity_feedforward * at.reference_velocity
            + self.acceleration_feedforward * at.reference_acceleration
            + self.bias
    }

    /// Returns the growth of the integral of `error` over `dt`, s, for an `unlimited_share`.
    pub fn integrated(&self, unlimited_share: f64, error: f64, dt: f64) -> f64 {
        let beyond = self
            .limit
            .is_some_and(|limit| unlimited_share.abs() > limit);
        let holds_integral =
            beyond && self.anti_windup == AntiWindup::Clamping && unlimited_share * error > 0.0;
        if holds_integral { 0.0 } else { error * dt }
    }

    /// Returns the voltage for an unlimited share, V.
    pub fn voltage(&self, unlimited_share: f64) -> f64 {
        let limit = self.limit.unwrap_or(f64::INFINITY);
        let share = unlimited_share.clamp(-limit, limit);
        share * (self.supply[0] + self.supply[1] * share.abs())
    }

    /// Returns the supply at an output voltage, V: voltage = share·(supply\[0\] + supply\[1\]·|share|).
    pub fn supply_at(&self, voltage: f64) -> f64 {
        let [none, slope] = self.supply;
        // The root of slope·share² + none·share = |voltage| that tends to |voltage| / none for a slope of zero.
        let root = (none * none + 4.0 * slope * voltage.abs()).max(0.0).sqrt();
        let share = 2.0 * voltage.abs() / (none + root);
        none + slope * share
    }
}
