//! Nonlinear least squares from a start whose standard deviations are known, with a covariance that is robust to
//! correlation within blocks.
//!
//! By hand: central differences over known standard deviations, evaluated side by side, and few passes because each
//! evaluation is a simulation.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::statistics::sum_of_squares;

/// Factor of the damping after a step that does not reduce the squares, and its first value.
const DAMPING: (f64, f64) = (10.0, 1e-2);

/// Settings of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Most passes.
    pub passes: usize,
    /// Largest change of the last pass, in standard deviations; the derivatives are then kept.
    pub settled: f64,
    /// Most increases of the damping in a pass.
    pub damped: usize,
}

/// A residual whose rows are independent between blocks.
#[derive(Clone, Debug, Default)]
pub struct BlockedResidual {
    /// Residual, row by row.
    pub values: Vec<f64>,
    /// Block of each row.
    pub blocks: Vec<(usize, usize)>,
}

impl BlockedResidual {
    fn squares(&self) -> f64 {
        sum_of_squares(&self.values)
    }
}

/// Returns the values of least squares from `theta`, and their covariance between blocks. `stds` are the standard
/// deviations of `theta`, `found` is its residual. `residual` is `None` where it is undefined. `each` returns the results
/// of a function for 0 … n − 1, in order. `None` if the values are not identifiable.
pub fn gauss_newton(
    mut theta: Vec<f64>,
    stds: &[f64],
    mut found: BlockedResidual,
    residual: &(impl Fn(&[f64]) -> Option<BlockedResidual> + Sync),
    each: impl Fn(usize, &(dyn Fn(usize) -> Option<Vec<f64>> + Sync)) -> Vec<Option<Vec<f64>>>,
    settings: Settings,
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let n = theta.len();
    for pass in 1.. {
        let column = |k: usize| slope(&theta, k, stds[k], &found, residual);
        let columns: Option<Vec<Vec<f64>>> = each(n, &column).into_iter().collect();
        let columns = columns?;
        // In units of the standard deviations, which differ by orders of magnitude.
        let slopes = DMatrix::from_fn(found.values.len(), n, |row, k| stds[k] * columns[k][row]);
        let information = slopes.tr_mul(&slopes);
        let pull = slopes.tr_mul(&DVector::from_column_slice(&found.values));
        let mut damping = 0.0;
        let mut moved = 0.0_f64;
        for _ in 0..settings.damped {
            let mut damped = information.clone();
            for k in 0..n {
                damped[(k, k)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&pull);
            let next: Vec<f64> = (0..n).map(|k| theta[k] - stds[k] * step[k]).collect();
            match residual(&next).filter(|next| next.squares() < found.squares()) {
                Some(better) => {
                    (theta, found) = (next, better);
                    moved = step.amax();
                    break;
                }
                None => damping = f64::max(DAMPING.0 * damping, DAMPING.1),
            }
        }
        if moved <= settings.settled || pass == settings.passes {
            let inverse = information.cholesky()?.inverse();
            let covariance = between_blocks(&found, &slopes, &inverse);
            let covariance = DMatrix::from_fn(n, n, |a, b| stds[a] * covariance[(a, b)] * stds[b]);
            return Some((theta, covariance));
        }
    }
    None
}

/// Returns the derivative of the residual by value `k`, over `std` to both sides. `None` if neither side is defined.
fn slope(
    theta: &[f64],
    k: usize,
    std: f64,
    found: &BlockedResidual,
    residual: &impl Fn(&[f64]) -> Option<BlockedResidual>,
) -> Option<Vec<f64>> {
    let at = |by: f64| {
        let mut theta = theta.to_vec();
        theta[k] += by;
        residual(&theta)
    };
    let difference = |up: &BlockedResidual, down: &BlockedResidual, step: f64| -> Vec<f64> {
        (up.values.iter().zip(&down.values))
            .map(|(a, b)| (a - b) / step)
            .collect()
    };
    // At a bound only one side exists.
    match [at(std), at(-std)] {
        [Some(up), Some(down)] => Some(difference(&up, &down, 2.0 * std)),
        [Some(up), None] => Some(difference(&up, found, std)),
        [None, Some(down)] => Some(difference(found, &down, std)),
        [None, None] => None,
    }
}

/// Returns the covariance from the scores of the blocks, in the units of the slopes.
fn between_blocks(
    found: &BlockedResidual,
    slopes: &DMatrix<f64>,
    inverse: &DMatrix<f64>,
) -> DMatrix<f64> {
    let n = slopes.ncols();
    let mut scores: BTreeMap<(usize, usize), DVector<f64>> = BTreeMap::new();
    for (row, (residual, block)) in found.values.iter().zip(&found.blocks).enumerate() {
        let own = scores.entry(*block);
        *own.or_insert_with(|| DVector::zeros(n)) += slopes.row(row).transpose() * *residual;
    }
    let mut spread = DMatrix::zeros(n, n);
    for score in scores.values() {
        spread += score * score.transpose();
    }
    let count = scores.len() as f64;
    inverse * spread * inverse * (count / (count - 1.0))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    const SETTINGS: Settings = Settings {
        passes: 4,
        settled: 0.5,
        damped: 5,
    };

    /// A line with correlated noise: least squares, with deviations by blocks.
    #[test]
    fn the_nearest_values_are_least_squares_and_their_deviations_count_stretches() {
        let rows = 4000;
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let noise: Vec<f64> = (0..rows / 100)
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let departs = |theta: &[f64]| {
            let at = |k: usize| {
                let x = k as f64 / rows as f64;
                (theta[0] - 2.0) + (theta[1] - 3.0) * x - noise[k / 100]
            };
            Some(BlockedResidual {
                values: (0..rows).map(at).collect(),
                blocks: (0..rows).map(|k| (0, k / 100)).collect(),
            })
        };
        let each = |n: usize, slope: &(dyn Fn(usize) -> Option<Vec<f64>> + Sync)| {
            (0..n).map(slope).collect::<Vec<_>>()
        };
        let start = vec![0.0, 0.0];
        let first = departs(&start).unwrap();
        let (theta, covariance) =
            gauss_newton(start, &[0.01, 10.0], first, &departs, each, SETTINGS).unwrap();
        let std: Vec<f64> = covariance.diagonal().iter().map(|v| v.sqrt()).collect();
        let left = departs(&theta).unwrap();
        let sum: f64 = left.values.iter().sum();
        assert!(sum.abs() < 1e-6 * rows as f64, "{sum}");
        // For mean and slope over 40 independent values of variance 1/3.
        let spread = (1.0_f64 / 3.0 / 40.0).sqrt();
        assert!((std[0] / (2.0 * spread) - 1.0).abs() < 0.4, "{std:?}");
        assert!(
            (std[1] / (12.0_f64.sqrt() * spread) - 1.0).abs() < 0.4,
            "{std:?}"
        );
        assert!((theta[0] - 2.0).abs() < 4.0 * std[0] && (theta[1] - 3.0).abs() < 4.0 * std[1]);
        // A parameter without effect is not identifiable.
        let blind = |theta: &[f64]| departs(&[theta[0] + theta[1], 0.0]);
        let first = blind(&[0.0, 0.0]).unwrap();
        let found = gauss_newton(vec![0.0, 0.0], &[1.0, 1.0], first, &blind, each, SETTINGS);
        assert!(found.is_none());
    }
}
