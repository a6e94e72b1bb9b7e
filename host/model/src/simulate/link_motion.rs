//! The true motion of the links at a sample, with accelerations.

use super::step::Stepper;

/// The true motion of the links at a sample, before the sensors' errors. Behind an elastic gear or backlash it is the
/// link's, not the motor's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinkMotion {
    /// Positions, rad or m.
    pub q: Vec<f64>,
    /// Velocities, rad/s or m/s.
    pub qd: Vec<f64>,
    /// Mean accelerations of the simulation steps before and after the sample, rad/s² or m/s². They contain all torques
    /// of the simulation, friction that sticks included. The mean has the second order of the steps. Where a joint
    /// starts or stops within the two steps it is the mean of a jump.
    pub qdd: Vec<f64>,
}

/// Follows the links from step to step.
pub(super) struct LinkTrace {
    /// The sample in progress.
    pub at: LinkMotion,
    /// Velocities before the last step; empty before the first one.
    before: Vec<f64>,
}

impl LinkTrace {
    pub(super) fn new(joints: usize) -> Self {
        Self {
            at: LinkMotion {
                q: vec![0.0; joints],
                qd: vec![0.0; joints],
                qdd: vec![0.0; joints],
            },
            before: Vec::with_capacity(joints),
        }
    }

    /// Notes the state before a step.
    pub(super) fn before_step(
        &mut self,
        stepper: &Stepper<'_>,
        q: &[f64],
        v: &[f64],
        at_sample: bool,
    ) {
        if !at_sample {
            note_speeds(&mut self.before, stepper, v);
            return;
        }
        self.at.q.copy_from_slice(q);
        note_speeds(&mut self.at.qd, stepper, v);
        for (j, own) in self.at.q.iter_mut().enumerate() {
            if let Some([position, _]) = stepper.link(j) {
                *own = position;
            }
        }
    }

    /// Computes the accelerations of a sample after the step of `dt` that begins there.
    pub(super) fn after_step(
        &mut self,
        stepper: &Stepper<'_>,
        v: &[f64],
        dt: f64,
        at_sample: bool,
    ) {
        if !at_sample {
            return;
        }
        for (j, own) in self.at.qdd.iter_mut().enumerate() {
            let after = stepper.link(j).map_or(v[j], |[_, speed]| speed);
            *own = match self.before.get(j) {
                Some(before) => (after - before) / (2.0 * dt),
                None => (after - self.at.qd[j]) / dt,
            };
        }
        self.before.clone_from(&self.at.qd);
    }
}

/// Copies the velocities of the links.
fn note_speeds(out: &mut Vec<f64>, stepper: &Stepper<'_>, v: &[f64]) {
    out.clear();
    let speeds = v.iter().enumerate();
    out.extend(speeds.map(|(j, own)| stepper.link(j).map_or(*own, |[_, speed]| speed)));
}
