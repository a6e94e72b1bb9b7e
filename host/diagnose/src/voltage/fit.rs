//! Fits of a voltage-driven joint to its simulated motion: Levenberg–Marquardt within bounds.
//!
//! Levenberg 1944, Marquardt 1963. Slopes are differences, because sticking and slipping change with the parameters.
//! Fits start with short windows (Bock 1983), each from the recorded state, so that no motion diverges. Whole
//! recordings follow.

use nalgebra::{DMatrix, DVector};
use rig_shared::effects::Kind;

use crate::voltage::halt::Halt;
use crate::voltage::log::{Log, Segment};
use crate::voltage::plant::Plant;

/// Length of the windows that a fit begins with, s.
pub(crate) const WINDOW: f64 = 1.0;
/// Relative step of the differences: far above rounding, smaller than the width of any law.
const DIFFERENCE: f64 = 1.0e-3;
/// Most steps.
const STEPS: usize = 40;
/// Steps of each of several starts before only the best continues.
const FIRST_STEPS: usize = 6;
/// Share of the sum of squares below which the gain of two steps in a row ends a fit.
const SETTLED: f64 = 1.0e-4;
/// Damping above which a fit ends.
const STIFFEST: f64 = 1.0e8;

/// Inputs of a fit.
pub(crate) struct Problem<'a> {
    pub plant: &'a Plant,
    pub logs: &'a [Log],
    /// Index of a log, and its rows.
    pub segments: Vec<(usize, Segment)>,
    pub effects: &'a [Kind],
    /// Fitted parameters.
    pub free: &'a [usize],
    /// Bounds of all parameters.
    pub bounds: &'a [[f64; 2]],
}

/// Returns the segments of the logs in `which`, in windows of `length` seconds.
pub(crate) fn segments(
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
    /// Returns simulated minus recorded position, row by row.
    ///
    /// # Errors
    /// [`Halt`] if the simulation is not possible.
    pub(crate) fn residual(&self, theta: &[f64]) -> Result<Vec<f64>, Halt> {
        let rows = self.segments.iter().map(|(_, s)| s.to - s.from).sum();
        let mut out = Vec::with_capacity(rows);
        for (k, segment) in &self.segments {
            let log = &self.logs[*k];
            let start = out.len();
            (self.plant).simulate(self.effects, theta, log, segment, &mut out)?;
            for (simulated, recorded) in out[start..].iter_mut().zip(&log.q[segment.from..]) {
                *simulated -= recorded;
            }
        }
        Ok(out)
    }

    /// Returns the RMS of [`Self::residual`]; infinite if it fails.
    pub(crate) fn rms(&self, theta: &[f64]) -> f64 {
        self.residual(theta).map_or(f64::INFINITY, |r| {
            (square(&r) / r.len().max(1) as f64).sqrt()
        })
    }

    /// Returns the slopes of the residual by the free parameters, one column each.
    fn slopes(&self, theta: &[f64], residual: &[f64], typical: &[f64]) -> Option<DMatrix<f64>> {
        let mut slopes = DMatrix::zeros(residual.len(), self.free.len());
        for (column, &p) in self.free.iter().enumerate() {
            let step = DIFFERENCE * theta[p].abs().max(typical[p]);
            let mut moved = theta.to_vec();
            // Inwards from the upper bound, or where the other side cannot be simulated.
            let mut found = None;
            for side in [step, -step] {
                moved[p] = theta[p] + side;
                if moved[p] <= self.bounds[p][1] && moved[p] >= self.bounds[p][0] {
                    found = self.residual(&moved).ok().map(|r| (side, r));
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

    /// Returns the parameters of least squares near the best of `starts`; that start itself if nothing is better.
    pub(crate) fn fit(&self, starts: &[&[f64]]) -> Vec<f64> {
        if let [start] = starts {
            return self.descend(Descent::from(self, start), STEPS).theta;
        }
        let tried =
            (starts.iter()).map(|start| self.descend(Descent::from(self, start), FIRST_STEPS));
        let best = tried.reduce(|a, b| if b.cost < a.cost { b } else { a });
        best.map_or_else(Vec::new, |best| {
            self.descend(best, STEPS - FIRST_STEPS).theta
        })
    }

    /// Continues a fit by at most `steps` steps.
    fn descend(&self, mut at: Descent, steps: usize) -> Descent {
        for _ in 0..steps {
            if at.settled {
                break;
            }
            let Some(slopes) = self.slopes(&at.theta, &at.residual, &at.typical) else {
                at.settled = true;
                break;
            };
            let normal = slopes.tr_mul(&slopes);
            let gradient = slopes.tr_mul(&DVector::from_column_slice(&at.residual));
            let mut won = 0.0;
            while at.damping < STIFFEST {
                let Some(trial) = self.step(&at.theta, &normal, &gradient, at.damping) else {
                    break;
                };
                let found = self.residual(&trial).ok().map(|r| (square(&r), r));
                if let Some((less, r)) = found.filter(|(less, _)| *less < at.cost) {
                    won = 1.0 - less / at.cost;
                    (at.theta, at.residual, at.cost) = (trial, r, less);
                    at.damping = (0.2 * at.damping).max(1.0e-9);
                    break;
                }
                at.damping *= 5.0;
            }
            at.quiet = if won < SETTLED { at.quiet + 1 } else { 0 };
            at.settled = at.quiet > 1 || at.damping >= STIFFEST;
        }
        at
    }

    /// Returns the parameters after one damped step; those pressed against a bound stay there.
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

    /// Limits each parameter to its bounds.
    fn within(&self, theta: &[f64]) -> Vec<f64> {
        (theta.iter().zip(self.bounds))
            .map(|(x, [low, high])| x.clamp(*low, *high))
            .collect()
    }

    /// Returns the free parameters' standard deviations, with segments as independent blocks (sandwich, White 1982).
    pub(crate) fn deviations(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let residual = self.residual(theta).ok()?;
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

/// State of a fit.
struct Descent {
    theta: Vec<f64>,
    /// Scale of each parameter.
    typical: Vec<f64>,
    residual: Vec<f64>,
    /// Sum of squares; infinite if the start cannot be simulated.
    cost: f64,
    damping: f64,
    /// Steps in a row with negligible gain.
    quiet: usize,
    settled: bool,
}

impl Descent {
    fn from(problem: &Problem<'_>, start: &[f64]) -> Self {
        let theta = problem.within(start);
        let residual = problem.residual(&theta);
        Self {
            typical: start.iter().map(|x| x.abs().max(1.0e-9)).collect(),
            theta,
            cost: residual.as_ref().map_or(f64::INFINITY, |r| square(r)),
            settled: residual.is_err(),
            residual: residual.unwrap_or_default(),
            damping: 1.0e-2,
            quiet: 0,
        }
    }
}

fn square(list: &[f64]) -> f64 {
    list.iter().map(|x| x * x).sum()
}
