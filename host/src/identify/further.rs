//! What an identification holds beyond least squares: the other estimators, the essential and the physically
//! consistent parameters, the comparison.

use super::beyond::{Beyond, beyond};
use super::compare::{Comparison, compare, fit};
use super::consistent::consistent;
use super::covariance::Estimate;
use super::essential::{EssentialSet, essential};
use super::excitation::hardly_excited;
use super::factor::TriangularFactor;
use super::parts::Parts;
use super::prior::Prior;
use super::problem::{Fitted, Problem};
use super::standard::{StandardSet, prior_of, quadratic, quadratic_about, standard_set};
use super::{BaseParameter, Estimator, IdentifyError, NotExcited, Options};
use crate::prepare::Recording;

/// A residual that is so many times that of the weighted fit calls for a warning.
const MUCH_MORE: f64 = 1.2;

/// Refuses settings that mean nothing.
pub(super) fn check(options: &Options) -> Result<(), IdentifyError> {
    if let Some(&weight) = options
        .recording_weights
        .iter()
        .find(|w| !(w.is_finite() && **w > 0.0))
    {
        return Err(IdentifyError::Weight(weight));
    }
    match options.prior_uncertainty {
        Some(u) if !(u.is_finite() && u > 0.0) => Err(IdentifyError::PriorUncertainty(u)),
        _ => Ok(()),
    }
}

/// The fit of an estimator beyond the three least squares.
pub(super) struct Own {
    /// Values of all base columns and more.
    pub fitted: Fitted,
    /// The estimate.
    pub estimate: Estimate,
    parts: Parts,
}

/// Fits with the estimator asked for; `None` where that is one of the three least squares.
pub(super) fn own(problem: &Problem) -> Result<Option<Own>, IdentifyError> {
    let estimator = problem.options.estimator;
    if matches!(
        estimator,
        Estimator::Ols | Estimator::Weighted | Estimator::Robust
    ) {
        return Ok(None);
    }
    let parts = Parts::collect(problem)?;
    let fitted = fit(estimator, problem, &parts, &prior(problem))?;
    Ok(Some(Own {
        estimate: fitted.estimate(&parts),
        fitted,
        parts,
    }))
}

/// What the data show beyond the description, where the estimator has it as its prior: without that, torques with position
/// cannot be told from inertia. `factors` are those of the fitted equations.
pub(super) fn beyond_description(
    problem: &Problem,
    factors: &[TriangularFactor],
) -> Result<Beyond, IdentifyError> {
    match problem.options.estimator {
        Estimator::Ridge | Estimator::Consistent if problem.robot.joints.len() > 1 => {
            beyond(problem, factors, &prior(problem))
        }
        _ => Ok(Beyond::default()),
    }
}

fn prior(problem: &Problem) -> Prior {
    prior_of(
        problem.robot,
        problem.base,
        problem.surveys,
        &problem.start_full(),
        problem.options.prior_uncertainty,
    )
}

/// What stands beside the estimate.
#[derive(Default)]
pub(super) struct Further {
    pub essential: Option<EssentialSet>,
    pub standard: Option<StandardSet>,
    pub comparison: Option<Comparison>,
    pub hardly_excited: Vec<NotExcited>,
    pub procedure: Vec<String>,
    pub warnings: Vec<String>,
}

/// Base columns whose values the estimate gives, its equations and itself.
pub(super) struct Outcome<'a> {
    pub estimate: &'a Estimate,
    pub full: &'a [f64],
    /// By equation, rows unweighted.
    pub factors: &'a [TriangularFactor],
    /// By equation, rows that the residual remembers.
    pub memory: Vec<f64>,
    pub parameters: &'a [BaseParameter],
    /// RMS torques of training data and hold-out by joint, where torques with position were taken off the rows.
    pub measured: Option<[Vec<f64>; 2]>,
}

/// Computes it.
pub(super) fn further(
    problem: &Problem,
    own: Option<Own>,
    result: &Outcome,
    holdout: &[&dyn Recording],
) -> Result<Further, IdentifyError> {
    let Problem { base, data, .. } = *problem;
    let mut further = Further::default();
    let memory = result.estimate.memory_rows;
    let combine = |scale: &dyn Fn(usize) -> f64| {
        let mut all = TriangularFactor::new(base.len());
        for (k, (factor, weight)) in result.factors.iter().zip(problem.weights).enumerate() {
            all.merge(factor, weight * scale(k));
        }
        all
    };
    let names: Vec<(String, String)> = result
        .parameters
        .iter()
        .map(|p| (p.expression.clone(), p.unit.clone()))
        .collect();
    further.essential = essential(&combine(&|_| 1.0), &data.kept, memory, &names);
    let prior = prior(problem);
    let estimator = problem.options.estimator;
    let wanted = problem.robot.joints.len() > 1
        || matches!(estimator, Estimator::Consistent | Estimator::Ridge);
    let tempered = combine(&|k| 1.0 / result.memory.get(k).unwrap_or(&memory).sqrt());
    if problem.robot.joints.len() > 1 {
        further.hardly_excited = hardly_excited(base, data, &prior, &tempered, &names);
    }
    if wanted {
        let found = match own.as_ref().and_then(|o| o.fitted.standard.as_ref()) {
            Some(standard) if estimator == Estimator::Consistent => Ok(standard.clone()),
            _ => {
                let problem = match estimator {
                    // Rows know a little of what counts as not excited, too.
                    Estimator::Ols | Estimator::Weighted => quadratic(&tempered, base),
                    _ => quadratic_about(&tempered, base, result.full),
                };
                consistent(&problem, &prior).map(|found| found.parameters)
            }
        };
        match found {
            Ok(found) => {
                further.standard = Some(standard_set(
                    problem.robot,
                    base,
                    data,
                    &prior,
                    &found,
                    result.factors,
                    &problem.start_full(),
                ));
            }
            Err(e) => further.warnings.push(format!(
                "No physically consistent set of standard parameters is given: {e}"
            )),
        }
    }
    if !problem.options.compare.is_empty() {
        let collected;
        let parts = match &own {
            Some(own) => &own.parts,
            None => {
                collected = Parts::collect(problem)?;
                &collected
            }
        };
        let names: Vec<String> = names.iter().map(|(name, _)| name.clone()).collect();
        further.comparison = Some(compare(
            problem,
            parts,
            &prior,
            holdout,
            &problem.options.compare,
            &names,
            result.measured.as_ref(),
        )?);
    }
    if let Some(own) = own {
        let plain = problem.start_full();
        let squares = |full: &[f64]| -> Vec<f64> {
            result
                .factors
                .iter()
                .map(|f| f.residual_squares(full).sqrt())
                .collect()
        };
        for (k, (own, plain)) in squares(result.full).iter().zip(squares(&plain)).enumerate() {
            if *own > MUCH_MORE * plain {
                let joint = problem.robot.joints.get(k).map_or("", |j| j.name.as_str());
                further.warnings.push(format!(
                    "Joint {joint}: this estimator leaves {:.1} times the residual of the weighted fit; what it assumes of the noise does not hold here, so do not take its values for better ones.",
                    own / plain
                ));
            }
        }
        further.procedure = own.fitted.said;
        further.warnings.extend(own.fitted.warnings);
    }
    Ok(further)
}
