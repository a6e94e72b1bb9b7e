//! Estimators side by side, judged alike, and which result to trust.

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
use super::repeat::Path;
use super::ridge::ridge;
use super::robust::robust;
use super::standard::{consistent_fit, quadratic_about};
use super::total::{moved_by_noise, total};
use super::{Estimator, IdentifyError};
use crate::prepare::Recording;
use crate::report::{format_p_value, format_significant, format_value};

/// p-value below which a difference counts as shown.
const SHOWN: f64 = 0.01;
/// A difference of less than this many standard deviations of the weighted fit makes none.
const MATERIAL: f64 = 0.5;
/// An estimate agrees with the weighted fit where no parameter is farther from it: within the intervals of that.
const AGREES: f64 = 2.0;
/// Bias may be so many times what the noise of the position's spectrum makes: noise that is not white, and its way through the
/// controller.
const AT_MOST: f64 = 5.0;
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

/// What the difference between least squares and instrumental variables shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Noise in the motion biases least squares.
    Biased,
    /// They do not differ by more than chance.
    NoSign,
    /// They differ by more than chance, but by less than the estimate's own uncertainty.
    Immaterial,
    /// They differ by more than the position's noise can cause.
    NotNoise,
    /// Nothing: the instruments are not good enough to ask.
    Undecided,
}

/// Whether least squares and instrumental variables differ by more than chance, and what that shows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Endogeneity {
    /// What it shows.
    pub verdict: Verdict,
    /// p-value of the parameter below, times the number of parameters (Bonferroni).
    pub p_value: f64,
    /// Index in `base_parameters` of the parameter that decided.
    pub parameter: usize,
    /// Difference, instrumental variables less weighted least squares.
    pub difference: f64,
    /// Its standard deviation.
    pub std: f64,
    /// The same difference in standard deviations of the weighted fit.
    pub shift: f64,
    /// One sentence.
    pub text: String,
}

/// The table and the verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Stretches of time that were predicted from the others.
    pub folds: usize,
    /// Recordings held back that repeat a motion learnt from: no evidence of how another one is predicted.
    pub repeated_holdout: Vec<String>,
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

/// The recordings held back.
pub(super) struct Held {
    /// Rows of all of them, a factor a joint.
    pub all: Vec<TriangularFactor>,
    /// Rows of those that do not repeat a motion learnt from; none where all do.
    fresh: Option<Vec<TriangularFactor>>,
    /// Those that repeat one.
    repeated: Vec<String>,
}

impl Held {
    /// Judges `holdout` against the motions learnt from; none of none.
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

/// Fits with every estimator of `list` and judges, by the hold-out where there is one. `measured` are the RMS torques of
/// training data and hold-out, joint by joint, where the rows do not hold all of the torque.
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
                // What is held back counts where it is another motion; a mean over joints needs no torque of its own.
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
    Ok(Comparison {
        folds: parts.count,
        repeated_holdout: held.map_or_else(Vec::new, |held| held.repeated.clone()),
        estimators: rows,
        endogeneity,
        recommended,
        recommendation,
    })
}

/// Hausman's test (1978), parameter by parameter: the difference against its own jackknife standard deviation, which
/// needs neither efficiency of the one nor independence of the rows. What differs by more than chance is bias by noise
/// only where it matters and where the noise that the position's spectrum shows can make it. `doubtful` says why the
/// instruments are not good enough to ask.
fn endogeneity(
    problem: &Problem,
    parts: &Parts,
    weighted: &Fitted,
    iv: &Fitted,
    names: &[String],
) -> Result<Option<Endogeneity>, IdentifyError> {
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
    let own = weighted.kept.covariance();
    let Ok(t) = StudentsT::new(0.0, 1.0, (difference.without.len() - 1) as f64) else {
        return Ok(None);
    };
    let std = |k: usize| covariance[(k, k)].sqrt();
    let p_value = |k: usize| {
        let ratio = difference.whole[k].abs() / std(k).max(f64::MIN_POSITIVE);
        (2.0 * t.sf(ratio) * size as f64).min(1.0)
    };
    let shift = |k: usize| difference.whole[k] / own[(k, k)].sqrt().max(f64::MIN_POSITIVE);
    let asked = Asked {
        p_value: (0..size).map(p_value).collect(),
        shift: (0..size).map(shift).collect(),
        difference: &difference.whole,
    };
    let (mut verdict, mut k) = asked.by_chance();
    let mut expected = None;
    if iv.doubtful.is_some() {
        verdict = Verdict::Undecided;
    } else if verdict == Verdict::NotNoise {
        let moved = moved_by_noise(problem, parts, &iv.kept.whole)?;
        (verdict, k) = asked.by_noise(&moved);
        expected = Some(moved[k].abs());
    }
    let Some(name) = names.get(k) else {
        return Ok(None);
    };
    let apart = format_value(difference.whole[k], std(k));
    let by = format_significant(shift(k).abs(), 2);
    let noise = format_significant(expected.unwrap_or(f64::NAN), 2);
    let text = match (verdict, &iv.doubtful) {
        (Verdict::Undecided, why) => format!(
            "Whether noise in the motion biases least squares is not known: {}.",
            why.as_deref()
                .unwrap_or("the instruments are not good enough")
        ),
        (Verdict::NoSign, _) => format!(
            "Least squares and instrumental variables do not differ by more than chance (smallest p over {size} parameters {:.2}): no sign that noise in the motion biases least squares.",
            p_value(k)
        ),
        (Verdict::Immaterial, _) => format!(
            "Least squares and instrumental variables differ by more than chance, but by so little that it makes no difference: most in {name}, by {by} of its standard deviation."
        ),
        (Verdict::NotNoise, _) => format!(
            "Least squares and instrumental variables differ by more than chance, most in {name} (by {apart}), but the position's noise, as its spectrum shows it, would move that by some {noise} only: it is not noise in the motion that makes the difference, but something that the model lacks."
        ),
        (Verdict::Biased, _) => format!(
            "Least squares and instrumental variables differ by more than chance, most in {name} (by {apart}, {by} standard deviations of the weighted fit, p = {} over all {size} parameters): noise in the motion or its way through the controller biases least squares. The position's noise, as its spectrum shows it, moves that by some {noise}.",
            format_p_value(p_value(k))
        ),
    };
    Ok(Some(Endogeneity {
        verdict,
        p_value: p_value(k),
        parameter: k,
        difference: difference.whole[k],
        std: std(k),
        shift: shift(k),
        text,
    }))
}

/// How two estimates differ, parameter by parameter.
struct Asked<'a> {
    p_value: Vec<f64>,
    /// In standard deviations of the weighted fit.
    shift: Vec<f64>,
    difference: &'a [f64],
}

impl Asked<'_> {
    /// What differs by more than chance, and by so much that it matters.
    fn material(&self) -> Vec<usize> {
        let all = 0..self.shift.len();
        all.filter(|&k| self.p_value[k] < SHOWN && self.shift[k].abs() >= MATERIAL)
            .collect()
    }

    fn largest(&self, list: &[usize]) -> usize {
        let all = list.iter().copied();
        all.max_by(|&a, &b| self.shift[a].abs().total_cmp(&self.shift[b].abs()))
            .unwrap_or(0)
    }

    /// Whether they differ by more than chance and materially (then not yet known to be noise), and the parameter that says so.
    fn by_chance(&self) -> (Verdict, usize) {
        let shown: Vec<usize> = (0..self.shift.len())
            .filter(|&k| self.p_value[k] < SHOWN)
            .collect();
        let material = self.material();
        if shown.is_empty() {
            let all = 0..self.shift.len();
            let likeliest = all.min_by(|&a, &b| self.p_value[a].total_cmp(&self.p_value[b]));
            (Verdict::NoSign, likeliest.unwrap_or(0))
        } else if material.is_empty() {
            (Verdict::Immaterial, self.largest(&shown))
        } else {
            (Verdict::NotNoise, self.largest(&material))
        }
    }

    /// Whether noise that moves the parameters by `moved` can have made a material difference.
    fn by_noise(&self, moved: &[f64]) -> (Verdict, usize) {
        let material = self.material();
        let possible: Vec<usize> = (material.iter().copied())
            .filter(|&k| self.difference[k].abs() <= AT_MOST * moved[k].abs())
            .collect();
        if possible.is_empty() {
            (Verdict::NotNoise, self.largest(&material))
        } else {
            (Verdict::Biased, self.largest(&possible))
        }
    }
}

/// Geometric mean of the relative errors over the joints that have one, so that strong and weak ones count alike.
fn mean(errors: &[f64]) -> f64 {
    let judged = errors.iter().filter(|e| !e.is_nan());
    let (sum, count) = judged.fold((0.0, 0usize), |(sum, count), e| {
        (sum + e.max(f64::MIN_POSITIVE).ln(), count + 1)
    });
    (sum / count.max(1) as f64).exp()
}

/// What errors are taken over.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Judge {
    /// Another motion than that learnt from.
    OtherMotion,
    /// The motion learnt from, once more.
    Repeated,
    /// Stretches of the motion learnt from.
    Stretches,
}

impl Judge {
    fn error(self) -> &'static str {
        match self {
            Self::OtherMotion => "error on the data held back",
            Self::Repeated => "error on the data held back, which repeat the training motion,",
            Self::Stretches => "cross-validated error",
        }
    }

    /// What these errors are no evidence of.
    fn silence(self) -> &'static str {
        match self {
            Self::OtherMotion => "",
            Self::Repeated => {
                " The data held back repeat the training motion, so they do not show how well another one is predicted; give a different motion as --holdout for that."
            }
            Self::Stretches => {
                " Stretches of the training motion do not show how well another one is predicted; give a different motion as --holdout for that."
            }
        }
    }
}

/// The result to trust, and why: one rule, from what errors are evidence of, what a body can be and what instruments show.
fn recommend(
    rows: &[Compared],
    errors: &[(Estimator, f64)],
    endogeneity: Option<&Endogeneity>,
    judge: Judge,
    written: Estimator,
) -> (Estimator, String) {
    let of = |e: Estimator| rows.iter().find(|r| r.estimator == e);
    let error = |e: Estimator| errors.iter().find(|(own, _)| *own == e).map(|(_, e)| *e);
    let percent = |e: f64| format!("{:.2} %", 100.0 * e);
    let plain = error(Estimator::Weighted).unwrap_or(f64::INFINITY);
    let far = of(Estimator::Weighted).and_then(|r| r.distance_to_consistent);
    let possible = of(Estimator::Weighted)
        .and_then(|r| r.physically_consistent)
        .unwrap_or(true);
    let verdict = endogeneity.map(|e| e.verdict);
    let (own, silence) = (judge.error(), judge.silence());
    if let (Some(Verdict::Biased), Some(iv)) = (verdict, error(Estimator::Iv)) {
        return (
            Estimator::Iv,
            format!(
                "Trust iv: least squares is biased by noise that passes into its regressor, instrumental variables are not; that their {own} is {} against {} does not speak against them, because the bias helps to predict rows with the same noise.",
                percent(iv),
                percent(plain)
            ),
        );
    }
    let impossible = || {
        format!(
            "no body has the weighted fit's parameters (they lie {} standard deviations from the nearest that one has)",
            format_significant(far.unwrap_or(f64::NAN), 2)
        )
    };
    if let Some(bound) = error(Estimator::Consistent) {
        if bound <= (1.0 - WORSE) * plain {
            return (
                Estimator::Consistent,
                format!(
                    "Trust consistent: its {own} is {} against {} of the weighted fit, because what the motion leaves open is decided by what a body can be.{silence}",
                    percent(bound),
                    percent(plain)
                ),
            );
        }
        if !possible && bound <= (1.0 + WORSE) * plain {
            return (
                Estimator::Consistent,
                format!(
                    "Trust consistent: {}, and being one costs next to nothing in prediction ({} against {}).{silence}",
                    impossible(),
                    percent(bound),
                    percent(plain)
                ),
            );
        }
        if !possible && judge == Judge::OtherMotion {
            return (
                Estimator::Weighted,
                format!(
                    "Trust weighted for prediction only: {}, and requiring one raises the {own} from {} to {}, so something is missing in the model.",
                    impossible(),
                    percent(plain),
                    percent(bound)
                ),
            );
        }
        if !possible {
            return (
                Estimator::Consistent,
                format!(
                    "Trust consistent: {}. That the weighted fit's {own} is {} against {} is no evidence for it, because values that no body has can follow one motion and fail on the next; it does show that something is missing in the model.{silence}",
                    impossible(),
                    percent(plain),
                    percent(bound)
                ),
            );
        }
    }
    let shift = of(written).and_then(|row| row.largest_shift);
    if let (Some(shift), Some(error)) = (shift.filter(|s| *s < AGREES), error(written))
        && written != Estimator::Weighted
        && error <= (1.0 + WORSE) * plain
    {
        return (
            written,
            format!(
                "Trust {}: it agrees with the weighted fit, whose parameters are those of bodies that can exist, to within {} standard deviations, and its {own} is {} against {}.{silence}",
                written.name(),
                format_significant(shift, 2),
                percent(error),
                percent(plain)
            ),
        );
    }
    (
        Estimator::Weighted,
        format!(
            "Trust weighted: its parameters are those of bodies that can exist, its {own} is {}, and {}.{silence}",
            percent(plain),
            match verdict {
                Some(Verdict::NoSign | Verdict::Immaterial) => {
                    "instrumental variables agree with it"
                }
                _ => "no other fit here is shown to be better",
            }
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_bias_only_where_it_matters_and_noise_can_make_it() {
        let difference = [1e-6, 0.3, -0.2];
        let asked = |p_value: [f64; 3], shift: [f64; 3]| Asked {
            p_value: p_value.into(),
            shift: shift.into(),
            difference: &difference,
        };
        let none = asked([0.3, 1.0, 0.02], [0.1, 3.0, 2.0]);
        assert_eq!(none.by_chance(), (Verdict::NoSign, 2));
        let little = asked([1e-9, 1.0, 1e-3], [0.0025, 3.0, -0.4]);
        assert_eq!(little.by_chance(), (Verdict::Immaterial, 2));
        let much = asked([1e-9, 1e-4, 1e-3], [0.0025, 3.0, -4.0]);
        assert_eq!(much.by_chance(), (Verdict::NotNoise, 2));
        // Noise moves the first alone, then the second by a fifth of what is seen.
        assert_eq!(much.by_noise(&[1e-6, 0.01, 0.01]), (Verdict::NotNoise, 2));
        assert_eq!(much.by_noise(&[0.0, -0.061, 0.01]), (Verdict::Biased, 1));
    }

    /// Errors of weighted and consistent, and whether a body has the weighted fit's parameters.
    fn recommended(plain: f64, bound: f64, possible: bool, shift: f64, judge: Judge) -> Estimator {
        let row = |estimator, possible, shift| Compared {
            estimator,
            cross_validated_relative_error: None,
            holdout_relative_error: None,
            distance_to_consistent: Some(if possible { 0.1 } else { 12.0 }),
            physically_consistent: Some(possible),
            largest_shift: Some(shift),
            values: None,
            said: Vec::new(),
        };
        let rows = [
            row(Estimator::Weighted, possible, 0.0),
            row(Estimator::Consistent, true, shift),
        ];
        let errors = [(Estimator::Weighted, plain), (Estimator::Consistent, bound)];
        let (estimator, text) = recommend(&rows, &errors, None, judge, Estimator::Consistent);
        assert!(
            text.contains(&format!("Trust {}", estimator.name())),
            "{text}"
        );
        assert_eq!(
            text.contains("different motion"),
            judge != Judge::OtherMotion,
            "{text}"
        );
        estimator
    }

    #[test]
    fn a_repeated_motion_is_no_evidence_for_values_that_no_body_has() {
        for judge in [Judge::Repeated, Judge::Stretches] {
            assert_eq!(
                recommended(0.06, 0.07, false, 9.0, judge),
                Estimator::Consistent
            );
        }
        let other = Judge::OtherMotion;
        assert_eq!(
            recommended(0.06, 0.07, false, 9.0, other),
            Estimator::Weighted
        );
        assert_eq!(
            recommended(0.07, 0.06, false, 9.0, other),
            Estimator::Consistent
        );
        assert_eq!(
            recommended(0.06, 0.06, true, 0.02, other),
            Estimator::Consistent
        );
        assert_eq!(
            recommended(0.06, 0.06, true, 9.0, other),
            Estimator::Weighted
        );
        assert_eq!(
            recommended(0.06, 0.07, true, 0.5, other),
            Estimator::Weighted
        );
    }
}
