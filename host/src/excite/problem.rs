//! What a design is judged by, with its exact gradient.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rig_shared::dual::Dual;
use rig_shared::multibody::{COLUMNS, Chain, column, differential_regressor, inverse_dynamics};
use rig_shared::trajectory::{Fourier, Trajectory};

use super::optimise::Objective;
use super::{Criterion, ExciteError};

/// Derivatives by position, velocity and acceleration of one joint at a time.
type D3 = Dual<f64, 3>;

/// Samples per period of the fastest harmonic during optimisation: a peak between two of them hides at most
/// (π/48)²/2 = 0.2 % of that harmonic's amplitude, which [`MARGIN`] keeps free.
const SAMPLES: usize = 48;
/// Part of each limit that the optimiser leaves free for what happens between its samples.
const MARGIN: f64 = 0.003;
/// Constraints on a joint at a sample: two sides of position, velocity, acceleration and torque.
const SIDES: usize = 8;
/// Within this share of the velocity limit the sign of the velocity is rounded off for the optimiser alone, so
/// that its gradient sees the Coulomb column; the values that are reported use the sign itself.
const SIGN_WIDTH: f64 = 0.01;

/// What a joint may do.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Lowest position.
    pub low: f64,
    /// Highest position.
    pub high: f64,
    pub velocity: f64,
    pub acceleration: Option<f64>,
    pub torque: Option<f64>,
}

/// Times that all joints share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schedule {
    pub period_us: u32,
    pub ramp_us: u32,
    pub periods: u16,
    pub harmonics: usize,
}

impl Schedule {
    /// Angular frequency of the fundamental, rad/s.
    pub(super) fn omega(&self) -> f64 {
        core::f64::consts::TAU / (f64::from(self.period_us) * 1e-6)
    }

    /// The trajectory with these coefficients, sines first.
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

/// Motion of one joint: where it starts, and sines then cosines.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct JointMotion {
    pub base: f64,
    pub coefficients: Vec<f64>,
}

/// Everything that is the same for all starts.
pub(super) struct Frame {
    pub dual: Chain<D3>,
    pub plain: Chain<f64>,
    /// Regressor columns that stand for the base parameters.
    pub columns: Vec<usize>,
    /// Size of each of these columns by which it is divided.
    pub sizes: Vec<f64>,
    /// Factor of each joint's rows.
    pub weights: Vec<f64>,
    /// Prior parameters, where the description has them all.
    pub parameters: Option<Vec<[f64; COLUMNS]>>,
    pub bounds: Vec<Bounds>,
    pub schedule: Schedule,
    /// Where the joints start, if that is not free.
    pub fixed: Option<Vec<f64>>,
    pub criterion: Criterion,
}

/// Position, velocity and acceleration of each coefficient's function at the samples (samples × 2·harmonics). They
/// are taken from the trajectory itself, envelope included, so that what is optimised is what runs.
struct Basis {
    /// Samples of one whole period, which come first; those of the two ramps follow.
    whole: usize,
    tables: [DMatrix<f64>; 3],
}

impl Basis {
    fn new(schedule: &Schedule) -> Self {
        let (ramp, period) = (f64::from(schedule.ramp_us), f64::from(schedule.period_us));
        let whole = SAMPLES * schedule.harmonics;
        let mut times: Vec<f64> = (0..whole)
            .map(|k| ramp + period * k as f64 / whole as f64)
            .collect();
        let on_ramp = ((whole as f64 * ramp / period).ceil() as usize).max(8);
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
        Self { whole, tables }
    }
}

/// The criterion's value at an information matrix, as a logarithm to be minimised, and its derivative by the
/// matrix's entries.
fn criterion_of(information: &DMatrix<f64>, criterion: Criterion) -> (f64, DMatrix<f64>) {
    let p = information.nrows();
    let eigen = SymmetricEigen::new(information.clone());
    let outer = |k: usize, factor: f64| {
        let v = eigen.eigenvectors.column(k);
        v * v.transpose() * factor
    };
    let (least, most) = (eigen.eigenvalues.imin(), eigen.eigenvalues.imax());
    // Rounding can make the smallest eigenvalue of a singular matrix negative.
    let floor = 1e-15 * eigen.eigenvalues[most].max(f64::MIN_POSITIVE);
    let value = |k: usize| eigen.eigenvalues[k].max(floor);
    match criterion {
        Criterion::ConditionNumber => (
            0.5 * (value(most) / value(least)).ln(),
            outer(most, 0.5 / value(most)) - outer(least, 0.5 / value(least)),
        ),
        Criterion::SmallestSingularValue => {
            (-0.5 * value(least).ln(), -outer(least, 0.5 / value(least)))
        }
        Criterion::Determinant => {
            let share = 0.5 / p as f64;
            let mut slope = DMatrix::zeros(p, p);
            let mut sum = 0.0;
            for k in 0..p {
                sum -= share * value(k).ln();
                slope -= outer(k, share / value(k));
            }
            (sum, slope)
        }
    }
}

/// Takes a constraint's number, its value, its sample, and its derivatives joint by joint.
type Visit<'a> = dyn FnMut(usize, f64, usize, &[[f64; 3]]) + 'a;

/// One start's view of the frame.
pub(super) struct Problem<'a> {
    frame: &'a Frame,
    basis: Basis,
    multipliers: Vec<f64>,
    weight: f64,
    /// Values of position, velocity, acceleration: sample-major, joints within.
    motion: [Vec<f64>; 3],
    /// Derivative of the objective by each of them.
    adjoint: [Vec<f64>; 3],
    /// Scaled regressor rows, and their derivatives by joint and direction.
    rows: DMatrix<f64>,
    slopes: Vec<f64>,
}

impl<'a> Problem<'a> {
    pub(super) fn new(frame: &'a Frame) -> Self {
        let basis = Basis::new(&frame.schedule);
        let n = frame.bounds.len();
        let p = frame.columns.len();
        let samples = basis.tables[0].nrows();
        let rows = DMatrix::zeros(basis.whole * n, p);
        Self {
            frame,
            multipliers: vec![0.0; samples * n * SIDES],
            weight: 0.0,
            motion: [(); 3].map(|()| vec![0.0; samples * n]),
            adjoint: [(); 3].map(|()| vec![0.0; samples * n]),
            slopes: vec![0.0; basis.whole * n * p * n * 3],
            rows,
            basis,
        }
    }

    fn joints(&self) -> usize {
        self.frame.bounds.len()
    }

    /// Variables: per joint where it starts, then its coefficients, each relative to what its limits suggest.
    fn block(&self) -> usize {
        1 + 2 * self.frame.schedule.harmonics
    }

    pub(super) fn size(&self) -> usize {
        self.joints() * self.block()
    }

    /// What one unit of a variable means.
    fn unit(&self, joint: usize, within: usize) -> f64 {
        let bounds = &self.frame.bounds[joint];
        let half = 0.5 * (bounds.high - bounds.low);
        if within == 0 {
            half
        } else {
            let harmonic = (within - 1) % self.frame.schedule.harmonics + 1;
            let by_velocity = bounds.velocity / self.frame.schedule.omega();
            half.min(by_velocity) / harmonic as f64
        }
    }

    pub(super) fn decode(&self, x: &DVector<f64>) -> Vec<JointMotion> {
        let block = self.block();
        (0..self.joints())
            .map(|j| {
                let bounds = &self.frame.bounds[j];
                let base = match &self.frame.fixed {
                    Some(fixed) => fixed[j],
                    None => {
                        let middle = 0.5 * (bounds.low + bounds.high);
                        middle + self.unit(j, 0) * x[j * block]
                    }
                };
                let coefficients = (1..block)
                    .map(|c| self.unit(j, c) * x[j * block + c])
                    .collect();
                JointMotion { base, coefficients }
            })
            .collect()
    }

    /// The variables of a motion; scaling a start to its limits goes through here.
    pub(super) fn encode(&self, motions: &[JointMotion]) -> DVector<f64> {
        let block = self.block();
        let mut x = DVector::zeros(self.size());
        for (j, motion) in motions.iter().enumerate() {
            let bounds = &self.frame.bounds[j];
            let middle = 0.5 * (bounds.low + bounds.high);
            x[j * block] = (motion.base - middle) / self.unit(j, 0);
            for (c, value) in motion.coefficients.iter().enumerate() {
                x[j * block + 1 + c] = value / self.unit(j, c + 1);
            }
        }
        x
    }

    fn place(&mut self, x: &DVector<f64>) {
        let n = self.joints();
        for (j, motion) in self.decode(x).iter().enumerate() {
            let coefficients = DVector::from_column_slice(&motion.coefficients);
            for (order, table) in self.basis.tables.iter().enumerate() {
                let offset = if order == 0 { motion.base } else { 0.0 };
                for (s, value) in (table * &coefficients).iter().enumerate() {
                    self.motion[order][s * n + j] = offset + value;
                }
            }
        }
    }

    /// By how much to scale a motion about where it starts so that position, velocity and acceleration fit.
    pub(super) fn room(&mut self, x: &DVector<f64>) -> f64 {
        self.place(x);
        let n = self.joints();
        let bases: Vec<f64> = self.decode(x).iter().map(|m| m.base).collect();
        let mut room = f64::INFINITY;
        for (i, q) in self.motion[0].iter().enumerate() {
            let (bounds, base) = (&self.frame.bounds[i % n], bases[i % n]);
            let (up, down) = (bounds.high - base, bounds.low - base);
            let away = q - base;
            // Where it starts and ends it is not away at all.
            if away != 0.0 {
                room = room.min(if away > 0.0 { up / away } else { down / away });
            }
            room = room.min(bounds.velocity / self.motion[1][i].abs());
            if let Some(limit) = bounds.acceleration {
                room = room.min(limit / self.motion[2][i].abs());
            }
        }
        room
    }

    /// Regressor rows of the whole period and their derivatives.
    fn fill_rows(&mut self) -> Result<(), ExciteError> {
        let n = self.joints();
        let frame = self.frame;
        let (p, width) = (frame.columns.len(), n * COLUMNS);
        let mut out = vec![D3::default(); n * width];
        let constant = |list: &[f64]| list.iter().map(|v| D3::constant(*v)).collect::<Vec<_>>();
        for s in 0..self.basis.whole {
            let range = s * n..(s + 1) * n;
            let [q, qd, qdd] = [0, 1, 2].map(|o| constant(&self.motion[o][range.clone()]));
            for by in 0..n {
                let (mut q, mut qd, mut qdd) = (q.clone(), qd.clone(), qdd.clone());
                q[by] = D3::variable(q[by].value, 0);
                qd[by] = D3::variable(qd[by].value, 1);
                qdd[by] = D3::variable(qdd[by].value, 2);
                differential_regressor(&frame.dual, &q, &qd, &qdd, &mut out)?;
                for j in 0..n {
                    out[j * width + j * COLUMNS + column::COULOMB] =
                        soft_sign(qd[j], frame.bounds[j].velocity);
                    for (c, source) in frame.columns.iter().enumerate() {
                        let entry = out[j * width + source];
                        let factor = frame.weights[j] / frame.sizes[c];
                        self.rows[(s * n + j, c)] = factor * entry.value;
                        let place = (((s * n + j) * p + c) * n + by) * 3;
                        for d in 0..3 {
                            self.slopes[place + d] = factor * entry.derivative[d];
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn add_criterion(&mut self) -> f64 {
        let n = self.joints();
        let p = self.frame.columns.len();
        let samples = self.basis.whole as f64;
        let information = self.rows.tr_mul(&self.rows) / samples;
        if information.iter().any(|v| !v.is_finite()) {
            return f64::INFINITY;
        }
        let (value, slope) = criterion_of(&information, self.frame.criterion);
        // d tr(G·YᵀY)/S = 2/S·⟨Y·G, dY⟩
        let pull = &self.rows * slope * (2.0 / samples);
        for s in 0..self.basis.whole {
            for j in 0..n {
                for c in 0..p {
                    let factor = pull[(s * n + j, c)];
                    for by in 0..n {
                        let place = (((s * n + j) * p + c) * n + by) * 3;
                        for d in 0..3 {
                            self.adjoint[d][s * n + by] += factor * self.slopes[place + d];
                        }
                    }
                }
            }
        }
        value
    }

    /// Calls `visit` with each constraint's number, value (0 or less is allowed) and what it depends on: sample,
    /// and per joint the derivatives by position, velocity and acceleration.
    fn constraints(&self, visit: &mut Visit<'_>) -> Result<(), ExciteError> {
        let n = self.joints();
        let samples = self.motion[0].len() / n;
        let keep = 1.0 - MARGIN;
        let dual_rows: Option<Vec<[D3; COLUMNS]>> = self.frame.parameters.as_ref().map(|rows| {
            rows.iter()
                .map(|row| {
                    let mut row = row.map(D3::constant);
                    row[column::COULOMB] = D3::default();
                    row
                })
                .collect()
        });
        let torque_limited = self.frame.bounds.iter().any(|b| b.torque.is_some());
        let mut slope = vec![[0.0; 3]; n];
        let mut tau = vec![D3::default(); n];
        let mut torque = vec![0.0; n];
        let mut torque_slope = vec![[0.0; 3]; n * n];
        for s in 0..samples {
            let at = |order: usize, j: usize| self.motion[order][s * n + j];
            for j in 0..n {
                let bounds = &self.frame.bounds[j];
                let number = (s * n + j) * SIDES;
                let half = 0.5 * (bounds.high - bounds.low);
                let middle = 0.5 * (bounds.high + bounds.low);
                let mut both = |order: usize, first: usize, away: f64, limit: f64| {
                    for (side, sign) in [(0, 1.0), (1, -1.0)] {
                        slope[j][order] = sign / limit;
                        visit(number + first + side, sign * away / limit - keep, s, &slope);
                        slope[j][order] = 0.0;
                    }
                };
                both(0, 0, at(0, j) - middle, half);
                both(1, 2, at(1, j), bounds.velocity);
                if let Some(limit) = bounds.acceleration {
                    both(2, 4, at(2, j), limit);
                }
            }
            let (Some(rows), true) = (&dual_rows, torque_limited) else {
                continue;
            };
            let constant = |o: usize| (0..n).map(|j| D3::constant(at(o, j))).collect::<Vec<_>>();
            let [q, qd, qdd] = [constant(0), constant(1), constant(2)];
            for by in 0..n {
                let (mut q, mut qd, mut qdd) = (q.clone(), qd.clone(), qdd.clone());
                q[by] = D3::variable(q[by].value, 0);
                qd[by] = D3::variable(qd[by].value, 1);
                qdd[by] = D3::variable(qdd[by].value, 2);
                inverse_dynamics(&self.frame.dual, rows, &q, &qd, &qdd, &mut tau)?;
                for j in 0..n {
                    let coulomb = self
                        .frame
                        .parameters
                        .as_ref()
                        .map_or(0.0, |p| p[j][column::COULOMB]);
                    let total = tau[j]
                        + D3::constant(coulomb) * soft_sign(qd[j], self.frame.bounds[j].velocity);
                    torque[j] = total.value;
                    torque_slope[j * n + by] = total.derivative;
                }
            }
            for j in 0..n {
                let Some(limit) = self.frame.bounds[j].torque else {
                    continue;
                };
                for (side, sign) in [(6, 1.0), (7, -1.0)] {
                    let slopes: Vec<[f64; 3]> = (0..n)
                        .map(|by| torque_slope[j * n + by].map(|d| sign * d / limit))
                        .collect();
                    let number = (s * n + j) * SIDES + side;
                    visit(number, sign * torque[j] / limit - keep, s, &slopes);
                }
            }
        }
        Ok(())
    }
}

/// The sign of a velocity, rounded off about zero.
fn soft_sign(velocity: D3, limit: f64) -> D3 {
    use rig_shared::scalar::Real;
    let width = D3::constant(SIGN_WIDTH * limit);
    velocity / (velocity * velocity + width * width).sqrt()
}

impl Objective for Problem<'_> {
    fn value(&mut self, x: &DVector<f64>, gradient: &mut DVector<f64>) -> f64 {
        let n = self.joints();
        self.place(x);
        for list in &mut self.adjoint {
            list.fill(0.0);
        }
        // The only errors are those of lengths, which are the frame's own.
        if self.fill_rows().is_err() {
            return f64::INFINITY;
        }
        let mut value = self.add_criterion();
        let mut adjoint = core::mem::take(&mut self.adjoint);
        let weight = self.weight;
        let checked = self.constraints(&mut |number, c, s, slopes| {
            let multiplier = self.multipliers[number];
            let active = c + multiplier / weight;
            value -= 0.5 * multiplier * multiplier / weight;
            if active > 0.0 {
                value += 0.5 * weight * active * active;
                for (j, slope) in slopes.iter().enumerate() {
                    for d in 0..3 {
                        adjoint[d][s * n + j] += weight * active * slope[d];
                    }
                }
            }
        });
        self.adjoint = adjoint;
        if checked.is_err() {
            return f64::INFINITY;
        }
        let block = self.block();
        let samples = self.motion[0].len() / n;
        for j in 0..n {
            let mut sums = DVector::zeros(block - 1);
            for (order, table) in self.basis.tables.iter().enumerate() {
                let pull = DVector::from_fn(samples, |s, _| self.adjoint[order][s * n + j]);
                sums += table.tr_mul(&pull);
            }
            let base: f64 = (0..samples).map(|s| self.adjoint[0][s * n + j]).sum();
            gradient[j * block] = if self.frame.fixed.is_some() {
                0.0
            } else {
                base * self.unit(j, 0)
            };
            for c in 1..block {
                gradient[j * block + c] = sums[c - 1] * self.unit(j, c);
            }
        }
        value
    }

    fn update(&mut self, x: &DVector<f64>, next_weight: f64) {
        self.place(x);
        if self.weight > 0.0 {
            let mut multipliers = core::mem::take(&mut self.multipliers);
            let weight = self.weight;
            // An error leaves the multipliers as they were; `value` then reports it as not finite.
            let _ = self.constraints(&mut |number, c, _, _| {
                multipliers[number] = (multipliers[number] + weight * c).max(0.0);
            });
            self.multipliers = multipliers;
        }
        self.weight = next_weight;
    }
}

#[cfg(test)]
impl Problem<'_> {
    /// Makes every constraint count, so that a test of the gradient sees all of them.
    pub(super) fn press(&mut self, multiplier: f64) {
        self.multipliers.fill(multiplier);
    }
}
