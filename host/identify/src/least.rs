//! Least squares as a member of the family: the same fit with one stretch left out at a time, for comparison.

use nalgebra::DMatrix;

use super::IdentifyError;
use super::base::Independent;
use super::factor::TriangularFactor;
use super::linear::{classical, kept_columns, least_squares, spread};
use super::parts::{LeaveOut, Parts};
use super::problem::{Fitted, Problem};

/// Least squares with the equations at `weights`.
pub(super) fn least(
    problem: &Problem,
    parts: &Parts,
    weights: &[f64],
) -> Result<Fitted, IdentifyError> {
    from_factors(problem, &LeaveOut::of(&parts.weighted(weights)))
}

/// Least squares on factors whose rows are as they are to count.
pub(super) fn from_factors(problem: &Problem, factors: &LeaveOut) -> Result<Fitted, IdentifyError> {
    let (data, base) = (problem.data, problem.base);
    let kept = factors.refit(&|factor| least_squares(factor, data, base))?;
    let (classical_std, _) = classical(&factors.whole, data, &kept.whole)?;
    Ok(Fitted {
        full: kept.map(&|values| spread(values, &data.kept, base.len())),
        kept,
        standard: None,
        classical_std,
        covariance: None,
        regressor: triangle(&factors.whole, data),
        said: Vec::new(),
        warnings: Vec::new(),
        doubtful: None,
    })
}

/// Triangular factor of the kept columns alone.
pub(super) fn triangle(factor: &TriangularFactor, data: &Independent) -> DMatrix<f64> {
    kept_columns(factor, data).0.qr().r()
}
