//! What the library's parameters ought to come out as, where the emulated rig's law is of the same form or has a
//! counterpart in it.

use serde::Serialize;

use super::answer::Named;
use crate::diagnose::scenario::{Effect, Truth};

/// An estimate beside what is true.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Key in a description.
    pub parameter: &'static str,
    /// Magnitude that is true.
    pub truth: f64,
    /// Magnitude found.
    pub found: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Whether both laws have one form, so that the interval must cover the truth.
    pub same_form: bool,
}

impl Compared {
    /// Relative error.
    pub fn error(&self) -> f64 {
        (self.found - self.truth).abs() / self.truth.abs()
    }

    /// Whether the 95 % interval holds the truth; one without an end holds nothing.
    pub fn covered(&self) -> bool {
        self.std.is_finite() && (self.found - self.truth).abs() <= 1.96 * self.std
    }
}

/// Magnitudes of what was found under the right name beside the truth. `constant` is the joint-side torque constant in
/// N·m/A that the description states, `ratio` the gear's.
pub fn compare(
    effect: &Effect,
    truth: &Truth,
    named: &Named,
    constant: f64,
    ratio: f64,
) -> Vec<Compared> {
    let coulomb = truth.nominal.get("coulomb").copied().unwrap_or(f64::NAN);
    let plain = |parameter: &'static str, value: f64, same_form: bool| {
        let found = named.parameters.get(parameter)?;
        Some(Compared {
            parameter,
            truth: value.abs(),
            found: found.value.abs(),
            std: found.std,
            same_form,
        })
    };
    // Cosine and sine as one amplitude; their errors are taken as uncorrelated.
    let amplitude = |value: f64| {
        let (c, s) = (
            named.parameters.get("cosine")?,
            named.parameters.get("sine")?,
        );
        let found = c.value.hypot(s.value);
        let std = (c.value * c.std).hypot(s.value * s.std) / found.max(f64::MIN_POSITIVE);
        Some(Compared {
            parameter: "amplitude",
            truth: value.abs(),
            found,
            std,
            same_form: true,
        })
    };
    let list = match *effect {
        Effect::Stribeck { ratio, velocity } => vec![
            plain("breakaway", coulomb * (ratio - 1.0), false),
            // Half of the excess is gone where exp(−(v/velocity)²) is ½.
            plain("velocity", velocity / 2f64.ln().sqrt(), false),
        ],
        Effect::AsymmetricCoulomb { difference } => {
            vec![plain("asymmetry", 0.5 * coulomb * difference, true)]
        }
        Effect::QuadraticDrag { coefficient } => vec![plain("coefficient", coefficient, true)],
        Effect::LoadFriction { ratio } => vec![plain("coefficient", ratio, true)],
        Effect::PositionFriction { amplitude: a, .. } => vec![amplitude(a * coulomb)],
        Effect::Cogging { amplitude: a, .. } | Effect::GearEccentricity { amplitude: a, .. } => {
            vec![amplitude(a)]
        }
        Effect::TorqueRipple { amplitude: a, .. } => vec![amplitude(a)],
        Effect::EncoderEccentricity { amplitude: a, .. } => vec![amplitude(a / ratio)],
        Effect::Backlash { gap } => vec![plain("gap", gap, true)],
        Effect::JointElasticity { stiffness, .. } => vec![plain("stiffness", stiffness, true)],
        Effect::CurrentOffset { current } => vec![plain("offset", current * constant, true)],
        Effect::TorqueSaturation { loss } => {
            // 1/(1 + (i/knee)²) begins as 1 − (i/knee)².
            let at_peak = loss / (1.0 - loss) / (Effect::PEAK_CURRENT * constant).powi(2);
            vec![plain("coefficient", at_peak, false)]
        }
        Effect::MeasurementDelay { delay } => vec![plain("delay", delay, true)],
        Effect::GravityTilt { angle } => vec![plain("angle", angle, true)],
        Effect::Payload { mass, .. } => vec![plain("mass", mass, true)],
        Effect::Spring { stiffness, .. } => vec![plain("stiffness", stiffness, true)],
        Effect::DriveDeadzone { voltage } => vec![plain("volts", voltage, true)],
        Effect::TorqueOffset { torque } => vec![plain("offset", torque, true)],
        // Four elements against one, heat against time: no number of one is a number of the other.
        Effect::Presliding { .. } | Effect::ViscousWarmup { .. } => Vec::new(),
    };
    list.into_iter().flatten().collect()
}
