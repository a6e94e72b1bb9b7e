//! Times common to all joints, and the basis functions of a motion.

use nalgebra::DMatrix;
use rig_shared::trajectory::{Fourier, Trajectory};

/// Times common to all joints.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schedule {
    pub period_us: u32,
    pub ramp_us: u32,
    pub periods: u16,
    pub harmonics: usize,
}

impl Schedule {
    /// Returns the angular frequency of the fundamental, rad/s.
    pub(super) fn omega(&self) -> f64 {
        core::f64::consts::TAU / (f64::from(self.period_us) * 1e-6)
    }

    /// Returns the trajectory with these coefficients, sines first.
    pub(super) fn trajectory(&self, coefficients: &[f64]) -> Trajectory<f64> {
        let (sine, cosine) = coefficients.split_at(self.harmonics.min(coefficients.len()));
        Trajectory::Fourier(Fourier {
            period_us: self.period_us,
            periods: self.periods,
            ramp_us: self.ramp_us,
            sine: sine.iter().copied().collect(),
            cosine: cosine.iter().copied().collect(),
        })
    }
}

/// Motion of one joint: start position, and coefficients of sines then cosines.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct JointMotion {
    pub base: f64,
    pub coefficients: Vec<f64>,
}

/// Position, velocity and acceleration of each coefficient's function at the samples. They come from the trajectory
/// with its envelope, so that the optimised motion is the one that runs.
pub(super) struct Basis {
    /// Number of samples of one whole period, which come first; those of the two ramps follow. Both are multiples of
    /// [`LANES`](crate::lanes::LANES).
    pub whole: usize,
    /// samples × 2·harmonics
    pub tables: [DMatrix<f64>; 3],
    /// The same, transposed.
    pub transposed: [DMatrix<f64>; 3],
}

impl Basis {
    /// Computes it with `density` samples per period of the fastest harmonic, a multiple of four.
    pub(super) fn new(schedule: &Schedule, density: usize) -> Self {
        let (ramp, period) = (f64::from(schedule.ramp_us), f64::from(schedule.period_us));
        let whole = density * schedule.harmonics;
        let mut times: Vec<f64> = (0..whole)
            .map(|k| ramp + period * k as f64 / whole as f64)
            .collect();
        let on_ramp = ((whole as f64 * ramp / period).ceil() as usize)
            .max(8)
            .next_multiple_of(4);
        let down = ramp + period * f64::from(schedule.periods);
        for from in [0.0, down] {
            times.extend((0..on_ramp).map(|k| from + ramp * k as f64 / on_ramp as f64));
        }
        let width = 2 * schedule.harmonics;
        let mut tables = [(); 3].map(|()| DMatrix::zeros(times.len(), width));
        for c in 0..width {
            let mut unit = vec![0.0; width];
            unit[c] = 1.0;
            let trajectory = schedule.trajectory(&unit);
            for (row, time) in times.iter().enumerate() {
                let at = trajectory.at(time * 1e-6);
                tables[0][(row, c)] = at.position;
                tables[1][(row, c)] = at.velocity;
                tables[2][(row, c)] = at.acceleration;
            }
        }
        let transposed = [0, 1, 2].map(|order| tables[order].transpose());
        Self {
            whole,
            tables,
            transposed,
        }
    }

    pub(super) fn samples(&self) -> usize {
        self.tables[0].nrows()
    }
}
