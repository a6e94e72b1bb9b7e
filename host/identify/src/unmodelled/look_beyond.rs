//! Effects beyond the description in an identification.

use nalgebra::DMatrix;

use super::beyond::Beyond;
use super::search::beyond;
use super::together::together;
use crate::bodies::fit_prior::prior;
use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;

/// The outcome of a look beyond the description.
pub(crate) enum Look {
    /// Effects with which the identification starts again.
    Anew(Beyond),
    /// Settled effects, and the covariance of all base columns that their uncertainty adds.
    Settled(Beyond, Option<DMatrix<f64>>),
}

/// Finds effects beyond the description, or refits those `added` before together with all parameters. `factors` are
/// those of the fitted equations, `described` is the described gravity.
pub(crate) fn look(
    problem: &Problem,
    factors: &[TriangularFactor],
    added: Option<&Beyond>,
    described: [f64; 3],
) -> Result<Look, IdentifyError> {
    let Some(known) = added else {
        let found = beyond_description(problem, factors)?;
        return Ok(if found.is_empty() {
            Look::Settled(found, None)
        } else {
            Look::Anew(found)
        });
    };
    let found = together(problem, factors, &prior(problem), known, described)?;
    Ok(if found.settled {
        Look::Settled(found.terms, Some(found.beside))
    } else {
        Look::Anew(found.terms)
    })
}

/// Finds effects beyond the description. The prior is always the description, for every estimator: without it,
/// position-dependent torques are collinear with inertia. `factors` are those of the fitted equations.
fn beyond_description(
    problem: &Problem,
    factors: &[TriangularFactor],
) -> Result<Beyond, IdentifyError> {
    if problem.options.look_beyond && problem.robot.joints.len() > 1 {
        beyond(problem, factors, &prior(problem))
    } else {
        Ok(Beyond::default())
    }
}
