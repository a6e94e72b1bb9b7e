//! What the library's parameters ought to come out as, where the emulated rig's law is of the same form or has a
//! counterpart in it.

use nalgebra::Vector3;
use rig_shared::multibody::column;
use serde::Serialize;

use super::answer::Named;
use rig_model::robot::Robot;
use rig_scenario::{Effect, Truth, payload};

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

/// Magnitudes of what was found under the right name beside the truth as it shows against `robot`, the description: torques
/// are what its torque constant makes of the currents, and a payload is what inertia and gravity have grown by beyond its
/// values; all of these are written to three digits.
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
            // 1/(1 + (i/knee)²) begins as 1 − (i/knee)².
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
        // Four elements against one, heat against time: no number of one is a number of the other.
        Effect::Presliding { .. } | Effect::ViscousWarmup { .. } => Vec::new(),
    };
    list.into_iter().flatten().collect()
}

/// The mass at one place that inertia and first moment have grown by beyond what `robot` states.
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
