//! Effects beyond the description in an identification.

use super::beyond::Beyond;
use super::search::beyond;
use super::together::{Together, together};
use crate::bodies::fit_prior::prior;
use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;

/// Finds effects beyond the description. The prior is always the description, for every estimator: without it,
/// position-dependent torques are collinear with inertia. `factors` are those of the fitted equations.
pub(crate) fn beyond_description(
    problem: &Problem,
    factors: &[TriangularFactor],
) -> Result<Beyond, IdentifyError> {
    if problem.options.look_beyond && problem.robot.joints.len() > 1 {
        beyond(problem, factors, &prior(problem))
    } else {
        Ok(Beyond::default())
    }
}

/// Refits the found terms together with all parameters; `described` is the described gravity.
pub(crate) fn together_with(
    problem: &Problem,
    factors: &[TriangularFactor],
    known: &Beyond,
    described: [f64; 3],
) -> Result<Together, IdentifyError> {
    together(problem, factors, &prior(problem), known, described)
}
