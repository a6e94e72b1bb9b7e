//! Base parameters with their values.

use nalgebra::DMatrix;

/// Base parameters and their combinations.
pub struct Combinations<'a> {
    /// Base parameters as combinations of standard parameters.
    pub combination: &'a DMatrix<f64>,
    /// Column of the standard regressor that names each parameter.
    pub columns: &'a [usize],
    /// Values, SI.
    pub values: &'a [f64],
}
