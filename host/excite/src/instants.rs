//! Instants of a motion at which limits are checked.

use crate::JointTrajectory;

/// Steps at whose ends the torque of a motion is checked; the motions use a share of the limits, which leaves a margin
/// between them.
pub(super) const TORQUE_STEPS: usize = 50_000;
/// Steps at whose ends the limits of motors are checked.
pub(super) const MOTOR_STEPS: usize = 20_000;

/// Position, velocity and acceleration of each joint at several instants.
pub(super) struct Instants<'a> {
    count: usize,
    at: Box<dyn Fn(usize, usize) -> [f64; 3] + 'a>,
}

impl<'a> Instants<'a> {
    /// `at(k, j)` is the motion of joint `j` at the instant `k` below `count`.
    pub(super) fn new(count: usize, at: impl Fn(usize, usize) -> [f64; 3] + 'a) -> Self {
        Self {
            count,
            at: Box::new(at),
        }
    }

    /// Spreads instants evenly over a motion, both ends included.
    pub(super) fn of_joints(joints: &'a [JointTrajectory], steps: usize) -> Self {
        let durations = joints.iter().map(|joint| joint.trajectory.duration());
        let duration = durations.fold(0.0, f64::max);
        Self::new(steps + 1, move |k, j| {
            let joint = &joints[j];
            let at = joint.trajectory.at(duration * k as f64 / steps as f64);
            [joint.start + at.position, at.velocity, at.acceleration]
        })
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Writes the state at an instant.
    pub(super) fn fill(&self, k: usize, q: &mut [f64], qd: &mut [f64], qdd: &mut [f64]) {
        for j in 0..q.len() {
            [q[j], qd[j], qdd[j]] = (self.at)(k, j);
        }
    }
}
