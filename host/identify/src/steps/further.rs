//! Results beyond least squares: the other estimators, the essential and the physically consistent parameters, the
//! comparison.

use nalgebra::DMatrix;

use super::larger_residual::larger_residual;
use super::outcome::Outcome;
use super::own::Own;
use crate::bodies::consistent::consistent;
use crate::bodies::fit_prior::prior_beside;
use crate::bodies::prior::Prior;
use crate::bodies::quadratic::{quadratic, quadratic_about};
use crate::bodies::standard::{Judges, StandardSet, standard_set};
use crate::comparison::compare::compare;
use crate::comparison::compared::Comparison;
use crate::comparison::held::Held;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::estimators::linear::{classical, spread};
use crate::estimators::problem::Problem;
use crate::options::ModelKind;
use crate::rows::factor::TriangularFactor;
use crate::rows::planned::Planned;
use crate::structure::essential::{EssentialSet, Known, essential};
use crate::structure::excitation::{NotExcited, hardly_excited};
use crate::uncertainty::parts::Parts;
use crate::uncertainty::relative_error::judge;
use crate::warning::Warning;

/// Half width of the interval that holds 95 % of a normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;

/// Results beside the estimate.
#[derive(Default)]
pub(crate) struct Further {
    pub essential: Option<EssentialSet>,
    pub standard: Option<StandardSet>,
    pub comparison: Option<Comparison>,
    pub hardly_excited: Vec<NotExcited>,
    /// [`crate::Details::free`].
    pub free: Vec<[f64; 3]>,
    pub procedure: Vec<String>,
    pub warnings: Vec<Warning>,
}

/// Computes all further results.
///
/// # Errors
/// [`IdentifyError`]: reading errors, a singular problem.
pub(crate) fn further(
    problem: &Problem,
    own: Option<Own>,
    result: &Outcome,
    holdout: &[Planned],
) -> Result<Further, IdentifyError> {
    let names: Vec<(String, String)> = result
        .parameters
        .iter()
        .map(|p| (p.expression.clone(), p.unit.clone()))
        .collect();
    let mut further = Further {
        essential: essential_of(problem, own.as_ref(), result, &names),
        ..Further::default()
    };
    let several = problem.robot.joints.len() > 1;
    let wanted = several
        || matches!(
            problem.options.estimator,
            Estimator::Consistent | Estimator::Ridge
        );
    let compared = !problem.options.compare.is_empty();
    let held = if wanted || compared {
        Held::of(problem, holdout)?
    } else {
        None
    };
    let memory = result.estimate.memory_rows;
    let tempered = combined(problem, result, &|k| {
        1.0 / result.memory.get(k).unwrap_or(&memory).sqrt()
    });
    let prior = prior_beside(problem, &tempered);
    further.free = free_values(problem, &tempered)?;
    if several {
        further.hardly_excited =
            hardly_excited(problem.base, problem.data, &prior, &tempered, &names);
    }
    if wanted {
        match consistent_values(problem, own.as_ref(), result, &prior, &tempered) {
            Ok(found) => {
                let set = judged_set(problem, result, &prior, &found, held.as_ref())?;
                further.standard = Some(set);
            }
            Err(e) => further.warnings.push(Warning::Inconsistent(e.to_string())),
        }
    }
    if compared {
        let collected;
        let parts = match &own {
            Some(own) => &own.parts,
            None => {
                collected = Parts::collect(problem)?;
                &collected
            }
        };
        let names: Vec<String> = names.iter().map(|(name, _)| name.clone()).collect();
        let measured = result.measured.as_ref();
        let comparison = compare(problem, parts, &prior, held.as_ref(), &names, measured)?;
        further.comparison = Some(comparison);
    }
    if let Some(own) = own {
        let larger = larger_residual(problem, result, further.comparison.as_ref());
        further.warnings.extend(larger);
        further.procedure = own.fitted.said;
        further.warnings.extend(own.fitted.warnings);
    }
    Ok(further)
}

/// Returns all rows, those of equation k with its weight times `scale(k)`.
fn combined(problem: &Problem, result: &Outcome, scale: &dyn Fn(usize) -> f64) -> TriangularFactor {
    let mut all = TriangularFactor::new(problem.base.len());
    for (k, (factor, weight)) in result.factors.iter().zip(problem.weights).enumerate() {
        all.merge(factor, weight * scale(k));
    }
    all
}

/// Returns the essential parameters; none if the fit is singular.
fn essential_of(
    problem: &Problem,
    own: Option<&Own>,
    result: &Outcome,
    names: &[(String, String)],
) -> Option<EssentialSet> {
    let (base, data) = (problem.base, problem.data);
    let memory = result.estimate.memory_rows;
    let weighted = combined(problem, result, &|_| 1.0);
    let known = match own {
        None => Known::of_rows(&weighted, &data.kept, memory),
        // The jackknife covariance of sixteen segments has no inverse, so the rows give the uncertainty of each value.
        Some(own) => match &own.fitted.covariance {
            Some(_) => {
                let estimate = result.estimate;
                let size = estimate.values.len();
                let covariance = DMatrix::from_fn(size, size, |i, j| estimate.covariance[i][j]);
                Known::of_estimate(&estimate.values, &covariance, estimate.effective_rows)
            }
            None => Known::about(&result.estimate.values, &weighted, &data.kept, memory),
        },
    };
    let left = |values: &[f64]| {
        weighted
            .residual_squares(&spread(values, &data.kept, base.len()))
            .sqrt()
    };
    known.and_then(|known| essential(&known, names, &left))
}

/// Returns the values of the weighted fit, without a prior, each with its 95 % interval.
fn free_values(
    problem: &Problem,
    tempered: &TriangularFactor,
) -> Result<Vec<[f64; 3]>, IdentifyError> {
    let (std, _) = classical(tempered, problem.data, problem.start)?;
    Ok((problem.start.iter().zip(&std))
        .map(|(value, std)| [*value, value - NORMAL_95 * std, value + NORMAL_95 * std])
        .collect())
}

/// Returns physically consistent standard parameters: those of the estimator, or the ones nearest to its estimate.
fn consistent_values(
    problem: &Problem,
    own: Option<&Own>,
    result: &Outcome,
    prior: &Prior,
    tempered: &TriangularFactor,
) -> Result<Vec<f64>, IdentifyError> {
    let estimator = problem.options.estimator;
    match own.and_then(|o| o.fitted.standard.as_ref()) {
        Some(standard) if estimator == Estimator::Consistent => Ok(standard.clone()),
        _ => {
            let problem = match estimator {
                // The rows also carry a little information about unexcited parameters.
                Estimator::Ols | Estimator::Weighted => quadratic(tempered, problem.base),
                _ => quadratic_about(tempered, problem.base, result.full),
            };
            consistent(&problem, prior).map(|found| found.parameters)
        }
    }
}

/// Reports consistent parameters with their errors on training data and hold-out.
fn judged_set(
    problem: &Problem,
    result: &Outcome,
    prior: &Prior,
    found: &[f64],
    held: Option<&Held>,
) -> Result<StandardSet, IdentifyError> {
    let of_momentum = match problem.options.model {
        ModelKind::Differential => None,
        ModelKind::Integral => judge(problem, &Planned::all(problem.training, problem.plan))?,
    };
    Ok(standard_set(
        problem,
        prior,
        found,
        &Judges {
            fitted: result.factors,
            training: of_momentum.as_deref().unwrap_or(result.factors),
            holdout: held.map(|held| held.all.as_slice()),
            measured: result.measured.as_ref(),
        },
    ))
}
