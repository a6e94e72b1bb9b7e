//! Nonlinear least squares within bounds (Levenberg 1944, Marquardt 1963), with slopes by differences.
//!
//! By hand: a residual that is undefined at some points, bounds with variables pressed against them, and several starts
//! of which only the best continues; the crates for it have none of these.

use nalgebra::{DMatrix, DVector};

use crate::statistics::sum_of_squares;

/// Smallest damping.
const LEAST_DAMPING: f64 = 1.0e-9;
/// Damping at the start.
const FIRST_DAMPING: f64 = 1.0e-2;
/// Smallest typical size of a variable.
const LEAST_SIZE: f64 = 1.0e-9;
/// Share of the largest diagonal element that every one gets.
const RIDGE: f64 = 1.0e-14;

/// Settings of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Step of the differences, relative to a variable's size.
    pub difference: f64,
    /// Most steps.
    pub steps: usize,
    /// Steps of each of several starts before only the best continues.
    pub first_steps: usize,
    /// Share of the sum of squares below which the gain of two steps in a row ends a fit.
    pub settled: f64,
    /// Damping above which a fit ends.
    pub stiffest: f64,
}

/// A residual to be made small.
pub struct LeastSquares<'a, F> {
    /// Residual at all variables; `None` if it is undefined there.
    pub residual: F,
    /// Variables to fit.
    pub free: &'a [usize],
    /// Bounds of all variables.
    pub bounds: &'a [[f64; 2]],
    /// Settings.
    pub settings: Settings,
}

impl<F: Fn(&[f64]) -> Option<Vec<f64>>> LeastSquares<'_, F> {
    /// Returns the slopes of the residual by the free variables, one column each.
    fn slopes(&self, theta: &[f64], residual: &[f64], typical: &[f64]) -> Option<DMatrix<f64>> {
        let mut slopes = DMatrix::zeros(residual.len(), self.free.len());
        for (column, &p) in self.free.iter().enumerate() {
            let step = self.settings.difference * theta[p].abs().max(typical[p]);
            let mut moved = theta.to_vec();
            // Inwards from the upper bound, or where the residual is undefined on the other side.
            let mut found = None;
            for side in [step, -step] {
                moved[p] = theta[p] + side;
                if moved[p] <= self.bounds[p][1] && moved[p] >= self.bounds[p][0] {
                    found = (self.residual)(&moved).map(|r| (side, r));
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

    /// Returns the variables of least squares near the best of `starts`; that start itself if nothing is better.
    pub fn fit(&self, starts: &[&[f64]]) -> Vec<f64> {
        let Settings {
            steps, first_steps, ..
        } = self.settings;
        if let [start] = starts {
            return self.descend(self.begin(start), steps).theta;
        }
        let tried = (starts.iter()).map(|start| self.descend(self.begin(start), first_steps));
        let best = tried.reduce(|a, b| if b.cost < a.cost { b } else { a });
        best.map_or_else(Vec::new, |best| {
            self.descend(best, steps - first_steps).theta
        })
    }

    fn begin(&self, start: &[f64]) -> Descent {
        let theta = self.within(start);
        let residual = (self.residual)(&theta);
        Descent {
            typical: sizes(start),
            theta,
            cost: residual
                .as_ref()
                .map_or(f64::INFINITY, |r| sum_of_squares(r)),
            settled: residual.is_none(),
            residual: residual.unwrap_or_default(),
            damping: FIRST_DAMPING,
            quiet: 0,
        }
    }

    /// Continues a fit by at most `steps` steps.
    fn descend(&self, mut at: Descent, steps: usize) -> Descent {
        let Settings {
            settled, stiffest, ..
        } = self.settings;
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
            while at.damping < stiffest {
                let Some(trial) = self.step(&at.theta, &normal, &gradient, at.damping) else {
                    break;
                };
                let found = (self.residual)(&trial).map(|r| (sum_of_squares(&r), r));
                if let Some((less, r)) = found.filter(|(less, _)| *less < at.cost) {
                    won = 1.0 - less / at.cost;
                    (at.theta, at.residual, at.cost) = (trial, r, less);
                    at.damping = (0.2 * at.damping).max(LEAST_DAMPING);
                    break;
                }
                at.damping *= 5.0;
            }
            at.quiet = if won < settled { at.quiet + 1 } else { 0 };
            at.settled = at.quiet > 1 || at.damping >= stiffest;
        }
        at
    }

    /// Returns the variables after one damped step; those pressed against a bound stay there.
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
            left[(a, a)] += damping * left[(a, a)] + RIDGE * largest;
        }
        let step = left.lu().solve(&right)?;
        let mut next = theta.to_vec();
        for (a, c) in moving.iter().enumerate() {
            next[self.free[*c]] += step[a];
        }
        Some(self.within(&next))
    }

    /// Limits each variable to its bounds.
    fn within(&self, theta: &[f64]) -> Vec<f64> {
        (theta.iter().zip(self.bounds))
            .map(|(x, [low, high])| x.clamp(*low, *high))
            .collect()
    }

    /// Returns the free variables' standard deviations, with independent blocks of these numbers of rows, one after the
    /// other (sandwich, White 1982). `None` if the residual is undefined or a variable has no effect.
    pub fn deviations(
        &self,
        theta: &[f64],
        blocks: impl IntoIterator<Item = usize>,
    ) -> Option<Vec<f64>> {
        let residual = (self.residual)(theta)?;
        let slopes = self.slopes(theta, &residual, &sizes(theta))?;
        let normal = slopes.tr_mul(&slopes);
        let inverse = normal.try_inverse()?;
        let n = self.free.len();
        let mut meat = DMatrix::zeros(n, n);
        let mut row = 0;
        for rows in blocks {
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
    /// Scale of each variable.
    typical: Vec<f64>,
    residual: Vec<f64>,
    /// Sum of squares; infinite if the start is undefined.
    cost: f64,
    damping: f64,
    /// Steps in a row with negligible gain.
    quiet: usize,
    settled: bool,
}

fn sizes(theta: &[f64]) -> Vec<f64> {
    theta.iter().map(|x| x.abs().max(LEAST_SIZE)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_holds_one_variable_and_the_others_are_fitted() {
        // a + b·x² for points of 1 + 2·x², with b of at most 1.5; undefined for a below -10.
        let residual = |theta: &[f64]| -> Option<Vec<f64>> {
            let of = |k: i32| {
                let x = 0.1 * f64::from(k);
                theta[0] + theta[1] * x * x - (1.0 + 2.0 * x * x)
            };
            (theta[0] > -10.0).then(|| (-10..=10).map(of).collect())
        };
        let fit = LeastSquares {
            residual,
            free: &[0, 1],
            bounds: &[[-20.0, 20.0], [0.0, 1.5]],
            settings: Settings {
                difference: 1e-3,
                steps: 40,
                first_steps: 6,
                settled: 1e-4,
                stiffest: 1e8,
            },
        };
        let found = fit.fit(&[&[-15.0, 0.5], &[0.2, 0.5]]);
        // The mean of x² is 11/30: the constant takes half of that.
        assert!(
            (found[0] - (1.0 + 0.5 * 11.0 / 30.0)).abs() < 1e-3,
            "{found:?}"
        );
        assert_eq!(found[1], 1.5);
    }
}
