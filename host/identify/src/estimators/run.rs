//! The estimators by name.

use super::consistent_fit::consistent_fit;
use super::fitted::Fitted;
use super::instrumental::instrumental;
use super::least::least;
use super::likelihood::likelihood;
use super::output_error::output_error;
use super::problem::Problem;
use super::ridge::ridge;
use super::robust::robust;
use super::total::total;
use crate::bodies::prior::Prior;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::uncertainty::parts::Parts;

/// Runs one estimator.
pub(crate) fn fit(
    estimator: Estimator,
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    match estimator {
        Estimator::Ols => least(problem, parts, &vec![1.0; problem.weights.len()]),
        Estimator::Weighted => least(problem, parts, problem.weights),
        Estimator::Robust => robust(problem, parts),
        Estimator::Iv => instrumental(problem, parts, prior),
        Estimator::OutputError => output_error(problem, parts, prior),
        Estimator::Tls => total(problem, parts),
        Estimator::Ml => likelihood(problem, parts),
        Estimator::Ridge => ridge(problem, parts, prior),
        Estimator::Consistent => consistent_fit(problem, parts, prior),
    }
}
