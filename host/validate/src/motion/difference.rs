//! Differences of the simulated to the measured motion.

use super::stretch::Stretch;
use rig_model::simulate::Motion;

/// Sums over the samples of one joint.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) n: f64,
    pub(super) position: f64,
    pub(super) position_max: f64,
    pub(super) torque: f64,
    pub(super) torque_max: f64,
    pub(super) torque_squares: f64,
    pub(super) tracking: f64,
    // Relative to the first sample, so that a large mean position loses no digits.
    pub(super) origin: f64,
    pub(super) first: f64,
    pub(super) second: f64,
}

impl Sums {
    pub(super) fn rms(&self, squares: f64) -> f64 {
        (squares / self.n.max(1.0)).sqrt()
    }
    pub(super) fn position_rms(&self) -> f64 {
        self.rms(self.position)
    }
    pub(super) fn torque_rms(&self) -> f64 {
        self.rms(self.torque)
    }
    pub(super) fn spread(&self) -> f64 {
        let n = self.n.max(1.0);
        (self.second / n - (self.first / n).powi(2)).max(0.0).sqrt()
    }
}

/// Sums of all joints.
pub(super) struct Accumulated {
    pub(super) joints: Vec<Sums>,
}

impl Accumulated {
    pub(super) fn new(joints: usize) -> Self {
        Self {
            joints: vec![Sums::default(); joints],
        }
    }

    pub(super) fn push(&mut self, stretch: &Stretch, motion: &Motion) {
        for (j, s) in self.joints.iter_mut().enumerate() {
            for k in 0..motion.q[j].len() {
                let q = stretch.q[j][k];
                if s.n == 0.0 {
                    s.origin = q;
                }
                let e = motion.q[j][k] - q;
                let tau = motion.tau[j][k] - stretch.tau[j][k];
                s.n += 1.0;
                s.position += e * e;
                s.position_max = s.position_max.max(e.abs());
                s.torque += tau * tau;
                s.torque_max = s.torque_max.max(tau.abs());
                s.torque_squares += stretch.tau[j][k].powi(2);
                s.tracking += (stretch.reference[j][k] - q).powi(2);
                s.first += q - s.origin;
                s.second += (q - s.origin).powi(2);
            }
        }
    }
}

/// RMS differences between two runs of one joint.
pub(super) struct Change {
    pub(super) position: f64,
    pub(super) torque: f64,
}

impl Change {
    pub(super) fn between(a: &[Motion], b: &[Motion]) -> Vec<Self> {
        let joints = a.first().map_or(0, |m| m.q.len());
        let rms = |of: &dyn Fn(&Motion) -> &[f64]| {
            let (mut n, mut sum) = (0.0f64, 0.0);
            for (a, b) in a.iter().zip(b) {
                for (x, y) in of(a).iter().zip(of(b)) {
                    n += 1.0;
                    sum += (x - y).powi(2);
                }
            }
            (sum / n.max(1.0)).sqrt()
        };
        (0..joints)
            .map(|j| Self {
                position: rms(&|m| &m.q[j]),
                torque: rms(&|m| &m.tau[j]),
            })
            .collect()
    }
}
