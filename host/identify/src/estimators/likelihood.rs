//! Maximum likelihood with the residual's own covariance: autoregressive in time per joint, correlated between joints
//! at one instant.
//!
//! Feasible generalised least squares, iterated to its fixed point, which maximises the Gaussian likelihood (Oberhofer
//! & Kmenta 1974). Per equation an autoregression of the residual prewhitens regressor and torque (Yule–Walker, solved
//! by Levinson's recursion, order by Bayes' information criterion). A Cholesky factor removes the correlation of the
//! innovations between joints. Least squares on the whitened rows is efficient. At the start of a stretch, after a gap
//! or a masked row, the recursion's predictors of lower order are used, so that no row is lost.
//!
//! Limits: no correlation of one joint's residual with another's at other instants; the noise does not change with the
//! motion.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::{DMatrix, DVector};

use super::fitted::Fitted;
use super::least::from_factors;
use super::linear::spread;
use super::problem::Problem;
use crate::error::IdentifyError;
use crate::rows::equation::Rows;
use crate::rows::factor::TriangularFactor;
use crate::rows::stream::each_rows;
use crate::uncertainty::jackknife::{LeaveOut, PARTS, joined, part_of};
use crate::uncertainty::parts::Parts;
use crate::warning::{Unsettled, Warning};
use rig_numerics::autoregression::Predictors;
use rig_numerics::vector::dot_in_order;

/// Highest order of the autoregression.
const MOST_ORDER: usize = 20;
/// Share of white noise assumed in every residual's variance. Filters leave bands without power, in which a pure
/// autoregression would amplify small errors, mainly model errors.
const WHITE_SHARE: f64 = 0.01;
/// Largest change of a parameter at convergence, as a share of its standard deviation.
const SETTLED: f64 = 0.01;
/// Largest number of passes; a warning reports it.
const MOST_PASSES: usize = 30;

/// The latest consecutive rows of one equation: [x | y] of the kept columns.
#[derive(Clone, Default)]
struct Past {
    rows: VecDeque<Vec<f64>>,
}

impl Past {
    /// Returns the innovation of `row`, in units of its standard deviation.
    fn innovation(&mut self, row: Vec<f64>, predictors: &Predictors) -> Vec<f64> {
        let order = self.rows.len().min(predictors.order());
        let mut out = row.clone();
        for (a, past) in predictors.coefficients(order).iter().zip(&self.rows) {
            for (to, from) in out.iter_mut().zip(past) {
                *to -= a * from;
            }
        }
        let scale = 1.0 / predictors.sigma(order).max(f64::MIN_POSITIVE);
        for to in &mut out {
            *to *= scale;
        }
        self.rows.push_front(row);
        self.rows.truncate(predictors.order().max(1));
        out
    }
}

/// Calls `take` at every instant with its number, its row index and whether it directly follows the previous one.
fn each_instant(
    problem: &Problem,
    take: &mut dyn FnMut(usize, u64, &Rows, usize, bool),
) -> Result<(), IdentifyError> {
    let mut index = 0;
    for (r, recording) in problem.training.iter().enumerate() {
        let mut last: Option<f64> = None;
        let mut step = f64::INFINITY;
        each_rows(
            *recording,
            problem.plan,
            problem.options.model,
            &mut |rows| {
                for i in 0..rows.t.len() {
                    let t = rows.t[i];
                    let since = last.map(|before| t - before);
                    // The shortest interval so far is one row; a gap is longer than 1.5 rows.
                    let follows = since.is_some_and(|s| s > 0.0 && s < 1.5 * step);
                    if let Some(s) = since.filter(|s| *s > 0.0) {
                        step = step.min(s);
                    }
                    last = Some(t);
                    take(r, index, rows, i, follows);
                    index += 1;
                }
                Ok(())
            },
        )?;
    }
    Ok(())
}

/// Fits the autoregressions of the residual under `full`, one per equation. The likelihood of a recording counts with its
/// weight, and so do its products. The order's criterion gets as many rows as rows of one weight would be needed for the
/// same scatter, (Σw)²/Σw² (Kish 1992).
fn autoregressions(problem: &Problem, full: &[f64]) -> Result<Vec<Predictors>, IdentifyError> {
    let (p, equations) = (problem.base.len(), problem.weights.len());
    let weights = squared_weights(problem);
    let mut past: Vec<VecDeque<f64>> = vec![VecDeque::new(); equations];
    let mut sums = vec![vec![0.0; MOST_ORDER + 1]; equations];
    // Per equation, sum of the weights and of their squares.
    let mut counts = vec![[0.0; 2]; equations];
    each_instant(problem, &mut |r, _, rows, i, follows| {
        for (k, equation) in rows.equations.iter().enumerate() {
            if !follows || !equation.keep[i] {
                past[k].clear();
            }
            if equation.keep[i] {
                let e = equation.y[i] - dot_in_order(&equation.x[i * p..(i + 1) * p], full);
                past[k].push_front(e);
                past[k].truncate(MOST_ORDER + 1);
                counts[k][0] += weights[r];
                counts[k][1] += weights[r] * weights[r];
                for (sum, before) in sums[k].iter_mut().zip(&past[k]) {
                    *sum += weights[r] * e * before;
                }
            }
        }
    })?;
    Ok(sums
        .iter()
        .zip(&counts)
        .map(|(sum, [count, squares])| {
            let all = count.max(f64::MIN_POSITIVE);
            let mut covariance: Vec<f64> = sum.iter().map(|s| s / all).collect();
            covariance[0] *= 1.0 + WHITE_SHARE;
            let rows = count * count / squares.max(f64::MIN_POSITIVE);
            Predictors::of(&covariance, rows.round() as u64)
        })
        .collect())
}

/// Returns how often each recording counts, by which sums of squares are weighted.
fn squared_weights(problem: &Problem) -> Vec<f64> {
    problem.recording_weights().map(|w| w * w).collect()
}

/// Inverse lower Cholesky factor of the joints' correlation, for each set of joints present.
struct Whiteners {
    correlation: DMatrix<f64>,
    by_mask: BTreeMap<u64, DMatrix<f64>>,
}

impl Whiteners {
    /// Builds the correlation from sums of products; shrinks it towards independence until it is positive definite.
    fn new(sums: &DMatrix<f64>) -> Self {
        let n = sums.nrows();
        let mut correlation = DMatrix::from_fn(n, n, |i, j| {
            let scale = (sums[(i, i)] * sums[(j, j)]).sqrt();
            if i == j {
                1.0
            } else if scale > 0.0 {
                sums[(i, j)] / scale
            } else {
                0.0
            }
        });
        while correlation.clone().cholesky().is_none() {
            for i in 0..n {
                for j in 0..n {
                    if i != j {
                        correlation[(i, j)] *= 0.9;
                    }
                }
            }
        }
        Self {
            correlation,
            by_mask: BTreeMap::new(),
        }
    }

    fn of(&mut self, present: &[usize]) -> &DMatrix<f64> {
        let mask = present.iter().fold(0u64, |m, k| m | 1 << k);
        let correlation = &self.correlation;
        self.by_mask.entry(mask).or_insert_with(|| {
            let n = present.len();
            let part = DMatrix::from_fn(n, n, |i, j| correlation[(present[i], present[j])]);
            // A principal submatrix of a positive definite matrix is positive definite.
            part.cholesky()
                .and_then(|c| c.l().try_inverse())
                .unwrap_or_else(|| DMatrix::identity(n, n))
        })
    }
}

/// Runs one pass: factors of the whitened rows by stretch, and the innovations' products between joints.
fn whitened(
    problem: &Problem,
    full: &[f64],
    predictors: &[Predictors],
    whiteners: &mut Whiteners,
) -> Result<(Vec<TriangularFactor>, DMatrix<f64>), IdentifyError> {
    let (p, equations) = (problem.base.len(), problem.weights.len());
    let weights: Vec<f64> = problem.recording_weights().collect();
    let mut past = vec![Past::default(); equations];
    let mut factors = vec![TriangularFactor::new(p); PARTS];
    let mut sums = DMatrix::zeros(equations, equations);
    let mut present = Vec::with_capacity(equations);
    let mut innovations: Vec<Vec<f64>> = Vec::with_capacity(equations);
    let mut out = vec![0.0; p + 1];
    each_instant(problem, &mut |r, index, rows, i, follows| {
        present.clear();
        innovations.clear();
        for (k, equation) in rows.equations.iter().enumerate() {
            if !follows || !equation.keep[i] {
                past[k].rows.clear();
            }
            if equation.keep[i] {
                let mut row = equation.x[i * p..(i + 1) * p].to_vec();
                row.push(equation.y[i]);
                present.push(k);
                innovations.push(past[k].innovation(row, &predictors[k]));
            }
        }
        let errors: Vec<f64> = innovations
            .iter()
            .map(|row| row[p] - dot_in_order(&row[..p], full))
            .collect();
        for (a, ea) in present.iter().zip(&errors) {
            for (b, eb) in present.iter().zip(&errors) {
                sums[(*a, *b)] += weights[r] * weights[r] * ea * eb;
            }
        }
        let lower = whiteners.of(&present);
        for a in 0..present.len() {
            out.fill(0.0);
            for (b, row) in innovations.iter().enumerate().take(a + 1) {
                let share = lower[(a, b)];
                if share != 0.0 {
                    for (to, from) in out.iter_mut().zip(row) {
                        *to += share * from;
                    }
                }
            }
            factors[part_of(index, problem.instants)].push(&out[..p], out[p], weights[r]);
        }
    })?;
    Ok((factors, sums))
}

/// Fits by maximum likelihood.
pub(crate) fn likelihood(problem: &Problem, parts: &Parts) -> Result<Fitted, IdentifyError> {
    let equations = problem.weights.len();
    let mut values = problem.start.to_vec();
    let mut whiteners = Whiteners::new(&DMatrix::identity(equations, equations));
    for pass in 1.. {
        let full = spread(&values, &problem.data.kept, problem.base.len());
        let predictors = autoregressions(problem, &full)?;
        let (factors, sums) = whitened(problem, &full, &predictors, &mut whiteners)?;
        let all = LeaveOut::of(&joined(factors, parts.count));
        let mut fitted = from_factors(problem, &all)?;
        let moved = DVector::from_column_slice(&fitted.kept.whole)
            .iter()
            .zip(&values)
            .zip(&fitted.classical_std)
            .map(|((a, b), s)| (a - b).abs() / s.max(f64::MIN_POSITIVE))
            .fold(0.0, f64::max);
        values.clone_from(&fitted.kept.whole);
        // In the first pass the correlation between joints is still unknown.
        if (pass > 1 && moved <= SETTLED) || pass == MOST_PASSES {
            if moved > SETTLED {
                fitted.warnings.push(Warning::Unsettled {
                    by: Unsettled::Likelihood,
                    passes: MOST_PASSES,
                    moved: Some(moved),
                });
            }
            let orders: Vec<String> = predictors.iter().map(|p| p.order().to_string()).collect();
            let strongest = (0..equations)
                .flat_map(|i| (0..i).map(move |j| (i, j)))
                .map(|(i, j)| (whiteners.correlation[(i, j)], j + 1, i + 1))
                .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
            fitted.said.push(format!(
                "Iterated generalised least squares, {pass} passes; order of each residual's autoregression: {}{}.",
                orders.join(", "),
                strongest.map_or(String::new(), |(rho, i, j)| format!(
                    "; strongest correlation of innovations {rho:.2}, between joints {i} and {j}"
                ))
            ));
            return Ok(fitted);
        }
        whiteners = Whiteners::new(&sums);
    }
    // The loop above ends by its pass count.
    Err(IdentifyError::Unsettled {
        what: "Maximum likelihood",
        passes: MOST_PASSES,
    })
}
