//! Comparison of estimators by the same criteria, and the recommended result.

use nalgebra::DMatrix;

use super::compared::{Compared, Comparison};
use super::endogeneity::endogeneity;
use super::held::Held;
use super::recommend::{Judge, recommend};
use crate::bodies::consistent::consistent;
use crate::bodies::prior::Prior;
use crate::bodies::quadratic::quadratic_about;
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::estimators::fitted::Fitted;
use crate::estimators::least::least;
use crate::estimators::problem::Problem;
use crate::estimators::run::fit;
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::jackknife::LeaveOut;
use crate::uncertainty::parts::Parts;
use crate::uncertainty::relative_error::{geometric_mean, relative_errors};
use rig_model::robot::Robot;

/// Distance to the nearest consistent set below which a set counts as consistent, in standard deviations of all
/// parameters together. Not zero, because the barrier keeps the solution slightly inside.
const AT_THE_SET: f64 = 1.0;
/// Factor on the prior's pull when the distance to the consistent set is measured.
const PULL_OF_DISTANCE: f64 = 1e-4;

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

/// What estimates are compared with.
struct Yardstick<'a> {
    problem: &'a Problem<'a>,
    parts: &'a Parts,
    prior: &'a Prior,
    held: Option<&'a Held>,
    /// RMS torques of training data and hold-out per joint, for rows that do not contain all of the torque.
    measured: Option<&'a [Vec<f64>; 2]>,
    /// The weighted fit and its covariance.
    weighted: Fitted,
    covariance: DMatrix<f64>,
    /// All rows, in units of the noise of independent ones.
    tempered: TriangularFactor,
    /// RMS torque of each joint in the training data.
    torque: Vec<f64>,
}

impl<'a> Yardstick<'a> {
    fn new(
        problem: &'a Problem,
        parts: &'a Parts,
        prior: &'a Prior,
        held: Option<&'a Held>,
        measured: Option<&'a [Vec<f64>; 2]>,
    ) -> Result<Self, IdentifyError> {
        let weighted = least(problem, parts, problem.weights)?;
        Ok(Self {
            problem,
            parts,
            prior,
            held,
            measured,
            covariance: weighted.kept.covariance(),
            weighted,
            tempered: LeaveOut::of(&parts.weighted(&parts.tempered(problem.weights))).whole,
            torque: measured.map_or_else(|| parts.torque_rms(), |[training, _]| training.clone()),
        })
    }

    /// Fits with `estimator`.
    fn fitted(&self, estimator: Estimator) -> Result<Fitted, IdentifyError> {
        match estimator {
            Estimator::Weighted => Ok(self.weighted.clone()),
            other => fit(other, self.problem, self.parts, self.prior),
        }
    }

    /// Returns the row of a fit.
    fn row(&self, estimator: Estimator, fitted: &Fitted) -> Compared {
        let far = distance(self.problem, &self.tempered, self.prior, &fitted.full.whole).ok();
        Compared {
            estimator,
            cross_validated_relative_error: Some(
                self.parts
                    .cross_validated(&fitted.full)
                    .iter()
                    .zip(&self.torque)
                    .map(|(e, t)| e / t.max(f64::MIN_POSITIVE))
                    .collect(),
            ),
            holdout_relative_error: self.held.map(|held| {
                let whole = self.measured.map(|[_, holdout]| holdout.as_slice());
                relative_errors(&held.all, &fitted.full.whole, whole)
            }),
            distance_to_consistent: far,
            physically_consistent: far
                .map(|far| far < AT_THE_SET || estimator == Estimator::Consistent),
            largest_shift: Some(self.largest_shift(fitted)),
            values: Some(fitted.kept.whole.clone()),
            said: (fitted.said.iter().cloned())
                .chain(fitted.warnings.iter().map(ToString::to_string))
                .collect(),
        }
    }

    /// Returns the largest difference from the weighted fit, in standard deviations of that fit.
    fn largest_shift(&self, fitted: &Fitted) -> f64 {
        (0..fitted.kept.whole.len())
            .map(|k| {
                (fitted.kept.whole[k] - self.weighted.kept.whole[k]).abs()
                    / self.covariance[(k, k)].sqrt().max(f64::MIN_POSITIVE)
            })
            .fold(0.0, f64::max)
    }

    /// Returns the mean prediction error of a fit: on another motion in the hold-out, else on the whole hold-out, else
    /// by cross-validation.
    fn error(&self, fitted: &Fitted, row: &Compared) -> Option<f64> {
        // Only another motion in the hold-out counts. A mean over joints needs no `whole` torque.
        let judged = match self.fresh() {
            Some(factors) => Some(relative_errors(factors, &fitted.full.whole, None)),
            None => row.holdout_relative_error.clone(),
        };
        judged
            .or_else(|| row.cross_validated_relative_error.clone())
            .map(|judged| geometric_mean(&judged))
    }

    /// Returns the rows of the hold-out with another motion, if there are any.
    fn fresh(&self) -> Option<&[TriangularFactor]> {
        self.held.and_then(|held| held.fresh.as_deref())
    }

    /// Returns the data of the prediction errors.
    fn judge(&self) -> Judge {
        if self.fresh().is_some() {
            Judge::OtherMotion
        } else if self.held.is_some() {
            Judge::Repeated
        } else {
            Judge::Stretches
        }
    }
}

/// Returns the row of an estimator that failed.
fn failed(estimator: Estimator, why: &IdentifyError) -> Compared {
    Compared {
        estimator,
        cross_validated_relative_error: None,
        holdout_relative_error: None,
        distance_to_consistent: None,
        physically_consistent: None,
        largest_shift: None,
        values: None,
        said: vec![why.to_string()],
    }
}

/// Fits with every estimator to compare and judges it, on the hold-out if given. `measured` holds the RMS torques of
/// training data and hold-out per joint, for rows that do not contain all of the torque.
///
/// # Errors
/// [`IdentifyError`]: a weighted fit that is singular, reading errors.
pub(crate) fn compare(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
    held: Option<&Held>,
    names: &[String],
    measured: Option<&[Vec<f64>; 2]>,
) -> Result<Comparison, IdentifyError> {
    let yardstick = Yardstick::new(problem, parts, prior, held, measured)?;
    let (mut rows, mut errors) = (Vec::new(), Vec::new());
    let mut instrumental: Option<Fitted> = None;
    for &estimator in &problem.options.compare {
        let fitted = match yardstick.fitted(estimator) {
            Ok(fitted) => fitted,
            Err(e) => {
                rows.push(failed(estimator, &e));
                continue;
            }
        };
        let row = yardstick.row(estimator, &fitted);
        errors.extend((yardstick.error(&fitted, &row)).map(|error| (estimator, error)));
        if estimator == Estimator::Iv {
            instrumental = Some(fitted);
        }
        rows.push(row);
    }
    let endogeneity = match &instrumental {
        Some(iv) => endogeneity(problem, parts, &yardstick.weighted, iv, names)?,
        None => None,
    };
    let written = problem.options.estimator;
    let (recommended, mut recommendation) = recommend(
        &rows,
        &errors,
        endogeneity.as_ref(),
        yardstick.judge(),
        written,
    );
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
