//! Results beyond least squares: the other estimators, the essential and the physically consistent parameters, the
//! comparison.

use nalgebra::DMatrix;

use super::own::Own;
use crate::bodies::consistent::consistent;
use crate::bodies::fit_prior::prior_beside;
use crate::bodies::quadratic::{quadratic, quadratic_about};
use crate::bodies::standard::{Judges, StandardSet, standard_set};
use crate::comparison::compare::compare;
use crate::comparison::compared::Comparison;
use crate::comparison::held::Held;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::estimators::linear::{classical, spread};
use crate::estimators::problem::Problem;
use crate::identification::BaseParameter;
use crate::options::ModelKind;
use crate::rows::factor::TriangularFactor;
use crate::rows::planned::Planned;
use crate::structure::essential::{EssentialSet, Known, essential};
use crate::structure::excitation::{NotExcited, hardly_excited};
use crate::uncertainty::covariance::Estimate;
use crate::uncertainty::parts::Parts;
use crate::uncertainty::relative_error::judge;

/// Half width of the interval that holds 95 % of a normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;
/// Ratio of a residual to that of the weighted fit above which a warning is given.
const MUCH_MORE: f64 = 1.2;

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
    pub warnings: Vec<String>,
}

/// The estimate, its values of all base columns and its equations.
pub(crate) struct Outcome<'a> {
    pub estimate: &'a Estimate,
    pub full: &'a [f64],
    /// By equation, unweighted rows.
    pub factors: &'a [TriangularFactor],
    /// By equation, correlation time of the residual in rows.
    pub memory: Vec<f64>,
    pub parameters: &'a [BaseParameter],
    /// RMS torques of training data and hold-out per joint, if effects were subtracted from the rows.
    pub measured: Option<[Vec<f64>; 2]>,
}

/// Explains a much larger residual than that of the weighted fit; `trusted` if the comparison recommends the estimator.
fn what_it_means(estimator: Estimator, trusted: bool) -> &'static str {
    match estimator {
        Estimator::Consistent => {
            "The weighted fit is free to follow what the model lacks with values that no body has, and another motion need not bear them out."
        }
        Estimator::Ridge => {
            "The weighted fit is free to follow what the model lacks with values far from the description's, and another motion need not bear them out."
        }
        _ if trusted => "Noise in the motion hides as much from the weighted fit.",
        _ => {
            "What it assumes of the noise does not hold here, so do not take its values for better ones."
        }
    }
}

/// Computes all further results.
pub(crate) fn further(
    problem: &Problem,
    own: Option<Own>,
    result: &Outcome,
    holdout: &[Planned],
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
    let weighted = combine(&|_| 1.0);
    let known = match &own {
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
    further.essential = known.and_then(|known| essential(&known, &names, &left));
    let estimator = problem.options.estimator;
    let wanted = problem.robot.joints.len() > 1
        || matches!(estimator, Estimator::Consistent | Estimator::Ridge);
    let compared = !problem.options.compare.is_empty();
    let held = if wanted || compared {
        Held::of(problem, holdout)?
    } else {
        None
    };
    let tempered = combine(&|k| 1.0 / result.memory.get(k).unwrap_or(&memory).sqrt());
    let prior = prior_beside(problem, &tempered);
    let (std, _) = classical(&tempered, data, problem.start)?;
    further.free = (problem.start.iter().zip(&std))
        .map(|(value, std)| [*value, value - NORMAL_95 * std, value + NORMAL_95 * std])
        .collect();
    if problem.robot.joints.len() > 1 {
        further.hardly_excited = hardly_excited(base, data, &prior, &tempered, &names);
    }
    if wanted {
        let found = match own.as_ref().and_then(|o| o.fitted.standard.as_ref()) {
            Some(standard) if estimator == Estimator::Consistent => Ok(standard.clone()),
            _ => {
                let problem = match estimator {
                    // The rows also carry a little information about unexcited parameters.
                    Estimator::Ols | Estimator::Weighted => quadratic(&tempered, base),
                    _ => quadratic_about(&tempered, base, result.full),
                };
                consistent(&problem, &prior).map(|found| found.parameters)
            }
        };
        match found {
            Ok(found) => {
                let of_momentum = match problem.options.model {
                    ModelKind::Differential => None,
                    ModelKind::Integral => {
                        judge(problem, &Planned::all(problem.training, problem.plan))?
                    }
                };
                further.standard = Some(standard_set(
                    problem,
                    &prior,
                    &found,
                    &Judges {
                        fitted: result.factors,
                        training: of_momentum.as_deref().unwrap_or(result.factors),
                        holdout: held.as_ref().map(|held| held.all.as_slice()),
                        measured: result.measured.as_ref(),
                    },
                ));
            }
            Err(e) => further.warnings.push(format!(
                "No physically consistent set of standard parameters is given: {e}"
            )),
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
        further.comparison = Some(compare(
            problem,
            parts,
            &prior,
            held.as_ref(),
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
        let mut more: Vec<String> = Vec::new();
        for (k, (own, plain)) in squares(result.full).iter().zip(squares(&plain)).enumerate() {
            if *own > MUCH_MORE * plain {
                let joint = problem.robot.joints.get(k).map_or("", |j| j.name.as_str());
                more.push(format!("{:.1} times at joint {joint}", own / plain));
            }
        }
        if !more.is_empty() {
            let trusted = further
                .comparison
                .as_ref()
                .is_some_and(|compared| compared.recommended == estimator);
            further.warnings.push(format!(
                "On the training data {} leaves more than the weighted fit: {}. {}",
                estimator.name(),
                more.join(", "),
                what_it_means(estimator, trusted)
            ));
        }
        further.procedure = own.fitted.said;
        further.warnings.extend(own.fitted.warnings);
    }
    Ok(further)
}
