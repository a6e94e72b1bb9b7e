//! Fits of a voltage-driven joint by what its simulation leaves: Levenberg–Marquardt within bounds.
//!
//! Levenberg 1944, Marquardt 1963; slopes by differences, because sticking and slipping swap places as parameters move.
//! Short windows first (Bock 1983): each begins where the recording was, so that no motion runs away; then whole
//! recordings.

use nalgebra::{DMatrix, DVector};
use rig_shared::effects::Kind;

use super::log::{Log, Segment};
use super::plant::{NOMINAL, Plant};

/// Length of the windows that a fit begins with, s.
pub(super) const WINDOW: f64 = 1.0;
/// Relative step of the differences: far above rounding, within the width of any law.
const DIFFERENCE: f64 = 1.0e-3;
/// Steps at most.
const STEPS: usize = 40;
/// A fit has settled when two steps in a row win less than this share of the sum of squares.
const SETTLED: f64 = 1.0e-4;
/// Damping beyond which no step is left.
const STIFFEST: f64 = 1.0e8;

/// What a fit works on.
pub(super) struct Problem<'a> {
    pub plant: &'a Plant,
    pub logs: &'a [Log],
    /// Number of a log, and which rows of it.
    pub segments: Vec<(usize, Segment)>,
    pub effects: &'a [Kind],
    /// Parameters that are fitted.
    pub free: &'a [usize],
    /// Of all parameters.
    pub bounds: &'a [[f64; 2]],
}

/// Segments of the logs that `which` picks, in windows of `length` seconds.
pub(super) fn segments(
    logs: &[Log],
    which: impl Fn(usize) -> bool,
    length: f64,
) -> Vec<(usize, Segment)> {
    (0..logs.len())
        .filter(|k| which(*k))
        .flat_map(|k| logs[k].windows(length).into_iter().map(move |s| (k, s)))
        .collect()
}

impl Problem<'_> {
    /// Simulated minus recorded position, row by row; none where the simulation is not possible.
    pub(super) fn residual(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let rows = self.segments.iter().map(|(_, s)| s.to - s.from).sum();
        let mut out = Vec::with_capacity(rows);
        for (k, segment) in &self.segments {
            let log = &self.logs[*k];
            let start = out.len();
            if !(self.plant).simulate(self.effects, theta, log, segment, &mut out) {
                return None;
            }
            for (simulated, recorded) in out[start..].iter_mut().zip(&log.q[segment.from..]) {
                *simulated -= recorded;
            }
        }
        Some(out)
    }

    /// RMS of [`Self::residual`]; infinite where there is none.
    pub(super) fn rms(&self, theta: &[f64]) -> f64 {
        self.residual(theta).map_or(f64::INFINITY, |r| {
            (square(&r) / r.len().max(1) as f64).sqrt()
        })
    }

    /// Slopes of the residual by the free parameters, one column each.
    fn slopes(&self, theta: &[f64], residual: &[f64], typical: &[f64]) -> Option<DMatrix<f64>> {
        let mut slopes = DMatrix::zeros(residual.len(), self.free.len());
        for (column, &p) in self.free.iter().enumerate() {
            let step = DIFFERENCE * theta[p].abs().max(typical[p]);
            let mut moved = theta.to_vec();
            // Inwards from the upper bound, and where the other side cannot be simulated.
            let mut found = None;
            for side in [step, -step] {
                moved[p] = theta[p] + side;
                if moved[p] <= self.bounds[p][1] && moved[p] >= self.bounds[p][0] {
                    found = self.residual(&moved).map(|r| (side, r));
                }
                if found.is_some() {
                    break;
                }
            }
            let (side, moved) = found?;
            for (row, (a, b)) in moved.iter().zip(residual).enumerate() {
                slopes[(row, column)] = (a - b) / side;
            }
        }
        Some(slopes)
    }

    /// Parameters of the least sum of squares near `start`; `start` itself where nothing better is found.
    pub(super) fn fit(&self, start: &[f64]) -> Vec<f64> {
        let mut theta = self.within(start);
        let typical: Vec<f64> = start.iter().map(|x| x.abs().max(1.0e-9)).collect();
        let Some(mut residual) = self.residual(&theta) else {
            return theta;
        };
        let (mut cost, mut damping, mut quiet) = (square(&residual), 1.0e-2, 0);
        for _ in 0..STEPS {
            let Some(slopes) = self.slopes(&theta, &residual, &typical) else {
                return theta;
            };
            let normal = slopes.tr_mul(&slopes);
            let gradient = slopes.tr_mul(&DVector::from_column_slice(&residual));
            let mut won = 0.0;
            while damping < STIFFEST {
                let Some(trial) = self.step(&theta, &normal, &gradient, damping) else {
                    break;
                };
                let found = self.residual(&trial).map(|r| (square(&r), r));
                if let Some((less, r)) = found.filter(|(less, _)| *less < cost) {
                    won = 1.0 - less / cost;
                    (theta, residual, cost) = (trial, r, less);
                    damping = (0.2 * damping).max(1.0e-9);
                    break;
                }
                damping *= 5.0;
            }
            quiet = if won < SETTLED { quiet + 1 } else { 0 };
            if quiet > 1 || damping >= STIFFEST {
                break;
            }
        }
        theta
    }

    /// One damped step; parameters at a bound that they press against stay there.
    fn step(
        &self,
        theta: &[f64],
        normal: &DMatrix<f64>,
        gradient: &DVector<f64>,
        damping: f64,
    ) -> Option<Vec<f64>> {
        let held = |c: usize| {
            let p = self.free[c];
            theta[p] <= self.bounds[p][0] && gradient[c] > 0.0
                || theta[p] >= self.bounds[p][1] && gradient[c] < 0.0
        };
        let moving: Vec<usize> = (0..self.free.len()).filter(|c| !held(*c)).collect();
        if moving.is_empty() {
            return None;
        }
        let n = moving.len();
        let mut left = DMatrix::from_fn(n, n, |a, b| normal[(moving[a], moving[b])]);
        let right = DVector::from_fn(n, |a, _| -gradient[moving[a]]);
        let largest = (0..n).map(|a| left[(a, a)]).fold(0.0, f64::max);
        for a in 0..n {
            left[(a, a)] += damping * left[(a, a)] + 1.0e-14 * largest;
        }
        let step = left.lu().solve(&right)?;
        let mut next = theta.to_vec();
        for (a, c) in moving.iter().enumerate() {
            next[self.free[*c]] += step[a];
        }
        Some(self.within(&next))
    }

    /// Each parameter within its bounds.
    fn within(&self, theta: &[f64]) -> Vec<f64> {
        (theta.iter().zip(self.bounds))
            .map(|(x, [low, high])| x.clamp(*low, *high))
            .collect()
    }

    /// Standard deviations of the free parameters, blocks of whole segments taken as independent (sandwich, White 1982).
    pub(super) fn deviations(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let residual = self.residual(theta)?;
        let typical: Vec<f64> = theta.iter().map(|x| x.abs().max(1.0e-9)).collect();
        let slopes = self.slopes(theta, &residual, &typical)?;
        let normal = slopes.tr_mul(&slopes);
        let inverse = normal.try_inverse()?;
        let n = self.free.len();
        let mut meat = DMatrix::zeros(n, n);
        let mut row = 0;
        for (_, segment) in &self.segments {
            let rows = segment.to - segment.from;
            let part = slopes.rows(row, rows);
            let score = part.tr_mul(&DVector::from_column_slice(&residual[row..row + rows]));
            meat += &score * score.transpose();
            row += rows;
        }
        let covariance = &inverse * meat * &inverse;
        Some((0..n).map(|k| covariance[(k, k)].max(0.0).sqrt()).collect())
    }
}

fn square(list: &[f64]) -> f64 {
    list.iter().map(|x| x * x).sum()
}

/// Nominal parameters by least squares on the equation of motion where the joint moves: a start, not a result.
pub(super) fn start(plant: &Plant, logs: &[Log], viscous: bool) -> Option<Vec<f64>> {
    let moving = |log: &Log| -> Vec<[f64; 4]> {
        (0..log.t.len())
            .map(|k| {
                let [v, a] = log.slope(k);
                [k as f64, log.q[k], v, a]
            })
            .collect()
    };
    let states: Vec<Vec<[f64; 4]>> = logs.iter().map(moving).collect();
    let all = states.iter().flatten();
    let count = states.iter().map(Vec::len).sum::<usize>().max(1);
    let typical = (all.map(|s| s[2] * s[2]).sum::<f64>() / count as f64).sqrt();
    let mut normal = DMatrix::<f64>::zeros(NOMINAL, NOMINAL);
    let mut right = DVector::<f64>::zeros(NOMINAL);
    for (log, states) in logs.iter().zip(&states) {
        for (k, [_, q, v, a]) in states.iter().enumerate() {
            if v.abs() < 0.2 * typical {
                continue;
            }
            let on = f64::from(u8::from(log.on[k]));
            let fv = if viscous { -v } else { 0.0 };
            let row = [-a, on * log.u[k], -on * v, -v.signum(), fv, -1.0];
            let known = plant.inertia * a + plant.weight(*q);
            for i in 0..NOMINAL {
                right[i] += row[i] * known;
                for j in 0..NOMINAL {
                    normal[(i, j)] += row[i] * row[j];
                }
            }
        }
    }
    for i in 0..NOMINAL {
        normal[(i, i)] += 1.0e-12 + 1.0e-9 * normal[(i, i)];
    }
    let x = normal.cholesky()?.solve(&right);
    let weight = plant.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    let gain = if x[1] > 0.0 { x[1] } else { return None };
    Some(vec![
        x[0].max(0.05 * plant.inertia),
        gain,
        (x[2] / gain).max(1.0e-3),
        x[3].max(0.01 * weight),
        if viscous {
            x[4].max(1.0e-3 * weight)
        } else {
            0.0
        },
        x[5],
    ])
}
