//! An estimate with what the further results need of it.

use crate::identification::BaseParameter;
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::estimate::Estimate;

/// The estimate, its values of all base columns and its equations.
pub(crate) struct Outcome<'a> {
    /// The estimate.
    pub estimate: &'a Estimate,
    /// Values of all base columns.
    pub full: &'a [f64],
    /// By equation, unweighted rows.
    pub factors: &'a [TriangularFactor],
    /// By equation, correlation time of the residual in rows.
    pub memory: Vec<f64>,
    /// The identified parameters.
    pub parameters: &'a [BaseParameter],
    /// RMS torques of training data and hold-out per joint, if effects were subtracted from the rows.
    pub measured: Option<[Vec<f64>; 2]>,
}
