//! The fit of an estimator beyond least squares.

use nalgebra::DMatrix;

use crate::bodies::fit_prior::prior_beside;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::estimators::fitted::Fitted;
use crate::estimators::problem::Problem;
use crate::estimators::run::fit;
use crate::uncertainty::estimate::Estimate;
use crate::uncertainty::jackknife::LeaveOut;
use crate::uncertainty::parts::Parts;

/// The fit of an estimator other than the three least squares.
pub(crate) struct Own {
    /// Values of all base columns and the other results.
    pub fitted: Fitted,
    /// The estimate.
    pub estimate: Estimate,
    /// The segments of the training data.
    pub parts: Parts,
}

/// Fits with the requested estimator; `None` if it is one of the three least squares. `beside` is the covariance added
/// by terms beyond the description.
pub(crate) fn own(
    problem: &Problem,
    beside: Option<&DMatrix<f64>>,
) -> Result<Option<Own>, IdentifyError> {
    let estimator = problem.options.estimator;
    if matches!(
        estimator,
        Estimator::Ols | Estimator::Weighted | Estimator::Robust
    ) {
        return Ok(None);
    }
    let parts = Parts::collect(problem)?;
    let all = LeaveOut::of(&parts.weighted(&parts.tempered(problem.weights)));
    let fitted = fit(
        estimator,
        problem,
        &parts,
        &prior_beside(problem, &all.whole),
    )?;
    Ok(Some(Own {
        estimate: fitted.estimate(&parts, problem, beside),
        fitted,
        parts,
    }))
}
