//! True values of the library's parameters, for laws of the emulated rig with a counterpart there.

use nalgebra::Vector3;
use rig_shared::multibody::column;
use serde::Serialize;

use super::answer::Named;
use rig_model::robot::Robot;
use rig_scenario::{Effect, Truth, payload};

/// An estimate and its true value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Name of the parameter in a description.
    pub parameter: &'static str,
    /// True magnitude.
    pub truth: f64,
    /// Estimated magnitude.
    pub found: f64,
    /// Standard deviation of the estimate.
    pub std: f64,
    /// True if both laws have the same form, so the interval must cover the truth.
    pub same_form: bool,
}

impl Compared {
    /// Relative error of the estimate.
    pub fn error(&self) -> f64 {
        (self.found - self.truth).abs() / self.truth.abs()
    }

    /// Returns true if the 95 % interval is finite and holds the truth.
    pub fn covered(&self) -> bool {
        self.std.is_finite() && (self.found - self.truth).abs() <= 1.96 * self.std
    }
}

/// Compares the parameters of a rightly named effect with the truth relative to the description `robot`. Torques are
/// currents times its torque constant, and a payload is the increase of inertia and gravity over its values. The
/// description has three digits.
pub fn compare(effect: &Effect, truth: &Truth, named: &Named, robot: &Robot) -> Vec<Compared> {
    let Some(drive) = robot.joints.first().and_then(|j| j.drive.as_ref()) else {
        return Vec::new();
    };
    let ratio = drive.gear_ratio;
    let constant = drive.torque_constant * ratio;
    let true_of = |name: &str| truth.nominal.get(name).copied().unwrap_or(f64::NAN);
    let scale = constant / true_of("torque_constant");
    let coulomb = scale * true_of("coulomb");
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
    // Amplitude of cosine and sine; their errors are assumed to be uncorrelated.
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
            // The excess has fallen to half where exp(−(v/velocity)²) is ½.
            plain("velocity", velocity / 2f64.ln().sqrt(), false),
        ],
        Effect::AsymmetricCoulomb { difference } => {
            vec![plain("asymmetry", 0.5 * coulomb * difference, true)]
        }
        Effect::QuadraticDrag { coefficient } => {
            vec![plain("coefficient", scale * coefficient, true)]
        }
        Effect::LoadFriction { ratio } => vec![plain("coefficient", ratio, true)],
        Effect::PositionFriction { amplitude: a, .. } => vec![amplitude(a * coulomb)],
        Effect::Cogging { amplitude: a, .. } | Effect::GearEccentricity { amplitude: a, .. } => {
            vec![amplitude(scale * a)]
        }
        Effect::TorqueRipple { amplitude: a, .. } => vec![amplitude(a)],
        Effect::EncoderEccentricity { amplitude: a, .. } => vec![amplitude(a / ratio)],
        Effect::Backlash { gap } => vec![plain("gap", gap, true)],
        Effect::JointElasticity { stiffness, .. } => {
            vec![plain("stiffness", scale * stiffness, true)]
        }
        Effect::CurrentOffset { current } => vec![plain("offset", current * constant, true)],
        Effect::TorqueSaturation { loss } => {
            // 1/(1 + (i/knee)²) is 1 − (i/knee)² for small currents.
            let at_peak = loss / (1.0 - loss) / (Effect::PEAK_CURRENT * constant).powi(2);
            vec![plain("coefficient", at_peak, false)]
        }
        Effect::MeasurementDelay { delay } => vec![plain("delay", delay, true)],
        Effect::GravityTilt { angle } => vec![plain("angle", angle, true)],
        Effect::Payload { mass, distance } => {
            let grown = grown(robot, scale, truth, mass, distance);
            vec![plain("mass", grown, true)]
        }
        Effect::Spring { stiffness, .. } => vec![plain("stiffness", scale * stiffness, true)],
        Effect::DriveDeadzone { voltage } => vec![plain("volts", voltage, true)],
        Effect::TorqueOffset { torque } => vec![plain("offset", scale * torque, true)],
        // The laws differ (four elements and one, heat and time), so their parameters cannot be compared.
        Effect::Presliding { .. } | Effect::ViscousWarmup { .. } => Vec::new(),
    };
    list.into_iter().flatten().collect()
}

/// Point mass that explains the increase of inertia and first moment over the values of `robot`.
fn grown(robot: &Robot, scale: f64, truth: &Truth, mass: f64, distance: f64) -> f64 {
    let true_of = |name: &str| truth.nominal.get(name).copied().unwrap_or(f64::NAN);
    let body = payload(mass, distance);
    let stated = robot.standard_parameters();
    let Some(row) = stated.first() else {
        return f64::NAN;
    };
    let pull = Vector3::from(robot.gravity).norm();
    let moment = scale * (true_of("gravity") / pull + body.mass * body.distance)
        - row[column::FIRST_MOMENT].hypot(row[column::FIRST_MOMENT + 1]);
    let inertia = scale * (true_of("inertia") + body.inertia + body.mass * body.distance.powi(2))
        - row[column::INERTIA + 5]
        - row[column::DRIVE_INERTIA];
    moment * moment / inertia
}
