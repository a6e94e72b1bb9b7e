//! A fit's data for cross-validation, fold by fold.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

/// The basis, fold by fold.
#[derive(Clone)]
pub(crate) struct Folded {
    /// Ranges of the weighted rows within one fold, with the fold.
    pub(crate) stretches: Vec<(Range<usize>, usize)>,
    /// Inner products of the basis within each fold.
    pub(crate) own: Vec<DMatrix<f64>>,
    /// … and of the basis with the residual.
    pub(crate) right: Vec<DVector<f64>>,
    /// Squared error of each block and of each joint, with a basis refitted without the block's fold.
    pub(crate) errors: Errors,
}

/// Squared errors on folds outside the fit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Errors {
    /// Block by block.
    pub(crate) of_block: Vec<f64>,
    /// Joint by joint.
    pub(crate) of_joint: Vec<f64>,
}
