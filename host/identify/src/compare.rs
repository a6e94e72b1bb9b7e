//! Comparison of estimators by the same criteria, and the recommended result.

use rig_model::robot::Robot;
use serde::Serialize;

use super::consistent::consistent;
use super::endogeneity::{Endogeneity, endogeneity};
use super::evaluate::Planned;
use super::factor::TriangularFactor;
use super::instrumental::instrumental;
use super::least::least;
use super::likelihood::likelihood;
use super::output_error::output_error;
use super::parts::{LeaveOut, Parts};
use super::prior::Prior;
use super::problem::{Fitted, Problem};
use super::recommend::{Judge, recommend};
use super::repeat::Path;
use super::ridge::ridge;
use super::robust::robust;
use super::standard::{consistent_fit, quadratic_about};
use super::total::total;
use super::{Estimator, IdentifyError};
use rig_data::prepare::Recording;

/// Distance to the nearest consistent set below which a set counts as consistent, in standard deviations of all
/// parameters together. Not zero, because the barrier keeps the solution slightly inside.
const AT_THE_SET: f64 = 1.0;
/// Factor on the prior's pull when the distance to the consistent set is measured.
const PULL_OF_DISTANCE: f64 = 1e-4;

/// The result of one estimator.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Estimator.
    pub estimator: Estimator,
    /// Per joint, RMS of the residual over RMS of the torque, with every time segment predicted from the others. Null
    /// for a joint without usable torque, and altogether if the estimator failed.
    pub cross_validated_relative_error: Option<Vec<f64>>,
    /// The same on the hold-out, if given.
    pub holdout_relative_error: Option<Vec<f64>>,
    /// Distance of the estimate from the nearest physically consistent one, in standard deviations of all parameters
    /// together.
    pub distance_to_consistent: Option<f64>,
    /// True if that distance is negligible.
    pub physically_consistent: Option<bool>,
    /// Largest difference from the weighted fit over all parameters, in standard deviations of that fit.
    pub largest_shift: Option<f64>,
    /// Values in the order of `base_parameters`.
    pub values: Option<Vec<f64>>,
    /// Remarks on the fit, or the reason of its failure.
    pub said: Vec<String>,
}

/// Results of all estimators and the recommendation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Number of cross-validation segments.
    pub folds: usize,
    /// Hold-out recordings that repeat a training motion, so they do not test the prediction of another motion.
    pub repeated_holdout: Vec<String>,
    /// One entry per estimator.
    pub estimators: Vec<Compared>,
    /// Durbin–Wu–Hausman test; absent if instrumental variables failed.
    pub endogeneity: Option<Endogeneity>,
    /// The recommended estimator.
    pub recommended: Estimator,
    /// The recommendation and its reason.
    pub recommendation: String,
}

/// Runs one estimator.
pub(super) fn fit(
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

/// Returns, per joint, the RMS residual of `full` on the rows of `factors` over the RMS torque. Uses the torque `whole`
/// if the rows do not contain all of the torque.
pub(super) fn relative_errors(
    factors: &[TriangularFactor],
    full: &[f64],
    whole: Option<&[f64]>,
) -> Vec<f64> {
    let one = |(j, factor): (usize, &TriangularFactor)| {
        if factor.rows() == 0 {
            return f64::NAN;
        }
        let rows = factor.rows() as f64;
        let torque = whole.map_or_else(
            || (factor.right_side_squares() / rows).sqrt(),
            |torque| torque[j],
        );
        (factor.residual_squares(full) / rows).sqrt() / torque.max(f64::MIN_POSITIVE)
    };
    factors.iter().enumerate().map(one).collect()
}

/// Returns one factor per joint of the hold-out, torque against motion; none for an empty hold-out.
pub(super) fn judge(
    problem: &Problem,
    holdout: &[Planned],
) -> Result<Option<Vec<TriangularFactor>>, IdentifyError> {
    if holdout.is_empty() {
        return Ok(None);
    }
    let p = problem.base.len();
    let mut factors = vec![TriangularFactor::new(p); problem.robot.joints.len()];
    for recording in holdout {
        recording.each_rows(&mut |rows| {
            for (factor, equation) in factors.iter_mut().zip(&rows.equations) {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], 1.0);
                }
            }
            Ok(())
        })?;
    }
    Ok(Some(factors))
}

/// Returns the distance of an estimate from the physically consistent set, in standard deviations.
fn distance(
    problem: &Problem,
    tempered: &TriangularFactor,
    prior: &Prior,
    full: &[f64],
) -> Result<f64, IdentifyError> {
    let mut loose = prior.clone();
    loose.strength = PULL_OF_DISTANCE;
    let about = quadratic_about(tempered, problem.base, full);
    loop {
        match consistent(&about, &loose) {
            Ok(found) => return Ok(found.squares.sqrt()),
            // Far from every consistent set, and with weakly excited combinations, rounding hides the end of the path.
            // An earlier point gives the same distance or one that is larger by the size of the pull.
            Err(_) if loose.strength < 1.0 => loose.strength *= 10.0,
            Err(e) => return Err(e),
        }
    }
}

/// The hold-out recordings.
pub(super) struct Held {
    /// Rows of all of them, one factor per joint.
    pub all: Vec<TriangularFactor>,
    /// Rows of those with a motion that is not in the training data; none if every one repeats a training motion.
    fresh: Option<Vec<TriangularFactor>>,
    /// Recordings that repeat a training motion.
    repeated: Vec<String>,
}

impl Held {
    /// Compares `holdout` with the training motions; none for an empty hold-out.
    pub(super) fn of(
        problem: &Problem,
        holdout: &[Planned],
    ) -> Result<Option<Self>, IdentifyError> {
        let Some(all) = judge(problem, holdout)? else {
            return Ok(None);
        };
        let frequency = problem.plan.treatment.motion_frequency;
        let path = |recording: &dyn Recording| Path::of(recording, frequency);
        let learnt: Vec<Path> = (problem.training.iter())
            .map(|recording| path(*recording))
            .collect::<Result<_, _>>()?;
        let (mut fresh, mut repeated) = (Vec::new(), Vec::new());
        for held in holdout {
            if path(held.recording)?.repeats(&learnt) {
                repeated.push(held.recording.label());
            } else {
                fresh.push(*held);
            }
        }
        let fresh = if repeated.is_empty() {
            Some(all.clone())
        } else {
            judge(problem, &fresh)?
        };
        Ok(Some(Self {
            all,
            fresh,
            repeated,
        }))
    }
}

/// Fits with every estimator of `list` and judges it, on the hold-out if given. `measured` holds the RMS torques of
/// training data and hold-out per joint, for rows that do not contain all of the torque.
pub(super) fn compare(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
    held: Option<&Held>,
    list: &[Estimator],
    names: &[String],
    measured: Option<&[Vec<f64>; 2]>,
) -> Result<Comparison, IdentifyError> {
    let weighted = least(problem, parts, problem.weights)?;
    let weighted_covariance = weighted.kept.covariance();
    let tempered = LeaveOut::of(&parts.weighted(&problem.tempered(parts))).whole;
    let torque = measured.map_or_else(|| parts.torque_rms(), |[training, _]| training.clone());
    let fresh = held.and_then(|held| held.fresh.as_deref());
    let mut rows = Vec::new();
    let mut errors = Vec::new();
    let mut instrumental: Option<Fitted> = None;
    for &estimator in list {
        let fitted = match estimator {
            Estimator::Weighted => Ok(weighted.clone()),
            other => fit(other, problem, parts, prior),
        };
        rows.push(match fitted {
            Err(e) => Compared {
                estimator,
                cross_validated_relative_error: None,
                holdout_relative_error: None,
                distance_to_consistent: None,
                physically_consistent: None,
                largest_shift: None,
                values: None,
                said: vec![e.to_string()],
            },
            Ok(fitted) => {
                let far = distance(problem, &tempered, prior, &fitted.full.whole).ok();
                let row = Compared {
                    estimator,
                    cross_validated_relative_error: Some(
                        parts
                            .cross_validated(&fitted.full)
                            .iter()
                            .zip(&torque)
                            .map(|(e, t)| e / t.max(f64::MIN_POSITIVE))
                            .collect(),
                    ),
                    holdout_relative_error: held.map(|held| {
                        let whole = measured.map(|[_, holdout]| holdout.as_slice());
                        relative_errors(&held.all, &fitted.full.whole, whole)
                    }),
                    distance_to_consistent: far,
                    physically_consistent: far
                        .map(|far| far < AT_THE_SET || estimator == Estimator::Consistent),
                    largest_shift: Some(
                        (0..fitted.kept.whole.len())
                            .map(|k| {
                                (fitted.kept.whole[k] - weighted.kept.whole[k]).abs()
                                    / weighted_covariance[(k, k)].sqrt().max(f64::MIN_POSITIVE)
                            })
                            .fold(0.0, f64::max),
                    ),
                    values: Some(fitted.kept.whole.clone()),
                    said: fitted
                        .said
                        .iter()
                        .chain(&fitted.warnings)
                        .cloned()
                        .collect(),
                };
                // Only another motion in the hold-out counts. A mean over joints needs no `whole` torque.
                let judged = match fresh {
                    Some(factors) => Some(relative_errors(factors, &fitted.full.whole, None)),
                    None => row.holdout_relative_error.clone(),
                };
                errors.extend(
                    judged
                        .or_else(|| row.cross_validated_relative_error.clone())
                        .map(|judged| (estimator, mean(&judged))),
                );
                if estimator == Estimator::Iv {
                    instrumental = Some(fitted);
                }
                row
            }
        });
    }
    let endogeneity = match &instrumental {
        Some(iv) => endogeneity(problem, parts, &weighted, iv, names)?,
        None => None,
    };
    let judge = if fresh.is_some() {
        Judge::OtherMotion
    } else if held.is_some() {
        Judge::Repeated
    } else {
        Judge::Stretches
    };
    let written = problem.options.estimator;
    let (recommended, mut recommendation) =
        recommend(&rows, &errors, endogeneity.as_ref(), judge, written);
    if recommended != written {
        recommendation += &format!(
            " The values given and written are those of {}; --estimator {} gives its own.",
            written.name(),
            recommended.name()
        );
    }
    recommendation += &beyond_use(problem.robot, &rows, recommended);
    Ok(Comparison {
        folds: parts.count,
        repeated_holdout: held.map_or_else(Vec::new, |held| held.repeated.clone()),
        estimators: rows,
        endogeneity,
        recommended,
        recommendation,
    })
}

/// Names the joints whose hold-out torque the `recommended` result predicts worse than no model; empty if none.
fn beyond_use(robot: &Robot, rows: &[Compared], recommended: Estimator) -> String {
    let row = rows.iter().find(|row| row.estimator == recommended);
    let errors = row.and_then(|row| row.holdout_relative_error.as_ref());
    let useless: Vec<String> = errors
        .into_iter()
        .flatten()
        .zip(&robot.joints)
        .filter(|(error, _)| **error >= 1.0)
        .map(|(error, joint)| format!("{} ({:.0} %)", joint.name, 100.0 * error))
        .collect();
    if useless.is_empty() {
        return String::new();
    }
    format!(
        " Trust nothing of {}: there it is farther from the torque held back than no model at all.",
        useless.join(", ")
    )
}

/// Returns the geometric mean of the relative errors over the joints that have one, so that all joints count equally.
fn mean(errors: &[f64]) -> f64 {
    let judged = errors.iter().filter(|e| !e.is_nan());
    let (sum, count) = judged.fold((0.0, 0usize), |(sum, count), e| {
        (sum + e.max(f64::MIN_POSITIVE).ln(), count + 1)
    });
    (sum / count.max(1) as f64).exp()
}
