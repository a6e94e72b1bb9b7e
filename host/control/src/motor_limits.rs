//! Limits of the motors that a motion exceeds, on their side of the gears.

use super::closed_loop::Trace;
use super::design::at_start;
use super::error::ControlError;
use rig_model::robot::Robot;
use rig_output::{format_significant, listed};

/// Part of a limit by which a value beyond it is rounding.
const ROUNDING: f64 = 1e-6;
/// Names and units of what is limited.
const QUANTITIES: [(&str, &str); 3] = [("angle", "rad"), ("speed", "rad/s"), ("torque", "N·m")];

/// A limit of one motor, and the value that is farthest beyond it.
struct Limit {
    joint: usize,
    /// Index of the quantity.
    quantity: usize,
    range: [f64; 2],
    /// Distance from the limit, value and time.
    farthest: Option<[f64; 3]>,
}

impl Limit {
    /// Returns all described limits.
    fn all(robot: &Robot) -> Vec<Self> {
        let mut all = Vec::new();
        for (joint, own) in robot.joints.iter().enumerate() {
            let Some(limits) = own.drive.as_ref().and_then(|drive| drive.limits.as_ref()) else {
                continue;
            };
            let both = |most: Option<f64>| most.map(|most| [-most, most]);
            let ranges = [limits.position, both(limits.velocity), both(limits.torque)];
            for (quantity, range) in ranges.into_iter().enumerate() {
                all.extend(range.map(|range| Self {
                    joint,
                    quantity,
                    range,
                    farthest: None,
                }));
            }
        }
        all
    }

    fn note(&mut self, value: f64, time: f64) {
        let [low, high] = self.range;
        let beyond = (low - value).max(value - high);
        let least = self
            .farthest
            .map_or(ROUNDING * low.abs().max(high.abs()), |[own, ..]| own);
        if beyond > least {
            self.farthest = Some([beyond, value, time]);
        }
    }

    fn words(&self, robot: &Robot) -> Option<String> {
        let [_, value, time] = self.farthest?;
        let (name, unit) = QUANTITIES[self.quantity];
        let short = |x: f64| format_significant(x, 3);
        Some(format!(
            "the {name} of the motor of joint \"{}\" is {} {unit} after {time:.2} s, and may be {} to {} {unit}",
            robot.joints[self.joint].name,
            short(value),
            short(self.range[0]),
            short(self.range[1])
        ))
    }
}

/// Returns a sentence on the limits of motors that a motion exceeds; `None` if it keeps them or none is described.
pub(crate) fn exceeded(robot: &Robot, trace: &Trace) -> Result<Option<String>, ControlError> {
    let mut limits = Limit::all(robot);
    if limits.is_empty() {
        return Ok(None);
    }
    let failed = |e: rig_shared::transmission::TransmissionError| at_start(e.into());
    let transmission = robot.transmission().map_err(failed)?;
    let n = robot.joints.len();
    let [mut q, mut v, mut tau] = [(); 3].map(|()| vec![0.0; n]);
    let mut motor = [(); 3].map(|()| vec![0.0; n]);
    for k in 0..trace.q.first().map_or(0, Vec::len) {
        let before = k.saturating_sub(1);
        for j in 0..n {
            q[j] = trace.q[j][k];
            v[j] = (q[j] - trace.q[j][before]) / trace.period;
            tau[j] = trace.torque[j][k];
        }
        let [angle, speed, torque] = &mut motor;
        transmission.motor_position(&q, angle).map_err(failed)?;
        (transmission.motor_velocity(&q, &v, speed)).map_err(failed)?;
        (transmission.motor_torque(&q, &tau, torque)).map_err(failed)?;
        for limit in &mut limits {
            let value = motor[limit.quantity][limit.joint];
            limit.note(value, k as f64 * trace.period);
        }
    }
    let parts: Vec<String> = limits.iter().filter_map(|own| own.words(robot)).collect();
    Ok((!parts.is_empty()).then(|| {
        format!(
            "motors leave their limits ([joint.drive.limits]), which the simulation does not enforce, so that the robot cannot do this: {}. Give a slower motion, a lower --bandwidth or a smaller --press.",
            listed(&parts)
        )
    }))
}
