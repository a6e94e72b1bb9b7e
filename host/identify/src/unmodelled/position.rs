//! Position-dependent joint torque beyond the description: the spring of a cable or hose, and ripple of two to six
//! periods per turn, as from eccentric gears and the spokes of torque sensors.
//!
//! A motion of one frequency ω shows J·q̈ + c·q as (c − Jω²)·q. The data alone cannot separate a spring from an
//! inertia; the described inertia can. Without the spring the fit distorts masses, inertias and friction to imitate it,
//! and fails at another speed. A term is accepted if the evidence for it is "very strong" (Kass & Raftery 1995), times
//! the number of candidate terms. Terms are added one at a time, the most likely first. The prior deviation of a term
//! makes all of the joint's torque.
//!
//! Limits: no hysteresis of the cable, no progressive stiffness, no ripple with the load or of other orders (`rig
//! diagnose` searches for these).

use rig_shared::effects::{Effect, GAINS, Kind, SHAPES};
use serde::Serialize;

use super::terms::terms_of;
use rig_model::robot::{Robot, RobotEffect};
use rig_numerics::vector::dot_in_order;
use rig_output::format_value;

/// A torque that depends on a joint's position.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionTorque {
    /// Name of the joint.
    pub joint: String,
    /// Periods per turn of the joint; none for a spring.
    pub periods: Option<usize>,
    /// Stiffness, N·m/rad or N/m; or amplitudes of cosine and sine over the joint's own angle, N·m.
    pub values: Vec<f64>,
    /// Standard deviations of the values.
    pub std: Vec<f64>,
    /// Logarithm of the likelihood ratio of the data with and without it.
    pub log_evidence: f64,
    /// The effect in the description.
    pub effect: RobotEffect,
}

impl PositionTorque {
    /// Returns the torque, N·m or N, at the joint's position `q`.
    pub fn torque(&self, q: f64) -> f64 {
        let mut terms = [0.0; 2];
        terms_of(self.periods, q, &mut terms);
        dot_in_order(&terms, &self.values)
    }

    /// Returns one sentence.
    pub(crate) fn said(&self) -> String {
        let what = match self.periods {
            None => format!(
                "like a spring of {} (N*m/rad or N/m), as a cable or hose pulls",
                format_value(self.values[0], self.std[0])
            ),
            Some(periods) => format!(
                "with {periods} periods a turn and {} N*m, as eccentric gears and the spokes of a torque sensor have it",
                format_value(
                    self.values[0].hypot(self.values[1]),
                    self.std[0].hypot(self.std[1])
                )
            ),
        };
        format!(
            "Joint {}: a part of the torque goes with its position, {what}; data and description are e^{:.0} times as likely with it; a torque reading that saturates or is off by a factor can look alike. It was taken off the torque before the fit, and identified.toml states it. Errors are relative to the torque as measured.",
            self.joint, self.log_evidence
        )
    }
}

/// Converts it to an effect. The gear's law uses the motor's angle, `ratio`·q + `zero`. The preload of a spring is the
/// joint's offset.
pub(crate) fn effect(
    robot: &Robot,
    joint: usize,
    periods: Option<usize>,
    values: &[f64],
    [ratio, zero]: [f64; 2],
) -> RobotEffect {
    let (mut gains, mut shapes) = ([0.0; GAINS], [0.0; SHAPES]);
    let kind = match periods {
        None => {
            gains[0] = values[0];
            Kind::Spring
        }
        Some(periods) => {
            let order = periods as f64 / ratio.abs();
            let (sine, cosine) = (order * zero).sin_cos();
            let (a, b) = (values[0], values[1] * ratio.signum());
            gains[0] = a * cosine - b * sine;
            gains[1] = a * sine + b * cosine;
            shapes[0] = order;
            Kind::GearEccentricity
        }
    };
    RobotEffect {
        joint: Some(robot.joints[joint].name.clone()),
        other: None,
        effect: Effect {
            kind,
            gains,
            shapes,
        },
    }
}
