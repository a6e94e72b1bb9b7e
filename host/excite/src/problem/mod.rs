//! The objective of a design, with its exact gradient.
//!
//! The criterion depends on the information matrix M = YᵀY/S, and its derivative by the regressor's entries is
//! 2/S·Y·∂f/∂M. The limits on torque add λ·πᵀ. Both are weights on the regressor's entries. One backward sweep through
//! the chain ([`regressor_gradient`](rig_shared::multibody::regressor_gradient)) gives derivatives by position,
//! velocity and acceleration of each sample. The Fourier functions turn these into derivatives by the coefficients.

mod constraints;

use nalgebra::{DMatrix, DVector};
use rig_shared::lanes::Lanes;
use rig_shared::multibody::{COLUMNS, column, differential_regressor};
use rig_shared::scalar::Real;
use rig_shared::transmission::MOTOR_COLUMNS;

use super::ExciteError;
use super::criterion::{Smoothing, criterion_of};
use super::frame::Frame;
use super::optimise::{Objective, Round};
use super::schedule::{Basis, JointMotion};
use constraints::Pass;

/// Number of samples computed in parallel lanes.
pub(super) const LANES: usize = 4;
pub(super) type L = Lanes<LANES>;

/// Share of the velocity limit within which the optimiser smooths the sign of the velocity, so that its gradient
/// includes the Coulomb column. The reported values use the exact sign.
pub(super) const SIGN_WIDTH: f64 = 0.01;

/// The optimisation problem of one start.
pub(super) struct Problem<'a> {
    frame: &'a Frame,
    basis: Basis,
    smoothing: Smoothing,
    weight: f64,
    /// By order (position, velocity, acceleration, torque), joint and sample: one for each side.
    multipliers: [Vec<[f64; 2]>; 4],
    /// By plane and sample.
    plane_multipliers: Vec<f64>,
    /// By crank and sample: one for each side.
    crank_multipliers: Vec<[f64; 2]>,
    /// Position, velocity, acceleration: samples × joints.
    motion: [DMatrix<f64>; 3],
    /// Derivative of the objective by each of them.
    adjoint: [DMatrix<f64>; 3],
    /// Per joint the scaled rows of the whole period, one per column; only columns of links that load the joint.
    rows: Vec<DMatrix<f64>>,
    /// Derivative of the criterion by each of these entries.
    pulls: Vec<DMatrix<f64>>,
    /// First base column of each joint's rows.
    first: Vec<usize>,
    out: Vec<L>,
    /// The same for the motors, n × 3n.
    motors: Vec<L>,
}

impl<'a> Problem<'a> {
    /// Creates the problem with `density` samples per period of the fastest harmonic.
    pub(super) fn new(frame: &'a Frame, density: usize, smoothing: Smoothing) -> Self {
        let basis = Basis::new(&frame.schedule, density);
        let n = frame.bounds.len();
        let (p, samples) = (frame.columns.len(), basis.samples());
        let first: Vec<usize> = (0..n)
            .map(|j| frame.columns.partition_point(|c| *c < j * COLUMNS))
            .collect();
        let rows: Vec<_> = first
            .iter()
            .map(|f| DMatrix::zeros(p - f, basis.whole))
            .collect();
        Self {
            frame,
            smoothing,
            weight: 0.0,
            multipliers: [(); 4].map(|()| vec![[0.0; 2]; samples * n]),
            crank_multipliers: vec![[0.0; 2]; frame.combined.len() * samples],
            plane_multipliers: vec![0.0; frame.planes.len() * samples],
            motion: [(); 3].map(|()| DMatrix::zeros(samples, n)),
            adjoint: [(); 3].map(|()| DMatrix::zeros(samples, n)),
            pulls: rows.clone(),
            rows,
            first,
            out: vec![L::ZERO; n * n * COLUMNS],
            motors: vec![L::ZERO; n * n * MOTOR_COLUMNS],
            basis,
        }
    }

    fn joints(&self) -> usize {
        self.frame.bounds.len()
    }

    /// Variables per joint: start position and coefficients, each relative to a unit from its limits.
    fn block(&self) -> usize {
        1 + 2 * self.frame.schedule.harmonics
    }

    pub(super) fn size(&self) -> usize {
        self.joints() * self.block()
    }

    /// Returns the unit of a variable.
    fn unit(&self, joint: usize, within: usize) -> f64 {
        let bounds = &self.frame.bounds[joint];
        if within == 0 {
            bounds.half()
        } else {
            let harmonic = (within - 1) % self.frame.schedule.harmonics + 1;
            let by_velocity = bounds.velocity / self.frame.schedule.omega();
            bounds.half().min(by_velocity) / harmonic as f64
        }
    }

    pub(super) fn decode(&self, x: &DVector<f64>) -> Vec<JointMotion> {
        let block = self.block();
        (0..self.joints())
            .map(|j| {
                let base = match &self.frame.fixed {
                    Some(fixed) => fixed[j],
                    None => self.frame.bounds[j].middle() + self.unit(j, 0) * x[j * block],
                };
                let coefficients = (1..block)
                    .map(|c| self.unit(j, c) * x[j * block + c])
                    .collect();
                JointMotion { base, coefficients }
            })
            .collect()
    }

    /// Converts a motion to variables; also used to scale a start to its limits.
    pub(super) fn encode(&self, motions: &[JointMotion]) -> DVector<f64> {
        let block = self.block();
        let mut x = DVector::zeros(self.size());
        for (j, motion) in motions.iter().enumerate() {
            let middle = self.frame.bounds[j].middle();
            x[j * block] = (motion.base - middle) / self.unit(j, 0);
            for (c, value) in motion.coefficients.iter().enumerate() {
                x[j * block + 1 + c] = value / self.unit(j, c + 1);
            }
        }
        x
    }

    fn place(&mut self, x: &DVector<f64>) {
        let motions = self.decode(x);
        let width = self.block() - 1;
        let coefficients =
            DMatrix::from_fn(width, motions.len(), |c, j| motions[j].coefficients[c]);
        for order in 0..3 {
            self.motion[order].gemm(1.0, &self.basis.tables[order], &coefficients, 0.0);
        }
        for (j, motion) in motions.iter().enumerate() {
            self.motion[0].column_mut(j).add_scalar_mut(motion.base);
        }
    }

    /// Returns the factor that scales a motion about its start so that position, velocity and acceleration fit.
    fn room(&mut self, x: &DVector<f64>) -> f64 {
        self.place(x);
        let mut room = f64::INFINITY;
        let motions = self.decode(x);
        for limit in &self.frame.combined {
            let start = limit.at(motions.iter().map(|m| m.base));
            for s in 0..self.basis.samples() {
                let away = limit.at((0..motions.len()).map(|j| self.motion[0][(s, j)])) - start;
                if away != 0.0 {
                    let edge = if away > 0.0 { limit.high } else { limit.low };
                    room = room.min((edge - start) / away);
                }
            }
        }
        for (j, motion) in motions.iter().enumerate() {
            let bounds = &self.frame.bounds[j];
            let (up, down) = (bounds.high - motion.base, bounds.low - motion.base);
            for s in 0..self.basis.samples() {
                let away = self.motion[0][(s, j)] - motion.base;
                // At its start and end the deviation is zero.
                if away != 0.0 {
                    room = room.min(if away > 0.0 { up / away } else { down / away });
                }
                room = room.min(bounds.velocity / self.motion[1][(s, j)].abs());
                if let Some(limit) = bounds.acceleration {
                    room = room.min(limit / self.motion[2][(s, j)].abs());
                }
            }
        }
        room
    }

    /// Scales the motion about its start to `share` of the limits of position, velocity and acceleration; a share of
    /// one only reduces a motion that exceeds them.
    pub(super) fn shrunk(&mut self, x: &DVector<f64>, share: f64) -> DVector<f64> {
        let factor = share * self.room(x);
        let factor = if share < 1.0 { factor } else { factor.min(1.0) };
        let mut motions = self.decode(x);
        for motion in &mut motions {
            for c in &mut motion.coefficients {
                *c *= factor;
            }
        }
        self.encode(&motions)
    }

    /// Returns the criterion alone, at `x`; not finite if undefined.
    pub(super) fn judge(&mut self, x: &DVector<f64>) -> f64 {
        self.place(x);
        match self.fill_rows() {
            Ok(()) => self.criterion(false),
            Err(_) => f64::INFINITY,
        }
    }

    /// Returns samples `s` to `s + LANES` of position, velocity or acceleration of all joints.
    fn state(&self, order: usize, s: usize) -> Vec<L> {
        (0..self.joints())
            .map(|j| Lanes(core::array::from_fn(|k| self.motion[order][(s + k, j)])))
            .collect()
    }

    /// Computes the regressor rows of the whole period.
    fn fill_rows(&mut self) -> Result<(), ExciteError> {
        let n = self.joints();
        let frame = self.frame;
        let width = n * COLUMNS;
        for s in (0..self.basis.whole).step_by(LANES) {
            let [q, qd, qdd] = [0, 1, 2].map(|order| self.state(order, s));
            differential_regressor(&frame.lanes, &q, &qd, &qdd, &mut self.out)?;
            if let Some(drives) = &frame.drives {
                drives.columns([&q, &qd, &qdd], &mut self.motors)?;
            }
            for j in 0..n {
                self.out[j * width + j * COLUMNS + column::COULOMB] =
                    soft_sign(qd[j], frame.bounds[j].velocity);
                let first = self.first[j];
                for (c, source) in frame.columns.iter().enumerate().skip(first) {
                    let factor = frame.weights[j] / frame.sizes[c];
                    let entry = match source.checked_sub(width) {
                        Some(motor) => self.motors[j * n * MOTOR_COLUMNS + motor].0,
                        None => self.out[j * width + source].0,
                    };
                    for k in 0..LANES {
                        self.rows[j][(c - first, s + k)] = factor * entry[k];
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the criterion of the rows; with `pull` also computes its derivative by them.
    fn criterion(&mut self, pull: bool) -> f64 {
        let p = self.frame.columns.len();
        let samples = self.basis.whole as f64;
        let mut information = DMatrix::zeros(p, p);
        for (rows, &first) in self.rows.iter().zip(&self.first) {
            let size = p - first;
            // Transposed explicitly, so that the product uses the fast kernel.
            let transposed = rows.transpose();
            information.view_mut((first, first), (size, size)).gemm(
                1.0 / samples,
                rows,
                &transposed,
                1.0,
            );
        }
        let (value, slope) = criterion_of(&information, self.frame.criterion, self.smoothing);
        if pull && value.is_finite() {
            // d tr(G·YᵀY)/S = 2/S·⟨Y·G, dY⟩
            for j in 0..self.rows.len() {
                let (first, size) = (self.first[j], p - self.first[j]);
                let block = slope.view((first, first), (size, size)).into_owned();
                self.pulls[j].gemm(2.0 / samples, &block, &self.rows[j], 0.0);
            }
        }
        value
    }

    fn objective(&mut self, x: &DVector<f64>) -> Result<f64, ExciteError> {
        self.place(x);
        for table in &mut self.adjoint {
            table.fill(0.0);
        }
        self.fill_rows()?;
        let criterion = self.criterion(true);
        if !criterion.is_finite() {
            return Ok(f64::INFINITY);
        }
        Ok(criterion + self.penalties(Pass::Penalise)?)
    }
}

/// Returns the sign of a velocity, smoothed about zero.
fn soft_sign(velocity: L, limit: f64) -> L {
    let width = L::splat(SIGN_WIDTH * limit);
    velocity / (velocity * velocity + width * width).sqrt()
}

fn soft_sign_slope(velocity: L, limit: f64) -> L {
    let square = L::splat((SIGN_WIDTH * limit) * (SIGN_WIDTH * limit));
    let sum = velocity * velocity + square;
    square / (sum * sum.sqrt())
}

impl Objective for Problem<'_> {
    fn value(&mut self, x: &DVector<f64>, gradient: &mut DVector<f64>) -> f64 {
        // Only wrong lengths give errors, and the lengths are the frame's own.
        let Ok(value) = self.objective(x) else {
            return f64::INFINITY;
        };
        let (n, block) = (self.joints(), self.block());
        let mut sums = DMatrix::zeros(block - 1, n);
        for order in 0..3 {
            sums.gemm(
                1.0,
                &self.basis.transposed[order],
                &self.adjoint[order],
                1.0,
            );
        }
        for j in 0..n {
            gradient[j * block] = if self.frame.fixed.is_some() {
                0.0
            } else {
                self.adjoint[0].column(j).sum() * self.unit(j, 0)
            };
            for c in 1..block {
                gradient[j * block + c] = sums[(c - 1, j)] * self.unit(j, c);
            }
        }
        value
    }

    fn update(&mut self, x: &DVector<f64>, next: &Round) {
        self.place(x);
        if self.weight > 0.0 {
            // An error leaves the multipliers unchanged; `value` then returns a value that is not finite.
            let _ = self.penalties(Pass::Renew);
        }
        self.weight = next.weight;
        self.smoothing = next.smoothing;
    }
}

#[cfg(test)]
impl Problem<'_> {
    /// Activates every constraint, so that a test of the gradient covers all of them.
    pub(super) fn press(&mut self, multiplier: f64) {
        for list in &mut self.multipliers {
            list.fill([multiplier, 0.7 * multiplier]);
        }
        self.plane_multipliers.fill(multiplier);
        self.crank_multipliers.fill([multiplier, 0.7 * multiplier]);
    }
}
