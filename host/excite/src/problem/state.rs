//! A design problem: the motion at the samples, multipliers and rows.

use nalgebra::DMatrix;
use rig_shared::lanes::Lanes;
use rig_shared::multibody::COLUMNS;
use rig_shared::scalar::Real;
use rig_shared::transmission::MOTOR_COLUMNS;

use crate::criterion::Smoothing;
use crate::frame::Frame;
use crate::lanes::{L, LANES};
use crate::schedule::Basis;

/// The optimisation problem of one start.
pub(crate) struct Problem<'a> {
    pub(super) frame: &'a Frame,
    pub(super) basis: Basis,
    pub(super) smoothing: Smoothing,
    pub(super) weight: f64,
    /// By order (position, velocity, acceleration, torque), joint and sample: one for each side.
    pub(super) multipliers: [Vec<[f64; 2]>; 4],
    /// By plane and sample.
    pub(super) plane_multipliers: Vec<f64>,
    /// By order (angle, speed, torque), motor and sample: one for each side.
    pub(super) motor_multipliers: [Vec<[f64; 2]>; 3],
    /// By crank and sample: one for each side.
    pub(super) crank_multipliers: Vec<[f64; 2]>,
    /// Position, velocity, acceleration: samples × joints.
    pub(super) motion: [DMatrix<f64>; 3],
    /// Derivative of the objective by each of them.
    pub(super) adjoint: [DMatrix<f64>; 3],
    /// Per reading the scaled rows of the whole period, one per column. Of a joint: only columns of links that load it.
    pub(super) rows: Vec<DMatrix<f64>>,
    /// Derivative of the criterion by each of these entries.
    pub(super) pulls: Vec<DMatrix<f64>>,
    /// First column of each reading's rows.
    pub(super) first: Vec<usize>,
    pub(super) out: Vec<L>,
    /// The same for the motors, n × 3n.
    pub(super) motors: Vec<L>,
}

impl<'a> Problem<'a> {
    /// Creates the problem with `density` samples per period of the fastest harmonic.
    pub(crate) fn new(frame: &'a Frame, density: usize, smoothing: Smoothing) -> Self {
        let basis = Basis::new(&frame.schedule, density);
        let n = frame.bounds.len();
        let (p, samples) = (frame.columns.len(), basis.samples());
        let limited = frame.drives.as_ref().map_or(0, |d| d.limits.len());
        let first: Vec<usize> = match &frame.wrist {
            Some(_) => vec![0; frame.readings()],
            // The drive of a joint may move links before it too.
            None if frame.plain.has_followers() => vec![0; n],
            None => (0..n)
                .map(|j| frame.columns.partition_point(|c| *c < j * COLUMNS))
                .collect(),
        };
        let rows: Vec<_> = first
            .iter()
            .map(|f| DMatrix::zeros(p - f, basis.whole))
            .collect();
        Self {
            frame,
            smoothing,
            weight: 0.0,
            multipliers: [(); 4].map(|()| vec![[0.0; 2]; samples * n]),
            motor_multipliers: [(); 3].map(|()| vec![[0.0; 2]; samples * limited]),
            crank_multipliers: vec![[0.0; 2]; frame.combined.len() * samples],
            plane_multipliers: vec![0.0; frame.planes.len() * samples],
            motion: [(); 3].map(|()| DMatrix::zeros(samples, n)),
            adjoint: [(); 3].map(|()| DMatrix::zeros(samples, n)),
            pulls: rows.clone(),
            rows,
            first,
            out: vec![L::ZERO; n * frame.plain.parameter_count()],
            motors: vec![L::ZERO; n * n * MOTOR_COLUMNS],
            basis,
        }
    }

    pub(super) fn joints(&self) -> usize {
        self.frame.bounds.len()
    }

    /// Variables per joint: start position and coefficients, each relative to a unit from its limits.
    pub(super) fn block(&self) -> usize {
        1 + 2 * self.frame.schedule.harmonics
    }

    pub(crate) fn size(&self) -> usize {
        self.joints() * self.block()
    }

    /// Returns the unit of a variable.
    pub(super) fn unit(&self, joint: usize, within: usize) -> f64 {
        let bounds = &self.frame.bounds[joint];
        if within == 0 {
            bounds.half()
        } else {
            let harmonic = (within - 1) % self.frame.schedule.harmonics + 1;
            let by_velocity = bounds.velocity / self.frame.schedule.omega();
            bounds.half().min(by_velocity) / harmonic as f64
        }
    }

    /// Returns samples `s` to `s + LANES` of position, velocity or acceleration of all joints.
    pub(super) fn state(&self, order: usize, s: usize) -> Vec<L> {
        (0..self.joints())
            .map(|j| Lanes(core::array::from_fn(|k| self.motion[order][(s + k, j)])))
            .collect()
    }

    /// Adds derivatives of the objective by position, velocity and acceleration at the samples from `first` on.
    pub(super) fn add_derivatives(&mut self, first: usize, by: &[Vec<L>; 3]) {
        for (adjoint, by) in self.adjoint.iter_mut().zip(by) {
            for (j, own) in by.iter().enumerate() {
                for k in 0..LANES {
                    adjoint[(first + k, j)] += own.0[k];
                }
            }
        }
    }
}
