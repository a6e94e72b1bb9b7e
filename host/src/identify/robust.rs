//! Iteratively reweighted least squares (Huber 1964; Holland & Welsch 1977), one pass an iteration.

use super::factor::TriangularFactor;
use super::linear::product;
use super::model::{Plan, each_rows};
use super::{IdentifyError, Options};
use crate::prepare::Recording;

/// Absolute residuals in logarithmic bins of 1 %: the median of any number of them in constant memory.
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
    /// Standard deviation by the median of absolute residuals, which outliers do not move.
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

/// Spread of the residuals of each equation under given parameters.
pub(super) fn spread_of(
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
                    median.push(equation.y[i] - product(&equation.x[i * p..(i + 1) * p], full));
                }
            }
            Ok(())
        })?;
    }
    Ok(medians.iter().map(Median::sigma).collect())
}

/// One pass of iteratively reweighted least squares, and the spread of the residuals it started from.
pub(super) fn reweighted(
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
    for recording in training {
        each_rows(*recording, plan, options.model, &mut |rows| {
            for (k, equation) in rows.equations.iter().enumerate() {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    let x = &equation.x[i * p..(i + 1) * p];
                    let e = equation.y[i] - product(x, full);
                    medians[k].push(e);
                    let weight = options.loss.weight(e / scale[k].max(f64::MIN_POSITIVE));
                    factor.push(x, equation.y[i], weights[k] * weight.sqrt());
                }
            }
            Ok(())
        })?;
    }
    Ok((factor, medians.iter().map(Median::sigma).collect()))
}
