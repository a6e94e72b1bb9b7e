//! Torque that goes with the position of a joint and that the description does not state: the spring of a cable or hose,
//! and ripple of two to six periods a turn, as eccentric gears and the spokes of torque sensors have it.
//!
//! A motion of one frequency ω shows J·q̈ + c·q as (c − Jω²)·q: the data alone cannot tell a spring from an inertia, but the
//! description's inertia can. Without the spring the fit bends masses, inertias and friction until they pull like one,
//! and fails at another speed. A term is taken where it makes data and description together so much more likely as is
//! called very strong (Kass & Raftery 1995), and as many times more as there are terms to choose from; one after the
//! other, the likeliest first. Before the data a term is as likely as not to make all of the joint's torque.
//!
//! Leaves out: hysteresis of the cable, stiffness that grows with the stretch, ripple with the load or of other orders
//! (`rig diagnose` looks for these).

use rig_shared::effects::{Effect, GAINS, Kind, SHAPES};
use serde::Serialize;

use super::linear::product;
use super::terms::terms_of;
use rig_model::robot::{Robot, RobotEffect};
use rig_output::format_value;

/// Torque that goes with a joint's position.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionTorque {
    /// Name of the joint.
    pub joint: String,
    /// Periods in one turn of the joint; none for a spring.
    pub periods: Option<usize>,
    /// Stiffness, N·m/rad or N/m; or amplitudes over the joint's own angle of cosine and sine, N·m.
    pub values: Vec<f64>,
    /// Standard deviations of the values.
    pub std: Vec<f64>,
    /// Logarithm of how many times more likely the data are with it.
    pub log_evidence: f64,
    /// As a description states it.
    pub effect: RobotEffect,
}

impl PositionTorque {
    /// N·m or N at the joint's position `q`.
    pub fn torque(&self, q: f64) -> f64 {
        let mut terms = [0.0; 2];
        terms_of(self.periods, q, &mut terms);
        product(&terms, &self.values)
    }

    /// One sentence.
    pub(super) fn said(&self) -> String {
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

/// As an effect; the gear's law counts the motor's angle, which is `ratio`·q + `zero`. The preload of a spring is the
/// joint's offset.
pub(super) fn effect(
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
