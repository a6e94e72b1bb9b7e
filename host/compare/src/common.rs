//! The parameters that every set shows, with weights for the tests over all of them.

use nalgebra::{DMatrix, DVector};

use crate::basis::Basis;
use crate::error::CompareError;
use crate::identified_set::IdentifiedSet;
use crate::matrices::{inverse, quadratic};

/// What every set shows.
pub(crate) struct Common {
    /// Indices of the parameters.
    pub parameters: Vec<usize>,
    /// By set, their values.
    pub values: Vec<DVector<f64>>,
    /// By set, the inverse of their covariance.
    pub weights: Vec<DMatrix<f64>>,
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
        })
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
