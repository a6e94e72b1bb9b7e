//! Estimators side by side, judged alike, and which result to trust.

use nalgebra::DVector;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::consistent::consistent;
use super::evaluate::Planned;
use super::factor::TriangularFactor;
use super::instrumental::instrumental;
use super::least::least;
use super::likelihood::likelihood;
use super::output_error::output_error;
use super::parts::{LeaveOut, Parts};
use super::prior::Prior;
use super::problem::{Fitted, Problem};
use super::ridge::ridge;
use super::robust::robust;
use super::standard::{consistent_fit, quadratic_about};
use super::total::total;
use super::{Estimator, IdentifyError};

/// p-value below which a difference counts as shown.
const SHOWN: f64 = 0.01;
/// By how much of its error an estimate must predict worse before that counts against it.
const WORSE: f64 = 0.02;
/// A set counts as consistent when it lies nearer than this to one that is, in standard deviations of all parameters
/// together: the barrier keeps the solution a little inside.
const AT_THE_SET: f64 = 1.0;
/// How much weaker than in a fit the prior's pull is when the distance to the consistent set is measured.
const PULL_OF_DISTANCE: f64 = 1e-4;

/// One estimator's result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Which.
    pub estimator: Estimator,
    /// Per joint, RMS of the residual over RMS of the torque, every stretch predicted from the others; null where
    /// the estimator failed.
    pub cross_validated_relative_error: Option<Vec<f64>>,
    /// The same on the hold-out, where given.
    pub holdout_relative_error: Option<Vec<f64>>,
    /// Distance of the estimate from the nearest physically consistent one, in standard deviations of all
    /// parameters together.
    pub distance_to_consistent: Option<f64>,
    /// Whether that is no distance.
    pub physically_consistent: Option<bool>,
    /// Largest difference from the weighted fit over all parameters, in standard deviations of the weighted fit.
    pub largest_shift: Option<f64>,
    /// Values in the order of `base_parameters`.
    pub values: Option<Vec<f64>>,
    /// How it went, or why it failed.
    pub said: Vec<String>,
}

/// Whether least squares and instrumental variables differ by more than chance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Endogeneity {
    /// Smallest p-value over the parameters, times their number (Bonferroni).
    pub p_value: f64,
    /// Index of that parameter in `base_parameters`.
    pub parameter: usize,
    /// Difference, instrumental variables less weighted least squares.
    pub difference: f64,
    /// Its standard deviation.
    pub std: f64,
    /// One sentence.
    pub text: String,
}

/// The table and the verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Stretches of time that were predicted from the others.
    pub folds: usize,
    /// One an estimator.
    pub estimators: Vec<Compared>,
    /// Durbin, Wu and Hausman's question, absent where instrumental variables failed.
    pub endogeneity: Option<Endogeneity>,
    /// The result to trust.
    pub recommended: Estimator,
    /// Which and why.
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

/// Per joint, RMS of what `full` leaves of the rows behind `factors` over that of the torque: of `whole`, where the rows do
/// not hold all of it.
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

/// Recordings as one factor a joint, torque against motion; none of none.
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

/// Distance of an estimate from the physically consistent set, in standard deviations.
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
            // Far from every body, and with combinations that the data hardly touch, rounding hides the last of the
            // path. What is found before it lies as far or, by the pull's own size, farther.
            Err(_) if loose.strength < 1.0 => loose.strength *= 10.0,
            Err(e) => return Err(e),
        }
    }
}

/// Fits with every estimator of `list` and judges, by `held` of the hold-out where there is one. `measured` are the RMS torques of training data and hold-out, joint by
/// joint, where the rows do not hold all of the torque.
pub(super) fn compare(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
    held: Option<&[TriangularFactor]>,
    list: &[Estimator],
    names: &[String],
    measured: Option<&[Vec<f64>; 2]>,
) -> Result<Comparison, IdentifyError> {
    let weighted = least(problem, parts, problem.weights)?;
    let weighted_covariance = weighted.kept.covariance();
    let tempered = LeaveOut::of(&parts.weighted(&problem.tempered(parts))).whole;
    let torque = measured.map_or_else(|| parts.torque_rms(), |[training, _]| training.clone());
    let mut rows = Vec::new();
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
                    holdout_relative_error: held.map(|factors| {
                        let whole = measured.map(|[_, holdout]| holdout.as_slice());
                        relative_errors(factors, &fitted.full.whole, whole)
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
                if estimator == Estimator::Iv {
                    instrumental = Some(fitted);
                }
                row
            }
        });
    }
    let endogeneity = instrumental
        .as_ref()
        .and_then(|iv| endogeneity(&weighted, iv, names));
    let weak = instrumental.as_ref().is_some_and(|iv| iv.doubtful);
    let (recommended, mut recommendation) = recommend(&rows, endogeneity.as_ref(), weak);
    let written = problem.options.estimator;
    if recommended != written {
        recommendation += &format!(
            " The values given and written are those of {}; --estimator {} gives its own.",
            written.name(),
            recommended.name()
        );
    }
    Ok(Comparison {
        folds: parts.count,
        estimators: rows,
        endogeneity,
        recommended,
        recommendation,
    })
}

/// Hausman's test (1978), parameter by parameter: the difference against its own jackknife standard deviation, which
/// needs neither efficiency of the one nor independence of the rows.
fn endogeneity(weighted: &Fitted, iv: &Fitted, names: &[String]) -> Option<Endogeneity> {
    let size = weighted.kept.whole.len();
    let difference = super::parts::Refit {
        whole: (0..size)
            .map(|k| iv.kept.whole[k] - weighted.kept.whole[k])
            .collect(),
        without: iv
            .kept
            .without
            .iter()
            .zip(&weighted.kept.without)
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect())
            .collect(),
    };
    let covariance = difference.covariance();
    let t = StudentsT::new(0.0, 1.0, (difference.without.len() - 1) as f64).ok()?;
    let (p, k) = (0..size)
        .map(|k| {
            let std = covariance[(k, k)].sqrt();
            let ratio = difference.whole[k].abs() / std.max(f64::MIN_POSITIVE);
            (2.0 * t.sf(ratio), k)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let p_value = (p * size as f64).min(1.0);
    let std = covariance[(k, k)].sqrt();
    Some(Endogeneity {
        p_value,
        parameter: k,
        difference: difference.whole[k],
        std,
        text: if p_value < SHOWN {
            format!(
                "Least squares and instrumental variables differ by more than chance, most in {} (by {:.3e} ± {std:.1e}, p = {p_value:.1e} over all {size} parameters): noise in the motion or its way through the controller biases least squares.",
                names[k], difference.whole[k]
            )
        } else {
            format!(
                "Least squares and instrumental variables do not differ by more than chance (smallest p over {size} parameters {p_value:.2}): no sign that noise in the motion biases least squares."
            )
        },
    })
}

/// Geometric mean of the relative errors over the joints, so that strong and weak ones count alike: on the hold-out
/// where there is one, which a repeated motion cannot flatter, else cross-validated.
fn score(row: &Compared) -> Option<f64> {
    let errors = row
        .holdout_relative_error
        .as_ref()
        .or(row.cross_validated_relative_error.as_ref())?;
    let logarithms = DVector::from_iterator(
        errors.len(),
        errors.iter().map(|e| e.max(f64::MIN_POSITIVE).ln()),
    );
    Some((logarithms.sum() / errors.len().max(1) as f64).exp())
}

/// The result to trust, and why.
fn recommend(
    rows: &[Compared],
    endogeneity: Option<&Endogeneity>,
    weak: bool,
) -> (Estimator, String) {
    let of = |e: Estimator| rows.iter().find(|r| r.estimator == e);
    let error = |e: Estimator| of(e).and_then(score);
    let held = rows.iter().any(|r| r.holdout_relative_error.is_some());
    let judge = if held {
        "error on the data held back"
    } else {
        "cross-validated error"
    };
    let percent = |e: f64| format!("{:.2} %", 100.0 * e);
    let plain = error(Estimator::Weighted).unwrap_or(f64::INFINITY);
    let far = of(Estimator::Weighted).and_then(|r| r.distance_to_consistent);
    let possible = of(Estimator::Weighted)
        .and_then(|r| r.physically_consistent)
        .unwrap_or(true);
    let biased = endogeneity.filter(|e| e.p_value < SHOWN);
    if let (Some(_), Some(iv)) = (biased, error(Estimator::Iv))
        && !weak
    {
        return (
            Estimator::Iv,
            format!(
                "Trust iv: least squares is biased by noise that passes into its regressor, instrumental variables are not; that their {judge} is {} against {} does not speak against them, because the bias helps to predict rows with the same noise.",
                percent(iv),
                percent(plain)
            ),
        );
    }
    let note = match biased {
        Some(_) => {
            " Instrumental variables differ by more than chance, but their instruments are not good enough to trust them instead."
        }
        None => "",
    };
    if let Some(bound) = error(Estimator::Consistent) {
        if bound <= (1.0 - WORSE) * plain {
            return (
                Estimator::Consistent,
                format!(
                    "Trust consistent: its {judge} is {} against {} of the weighted fit, because what the motion leaves open is decided by what a body can be.{note}",
                    percent(bound),
                    percent(plain)
                ),
            );
        }
        if !possible && bound <= (1.0 + WORSE) * plain {
            return (
                Estimator::Consistent,
                format!(
                    "Trust consistent: no body has the weighted fit's parameters (they lie {:.1} standard deviations from the nearest that one has), and being one costs next to nothing in prediction ({} against {}).{note}",
                    far.unwrap_or(f64::NAN),
                    percent(bound),
                    percent(plain)
                ),
            );
        }
        if !possible {
            return (
                Estimator::Weighted,
                format!(
                    "Trust weighted for prediction only: no body has its parameters ({:.1} standard deviations from the nearest that one has), and requiring one raises the {judge} from {} to {}, so something is missing in the model.{note}",
                    far.unwrap_or(f64::NAN),
                    percent(plain),
                    percent(bound)
                ),
            );
        }
    }
    (
        Estimator::Weighted,
        format!(
            "Trust weighted: its parameters are those of bodies that can exist, its {judge} is {}, and {}.{note}",
            percent(plain),
            if biased.is_none() && endogeneity.is_some() {
                "instrumental variables agree with it"
            } else {
                "no other fit here is shown to be better"
            }
        ),
    )
}
