//! The closed loop, sample by sample.

use super::controllers::wish;
use super::error::SimulateError;
use super::history::Since;
use super::link_motion::{LinkMotion, LinkTrace};
use super::model::Model;
use super::step::Stepper;
use crate::robot::{Controller, Robot};

/// Inputs of a simulation, sample by sample.
pub struct Inputs<'a> {
    /// Sample period, s.
    pub period: f64,
    /// Reference positions: one slice a joint, one value a sample.
    pub reference: &'a [Vec<f64>],
    /// Torques that the controllers add to their output, within the torque limit, same shape; empty for none.
    pub feed_forward: &'a [Vec<f64>],
    /// Torques added after the controllers (disturbances), same shape; empty for none.
    pub added: &'a [Vec<f64>],
    /// Initial positions.
    pub q: &'a [f64],
    /// Initial velocities.
    pub v: &'a [f64],
    /// Steps within one sample.
    pub substeps: u32,
    /// True if the controllers run once a sample and hold their torque. Otherwise they run at every step, with a
    /// reference interpolated smoothly between samples, like a drive whose loop is faster than its recorder.
    pub held: bool,
}

impl Inputs<'_> {
    /// Returns reference and feed-forward of joint `i` at `beyond` samples after sample `k`; the last values hold.
    fn asked(&self, i: usize, k: usize, beyond: f64) -> [f64; 2] {
        [self.reference, self.feed_forward].map(|series| {
            let values = series.get(i).map_or(&[][..], Vec::as_slice);
            between(values, k, beyond)
        })
    }
}

/// Interpolates at `beyond` samples after sample `k` by the cubic of Catmull and Rom (1974), which is exact for a parabola:
/// straight lines between the samples would have another mean than the reference, and so another torque at the samples
/// than between them. Beyond the ends the series goes on with its last second difference.
fn between(values: &[f64], k: usize, beyond: f64) -> f64 {
    let (now, next) = match values.get(k..) {
        Some([now, next, ..]) => (*now, *next),
        Some([now]) => return *now,
        _ => return 0.0,
    };
    let before = k.checked_sub(1).map(|k| values[k]);
    let after = values.get(k + 2).copied();
    let (before, after) = match (before, after) {
        (Some(before), Some(after)) => (before, after),
        (Some(before), None) => (before, before + 3.0 * (next - now)),
        (None, Some(after)) => (after - 3.0 * (next - now), after),
        (None, None) => (2.0 * now - next, 2.0 * next - now),
    };
    let bend = 2.0 * before - 5.0 * now + 4.0 * next - after;
    let twist = 3.0 * (now - next) + after - before;
    now + 0.5 * beyond * (next - before + beyond * (bend + beyond * twist))
}

/// A simulated motion: per joint one value a sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Positions as the sensors read them; of the motor, if it is a separate mass.
    pub q: Vec<Vec<f64>>,
    /// Velocities, from the same sensors.
    pub qd: Vec<Vec<f64>>,
    /// Torques of the controllers (without `Inputs::added`), as the sensors read them. If they are not held, the mean
    /// of the torques before and after the sample.
    pub tau: Vec<Vec<f64>>,
    /// Per joint, number of samples in whose period the torque limit cut the controller's output.
    pub saturated: Vec<usize>,
}

/// Simulates the closed loop over all samples of the reference. Calls `progress` with the number of finished samples.
///
/// # Errors
/// [`SimulateError`], with the joint at fault.
pub fn closed_loop(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    inputs: &Inputs<'_>,
    progress: impl FnMut(usize),
) -> Result<Motion, SimulateError> {
    closed_loop_since(
        robot,
        model,
        controllers,
        inputs,
        &Since::default(),
        progress,
    )
}

/// Same as [`closed_loop`], for joints that have been running.
///
/// # Errors
/// Same as [`closed_loop`].
pub fn closed_loop_since(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    inputs: &Inputs<'_>,
    since: &Since,
    mut progress: impl FnMut(usize),
) -> Result<Motion, SimulateError> {
    closed_loop_watched(robot, model, controllers, inputs, since, |k, _| {
        progress(k + 1);
    })
}

/// Same as [`closed_loop_since`]; calls `watch` with the number of each finished sample, from 0, and the true motion of
/// the links at it.
///
/// # Errors
/// Same as [`closed_loop`].
pub fn closed_loop_watched(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    inputs: &Inputs<'_>,
    since: &Since,
    mut watch: impl FnMut(usize, &LinkMotion),
) -> Result<Motion, SimulateError> {
    let n = robot.joints.len();
    let samples = inputs.reference.iter().map(Vec::len).min().unwrap_or(0);
    let mut stepper = Stepper::new(model)?;
    stepper.go_on(since);
    let mut motion = Motion {
        q: vec![Vec::with_capacity(samples); n],
        qd: vec![Vec::with_capacity(samples); n],
        tau: vec![Vec::with_capacity(samples); n],
        saturated: vec![0; n],
    };
    let (mut q, mut v) = (inputs.q.to_vec(), inputs.v.to_vec());
    stepper.put_links_at_rest(&q, &v)?;
    let mut applied = vec![0.0; n];
    let mut torque = vec![0.0; n];
    let mut cut = vec![false; n];
    let mut errors = vec![[0.0; 2]; n];
    let mut links = LinkTrace::new(n);
    let substeps = inputs.substeps.max(1);
    let dt = inputs.period / f64::from(substeps);
    // Controller updates within one sample, and steps for each update.
    let (answers, steps) = match inputs.held {
        true => (1, substeps),
        false => (substeps, 1),
    };
    for k in 0..samples {
        for answer in 0..answers {
            model.effects.position_errors(&q, &v, &mut errors)?;
            for i in 0..n {
                let read = [q[i] + errors[i][0], v[i] + errors[i][1]];
                let [reference, known] = inputs.asked(i, k, f64::from(answer) / f64::from(answers));
                let wish = known + wish(&controllers[i], reference, read);
                let limits = robot.joints[i].limits.as_ref();
                let limit = limits.and_then(|l| l.torque).unwrap_or(f64::INFINITY);
                let before = std::mem::replace(&mut applied[i], wish.max(-limit).min(limit));
                cut[i] |= applied[i] != wish;
                if answer == 0 {
                    motion.q[i].push(read[0]);
                    motion.qd[i].push(read[1]);
                    motion.tau[i].push(match inputs.held || k == 0 {
                        true => applied[i],
                        false => 0.5 * (before + applied[i]),
                    });
                }
                let added = inputs.added.get(i).and_then(|a| a.get(k));
                torque[i] = applied[i] + added.copied().unwrap_or(0.0);
                if !(q[i].is_finite() && v[i].is_finite() && applied[i].is_finite()) {
                    return Err(SimulateError::Diverged {
                        joint: robot.joints[i].name.clone(),
                        time: k as f64 * inputs.period,
                    });
                }
            }
            for step in 0..steps {
                let at_sample = answer == 0 && step == 0;
                links.before_step(&stepper, &q, &v, at_sample);
                stepper.step(&mut q, &mut v, &torque, &[], dt)?;
                links.after_step(&stepper, &v, dt, at_sample);
            }
        }
        for (count, cut) in motion.saturated.iter_mut().zip(&mut cut) {
            *count += usize::from(std::mem::take(cut));
        }
        watch(k, &links.at);
    }
    for (i, torque) in motion.tau.iter_mut().enumerate() {
        model.effects.read_effort(i, torque, inputs.period);
    }
    Ok(motion)
}

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn a_parabola_is_interpolated_exactly_to_its_ends() {
        let of = |t: f64| 0.3 - 1.2 * t + 0.7 * t * t;
        let values: Vec<f64> = (0..6).map(|k| of(f64::from(k))).collect();
        for k in 0..5 {
            for beyond in [0.0, 0.25, 0.8] {
                let found = between(&values, k, beyond);
                assert!(
                    (found - of(k as f64 + beyond)).abs() < 1e-12,
                    "{k} {beyond}"
                );
            }
        }
        assert_eq!(between(&values, 5, 0.5), values[5]);
        assert_eq!(between(&values[..2], 0, 0.5), 0.5 * (values[0] + values[1]));
        assert_eq!(between(&[], 0, 0.5), 0.0);
    }
}
