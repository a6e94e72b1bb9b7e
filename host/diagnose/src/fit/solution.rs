//! Joint solution for all coefficients, with a covariance that is robust to correlated residuals.

use nalgebra::{DMatrix, DVector};

use crate::fit::least_squares::{Fit, ROUNDS};
use crate::rows::regression::Column;
use rig_numerics::optimise::non_negative::nnls;
use rig_numerics::vector::dot;

/// Coefficients of columns fitted together.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    /// One per column.
    pub(crate) values: Vec<f64>,
    /// Covariance, robust to correlation within blocks; it includes linearised columns.
    pub(crate) covariance: DMatrix<f64>,
}

impl Solution {
    /// Returns the standard deviation of a coefficient.
    pub(crate) fn std(&self, k: usize) -> f64 {
        self.covariance[(k, k)].max(0.0).sqrt()
    }

    /// Inserts known coefficients of 1 at these indices of the longer list, in rising order.
    pub(crate) fn with_known(mut self, places: &[usize]) -> Self {
        for &place in places {
            self.values.insert(place, 1.0);
            self.covariance = self
                .covariance
                .insert_row(place, 0.0)
                .insert_column(place, 0.0);
        }
        self
    }
}

/// Fits `columns` to the torque. The coefficients marked in `bounded` (empty: none) cannot be negative. None if the
/// columns are collinear.
///
/// The covariance is that of the fit without bounds, so a coefficient at its bound has a standard deviation.
pub(crate) fn solve(plain: &Fit, columns: &[&Column], bounded: &[bool]) -> Option<Solution> {
    solved(columns, bounded, &[], plain, &|all, inverse, rest| {
        Some(plain.sandwich(all, inverse, rest))
    })
}

/// [`solve`] with a jackknife covariance over the blocks of `plain`, widened if blocks of one of the `strata` give
/// more. A law's mismatch follows speed, position or load, with the same bias in all such rows. `slopes` are derivatives
/// by nonlinear parameters; they follow the columns in the covariance only.
pub(crate) fn jackknifed(
    plain: &Fit,
    strata: &[Fit],
    columns: &[&Column],
    bounded: &[bool],
    slopes: &[Column],
) -> Option<Solution> {
    solved(columns, bounded, slopes, plain, &|all, inverse, rest| {
        let mut covariance = plain.jackknife(all, rest)?;
        let mut widest = covariance.diagonal();
        for strata in strata {
            let other = strata.sandwich(all, inverse, rest).diagonal();
            widest.zip_apply(&other, |w, o| *w = w.max(o));
        }
        let wider: Vec<f64> = (widest.iter().zip(covariance.diagonal().iter()))
            .map(|(widest, own)| (widest / own.max(f64::MIN_POSITIVE)).sqrt())
            .collect();
        for a in 0..wider.len() {
            for b in 0..wider.len() {
                covariance[(a, b)] *= wider[a] * wider[b];
            }
        }
        Some(covariance)
    })
}

/// Covariance from weighted columns, the inverse of their inner products, and their residual.
type Covariance<'f> = dyn Fn(&[Vec<f64>], &DMatrix<f64>, &[f64]) -> Option<DMatrix<f64>> + 'f;

fn solved(
    columns: &[&Column],
    bounded: &[bool],
    slopes: &[Column],
    plain: &Fit,
    covariance: &Covariance,
) -> Option<Solution> {
    let weighted: Vec<Vec<f64>> = columns.iter().map(|c| plain.weighted(c)).collect();
    let torque = plain.left();
    let (values, inverse) = normal(&weighted, torque, bounded)?;
    let mut rest = torque.to_vec();
    for (column, value) in weighted.iter().zip(&values) {
        for (r, c) in rest.iter_mut().zip(column) {
            *r -= value * c;
        }
    }
    if slopes.is_empty() {
        let covariance = covariance(&weighted, &inverse, &rest)?;
        return Some(Solution { values, covariance });
    }
    let mut all = weighted;
    all.extend(slopes.iter().map(|c| plain.weighted(c)));
    let (_, inverse) = normal(&all, torque, &[])?;
    let covariance = covariance(&all, &inverse, &rest)?;
    Some(Solution { values, covariance })
}

/// Returns the solution, without negative values where `bounded`, and the inverse of the normal matrix. The columns are
/// scaled to unit length.
fn normal(
    columns: &[Vec<f64>],
    torque: &[f64],
    bounded: &[bool],
) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let k = columns.len();
    let lengths: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt()).collect();
    if lengths.iter().any(|l| l.is_nan() || *l == 0.0) {
        return None;
    }
    let mut gram = DMatrix::zeros(k, k);
    for a in 0..k {
        for b in 0..=a {
            let entry = dot(&columns[a], &columns[b]) / (lengths[a] * lengths[b]);
            gram[(a, b)] = entry;
            gram[(b, a)] = entry;
        }
    }
    let right = DVector::from_fn(k, |a, _| dot(&columns[a], torque) / lengths[a]);
    let factor = gram.clone().cholesky()?;
    let mut solution = factor.solve(&right);
    if (solution.iter().zip(bounded)).any(|(value, bounded)| *bounded && *value < 0.0) {
        solution = nnls(&gram, &right, bounded, &mut vec![true; k], ROUNDS)?;
    }
    let mut inverse = factor.inverse();
    for a in 0..k {
        for b in 0..k {
            inverse[(a, b)] /= lengths[a] * lengths[b];
        }
    }
    let values = (0..k).map(|a| solution[a] / lengths[a]).collect();
    Some((values, inverse))
}
