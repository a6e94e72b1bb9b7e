//! Iteratively reweighted least squares (Huber 1964; Holland & Welsch 1977), one pass per iteration.

use super::fitted::Fitted;
use super::least::from_factors;
use super::linear::spread;
use super::problem::Problem;
use crate::error::IdentifyError;
use crate::options::Options;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use crate::uncertainty::jackknife::{LeaveOut, PARTS, joined, part_of};
use crate::uncertainty::parts::Parts;
use rig_data::prepare::Recording;
use rig_numerics::vector::dot_in_order;

/// Absolute residuals in logarithmic bins of 1 %: gives the median of any number in constant memory.
#[derive(Clone)]
struct Median {
    counts: Vec<u64>,
    total: u64,
}

impl Median {
    const LEAST: f64 = 1e-15;
    fn new() -> Self {
        Self {
            counts: vec![0; 7000],
            total: 0,
        }
    }
    fn push(&mut self, e: f64) {
        let bin = ((e.abs().max(Self::LEAST) / Self::LEAST).ln() / 0.01) as usize;
        let last = self.counts.len() - 1;
        self.counts[bin.min(last)] += 1;
        self.total += 1;
    }
    /// Returns the standard deviation from the median of absolute residuals, which is insensitive to outliers.
    fn sigma(&self) -> f64 {
        let mut sum = 0;
        for (bin, count) in self.counts.iter().enumerate() {
            sum += count;
            if 2 * sum >= self.total {
                return 1.4826 * Self::LEAST * ((bin as f64 + 0.5) * 0.01).exp();
            }
        }
        0.0
    }
}

/// Returns the spread of each equation's residuals for given parameters.
pub(crate) fn spread_of(
    training: &[&dyn Recording],
    plan: &Plan,
    options: &Options,
    full: &[f64],
    equations: usize,
) -> Result<Vec<f64>, IdentifyError> {
    let mut medians = vec![Median::new(); equations];
    let p = full.len();
    for recording in training {
        each_rows(*recording, plan, options.model, &mut |rows| {
            for (median, equation) in medians.iter_mut().zip(&rows.equations) {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    median
                        .push(equation.y[i] - dot_in_order(&equation.x[i * p..(i + 1) * p], full));
                }
            }
            Ok(())
        })?;
    }
    Ok(medians.iter().map(Median::sigma).collect())
}

/// Runs one pass of iteratively reweighted least squares; also returns the spread of its initial residuals.
pub(crate) fn reweighted(
    training: &[&dyn Recording],
    plan: &Plan,
    options: &Options,
    full: &[f64],
    weights: &[f64],
    scale: &[f64],
) -> Result<(TriangularFactor, Vec<f64>), IdentifyError> {
    let p = full.len();
    let mut factor = TriangularFactor::new(p);
    let mut medians = vec![Median::new(); weights.len()];
    for (r, recording) in training.iter().enumerate() {
        each_rows(*recording, plan, options.model, &mut |rows| {
            for (k, equation) in rows.equations.iter().enumerate() {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    let x = &equation.x[i * p..(i + 1) * p];
                    let e = equation.y[i] - dot_in_order(x, full);
                    medians[k].push(e);
                    let weight = options.loss.weight(e / scale[k].max(f64::MIN_POSITIVE));
                    factor.push(
                        x,
                        equation.y[i],
                        options.row_weight(r) * weights[k] * weight.sqrt(),
                    );
                }
            }
            Ok(())
        })?;
    }
    Ok((factor, medians.iter().map(Median::sigma).collect()))
}

/// Number of passes of a fit for the comparison.
const COMPARED_PASSES: usize = 15;

/// Fits robustly with one segment left out at a time; the weights of all rows are those of the whole fit.
pub(crate) fn robust(problem: &Problem, parts: &Parts) -> Result<Fitted, IdentifyError> {
    let (training, plan, options) = (problem.training, problem.plan, problem.options);
    let p = problem.base.len();
    let mut full = problem.start_full();
    let mut scale = spread_of(training, plan, options, &full, problem.weights.len())?;
    for pass in 0.. {
        let mut factors = vec![TriangularFactor::new(p); PARTS];
        let mut medians = vec![Median::new(); problem.weights.len()];
        let mut index = 0;
        for (r, recording) in training.iter().enumerate() {
            each_rows(*recording, plan, options.model, &mut |rows| {
                for i in 0..rows.t.len() {
                    let factor = &mut factors[part_of(index, problem.instants)];
                    for (k, equation) in rows.equations.iter().enumerate() {
                        if equation.keep[i] {
                            let x = &equation.x[i * p..(i + 1) * p];
                            let e = equation.y[i] - dot_in_order(x, &full);
                            medians[k].push(e);
                            let loss = options.loss.weight(e / scale[k].max(f64::MIN_POSITIVE));
                            let weight = options.row_weight(r) * problem.weights[k] * loss.sqrt();
                            factor.push(x, equation.y[i], weight);
                        }
                    }
                    index += 1;
                }
                Ok(())
            })?;
        }
        let fitted = from_factors(problem, &LeaveOut::of(&joined(factors, parts.count)))?;
        let before: Vec<f64> = problem.data.kept.iter().map(|&c| full[c]).collect();
        let moved = fitted
            .kept
            .whole
            .iter()
            .zip(&before)
            .zip(&fitted.classical_std)
            .map(|((a, b), s)| (a - b).abs() / s.max(f64::MIN_POSITIVE))
            .fold(0.0, f64::max);
        if moved <= 1e-2 || pass + 1 == COMPARED_PASSES {
            return Ok(fitted);
        }
        full = spread(&fitted.kept.whole, &problem.data.kept, p);
        scale = medians.iter().map(Median::sigma).collect();
    }
    // The loop above ends by its pass count.
    Err(IdentifyError::Unsettled {
        what: "The robust fit",
        passes: COMPARED_PASSES,
    })
}
