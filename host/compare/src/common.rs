//! The parameters that every set shows, with weights for the tests over all of them.

use nalgebra::{DMatrix, DVector};

use crate::basis::Basis;
use crate::error::CompareError;
use crate::identified_set::IdentifiedSet;
use crate::matrices::{inverse, quadratic, symmetric_pseudo_inverse};

/// Returns `weight` without what it tells about changes along the columns of `d`: that of values which may change so.
/// The second result is the number of directions.
pub(crate) fn without_changes(weight: &DMatrix<f64>, d: &DMatrix<f64>) -> (DMatrix<f64>, usize) {
    if d.ncols() == 0 {
        return (weight.clone(), 0);
    }
    let along = weight * d;
    let (inner, rank) = symmetric_pseudo_inverse(&(d.transpose() * &along));
    (weight - &along * inner * along.transpose(), rank)
}

/// What every set shows.
pub(crate) struct Common {
    /// Indices of the parameters.
    pub parameters: Vec<usize>,
    /// By set, their values.
    pub values: Vec<DVector<f64>>,
    /// By set, the inverse of their covariance.
    pub weights: Vec<DMatrix<f64>>,
    /// Degrees of freedom of the sets' differences that were fitted before, as shifts of a zero.
    pub spent: usize,
}

impl Common {
    /// Collects what every set shows.
    ///
    /// # Errors
    /// [`CompareError::Singular`].
    pub(crate) fn of(sets: &[IdentifiedSet], basis: &Basis) -> Result<Self, CompareError> {
        let parameters = basis.common();
        let (mut values, mut weights) = (Vec::new(), Vec::new());
        for (set, from) in sets.iter().zip(&basis.from_set) {
            let from = from.select_rows(&parameters);
            let covariance = &from * &set.covariance * from.transpose();
            let weight =
                inverse(&covariance).ok_or_else(|| CompareError::Singular(set.name.clone()))?;
            values.push(&from * &set.values);
            weights.push(weight * set.inverse_factor);
        }
        Ok(Self {
            parameters,
            values,
            weights,
            spent: 0,
        })
    }

    /// Returns the degrees of freedom of the sets' differences.
    pub(crate) fn freedom(&self) -> usize {
        (self.parameters.len() * self.values.len().saturating_sub(1)).saturating_sub(self.spent)
    }

    /// Returns the mean with the given weights, and the sum of squares about it.
    pub(crate) fn about_mean(&self, weights: &[DMatrix<f64>]) -> Option<(DVector<f64>, f64)> {
        let c = self.parameters.len();
        let (mut sum, mut right) = (DMatrix::zeros(c, c), DVector::zeros(c));
        for (weight, y) in weights.iter().zip(&self.values) {
            sum += weight;
            right += weight * y;
        }
        let mean = inverse(&sum)? * right;
        let squares = (weights.iter().zip(&self.values))
            .map(|(weight, y)| quadratic(weight, &(y - &mean)))
            .sum();
        Some((mean, squares))
    }

    /// Returns the sum of squares of all sets but `left_out` about their mean.
    pub(crate) fn about_mean_without(&self, left_out: usize) -> Option<f64> {
        let others = (self.values.iter().zip(&self.weights).enumerate())
            .filter(|(s, _)| *s != left_out)
            .map(|(_, (y, weight))| (y.clone(), weight.clone()));
        let (values, weights) = others.unzip();
        let others = Self {
            parameters: self.parameters.clone(),
            values,
            weights,
            spent: self.spent,
        };
        Some(others.about_mean(&others.weights)?.1)
    }

    /// Returns the covariance of the mean.
    pub(crate) fn covariance(&self) -> Option<DMatrix<f64>> {
        let c = self.parameters.len();
        let sum = (self.weights.iter()).fold(DMatrix::zeros(c, c), |sum, weight| sum + weight);
        inverse(&sum)
    }
}
