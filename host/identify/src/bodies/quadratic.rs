//! Accumulated rows as a quadratic function of standard parameters.

use nalgebra::{DMatrix, DVector};

use crate::rows::factor::TriangularFactor;
use crate::structure::base::Base;

/// Data as ½‖matrix·π − right‖², in units of the residual's noise.
#[derive(Clone, Debug)]
pub(crate) struct Quadratic {
    /// R·K, with at most as many rows as standard columns.
    pub matrix: DMatrix<f64>,
    /// z.
    pub right: DVector<f64>,
}

/// Builds the problem from a factor whose rows are in units of the residual's noise.
pub(crate) fn quadratic(factor: &TriangularFactor, base: &Base) -> Quadratic {
    let (r, right) = factor.system();
    Quadratic {
        matrix: r * &base.combination,
        right,
    }
}

/// The same for a given estimate of all base columns instead of the data's own optimum.
pub(crate) fn quadratic_about(factor: &TriangularFactor, base: &Base, full: &[f64]) -> Quadratic {
    let (r, _) = factor.system();
    let right = &r * DVector::from_column_slice(full);
    Quadratic {
        matrix: r * &base.combination,
        right,
    }
}
