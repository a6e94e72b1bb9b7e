//! Least squares for the comparison of estimators: the same fit with one segment left out at a time.

use super::fitted::Fitted;
use super::linear::{classical, least_squares, spread, triangle};
use super::problem::Problem;
use crate::error::IdentifyError;
use crate::uncertainty::jackknife::LeaveOut;
use crate::uncertainty::parts::Parts;

/// Fits by least squares with the equations weighted by `weights`.
pub(crate) fn least(
    problem: &Problem,
    parts: &Parts,
    weights: &[f64],
) -> Result<Fitted, IdentifyError> {
    from_factors(problem, &LeaveOut::of(&parts.weighted(weights)))
}

/// Fits by least squares on factors whose rows are already weighted.
pub(crate) fn from_factors(problem: &Problem, factors: &LeaveOut) -> Result<Fitted, IdentifyError> {
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
