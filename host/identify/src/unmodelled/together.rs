//! Joint refit of all parameters and of effects beyond the description.

use nalgebra::DMatrix;

use super::beyond::{Beyond, with_values};
use super::term_rows::Evidence;
use super::terms::Term;
use crate::bodies::consistent::consistent;
use crate::bodies::prior::Prior;
use crate::error::{IdentifyError, singular};
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;

/// Share of a term's standard deviation below which a change of it is ignored.
const SETTLED: f64 = 0.25;

/// Joint refit of terms and parameters.
pub(crate) struct Together {
    /// The known terms with their standard deviations. Values change only if the change exceeds their own uncertainty.
    pub terms: Beyond,
    /// True if no term changed by more than [`SETTLED`].
    pub settled: bool,
    /// Contribution of the terms' uncertainty to the covariance of all base columns.
    pub beside: DMatrix<f64>,
}

/// Refits the terms `known`, whose torques are subtracted from the rows, together with all parameters. A tilted robot
/// has different base parameters, and the masses on which a tilt acts are known better once the tilt is subtracted:
/// hence the second fit. `described` is the described gravity.
pub(crate) fn together(
    problem: &Problem,
    factors: &[TriangularFactor],
    prior: &Prior,
    known: &Beyond,
    described: [f64; 3],
) -> Result<Together, IdentifyError> {
    let data = Evidence::collect(problem, factors, prior, described)?;
    let (terms, before) = known.terms(problem.robot);
    let list: Vec<Term> = terms.iter().map(|(term, _)| *term).collect();
    let mut sizes = Vec::new();
    for term in &list {
        let own = &before[sizes.len()..sizes.len() + term.columns().len()];
        sizes.extend(
            data.sizes(*term)
                .unwrap_or_else(|| own.iter().map(|v| v.abs()).collect()),
        );
    }
    let base = &problem.base.combination;
    let (p, standard) = base.shape();
    let more = sizes.len();
    let mut combination = base.clone().resize(p + more, standard + more, 0.0);
    combination
        .view_range_mut(p.., standard..)
        .fill_with_identity();
    let prior = prior.with_free(&sizes);
    let found = consistent(&data.joined(&list).quadratic(&combination), &prior)?;
    let along = prior.own(&combination) * found.spread;
    let covariance = &along * along.transpose();
    let own = covariance.view_range(p.., p..).into_owned();
    let across = covariance.view_range(..p, p..).into_owned();
    let Some(inverse) = own.clone().cholesky() else {
        return Err(singular("of what the description does not state"));
    };
    let beside = &across * inverse.solve(&across.transpose());
    let steps = &found.parameters[standard..];
    let settled = steps
        .iter()
        .enumerate()
        .all(|(k, step)| step.abs() <= SETTLED * own[(k, k)].sqrt());
    let after: Vec<f64> = if settled {
        before
    } else {
        before.iter().zip(steps).map(|(v, step)| v + step).collect()
    };
    Ok(Together {
        terms: with_values(problem, &terms, &after, &own, described)?,
        settled,
        beside,
    })
}
