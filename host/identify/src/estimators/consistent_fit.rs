//! Least squares under the constraint of physical consistency.

use nalgebra::DVector;

use super::fitted::Fitted;
use super::linear::triangle;
use super::problem::Problem;
use crate::bodies::consistent::{Consistent, consistent};
use crate::bodies::prior::Prior;
use crate::bodies::quadratic::quadratic;
use crate::error::IdentifyError;
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::jackknife::LeaveOut;
use crate::uncertainty::parts::Parts;
use rig_model::robot::DESCRIBED;
use rig_output::format_significant;

/// Fits under the constraint of physical consistency.
pub(crate) fn consistent_fit(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    let all = LeaveOut::of(&parts.weighted(&parts.tempered(problem.weights)));
    let fit = |factor: &TriangularFactor| -> Result<Consistent, IdentifyError> {
        consistent(&quadratic(factor, problem.base), prior)
    };
    let whole = fit(&all.whole)?;
    let standard = all.refit(&|factor| Ok(fit(factor)?.parameters))?;
    let full = standard.map(&|pi| {
        (&problem.base.combination * DVector::from_column_slice(pi))
            .as_slice()
            .to_vec()
    });
    let kept = full.map(&|values| problem.identified(values));
    let regressor = triangle(&all.whole, problem.data);
    let along = prior.own(&problem.base.combination) * whole.spread;
    let covariance = &along * along.transpose();
    let identified = problem.identified_covariance(&covariance);
    Ok(Fitted {
        classical_std: (0..kept.whole.len())
            .map(|k| identified[(k, k)].max(0.0).sqrt())
            .collect(),
        standard: Some(whole.parameters),
        full,
        kept,
        covariance: Some(covariance),
        regressor,
        said: vec![format!(
            "Convex problem solved in {} Newton steps. Intervals are those of the posterior: the description's inertial values count as right to {} times their size.",
            whole.steps,
            format_significant(problem.options.prior_uncertainty.unwrap_or(DESCRIBED), 2)
        )],
        warnings: Vec::new(),
        doubtful: None,
    })
}
