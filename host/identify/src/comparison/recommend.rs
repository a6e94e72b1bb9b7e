//! Choice of the recommended estimator.

use super::compared::Compared;
use super::endogeneity::{Endogeneity, Verdict};
use crate::estimator::Estimator;
use rig_output::format_significant;

/// Distance to the weighted fit below which an estimate agrees with it, in its standard deviations: the 95 % interval.
const AGREES: f64 = 2.0;
/// Relative increase of the prediction error that counts against an estimate.
const WORSE: f64 = 0.02;

/// The data of the prediction errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Judge {
    /// A motion that is not in the training data.
    OtherMotion,
    /// The training motion, recorded again.
    Repeated,
    /// Time segments of the training motion.
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

    /// Returns a sentence about what these errors do not show.
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

/// Returns the recommended estimator and the reason, from prediction errors, physical consistency and instruments.
pub(crate) fn recommend(
    rows: &[Compared],
    errors: &[(Estimator, f64)],
    endogeneity: Option<&Endogeneity>,
    judge: Judge,
    written: Estimator,
) -> (Estimator, String) {
    let plain = errors.iter().find(|(own, _)| *own == Estimator::Weighted);
    let weighted = rows.iter().find(|r| r.estimator == Estimator::Weighted);
    let case = Case {
        rows,
        errors,
        verdict: endogeneity.map(|e| e.verdict),
        judge,
        written,
        plain: plain.map_or(f64::INFINITY, |(_, error)| *error),
        far: weighted.and_then(|r| r.distance_to_consistent),
        possible: weighted
            .and_then(|r| r.physically_consistent)
            .unwrap_or(true),
    };
    (case.unbiased())
        .or_else(|| case.consistent())
        .or_else(|| case.agreeing())
        .unwrap_or_else(|| case.weighted())
}

/// The evidence for a recommendation.
struct Case<'a> {
    rows: &'a [Compared],
    errors: &'a [(Estimator, f64)],
    verdict: Option<Verdict>,
    judge: Judge,
    /// The requested estimator.
    written: Estimator,
    /// Prediction error of the weighted fit.
    plain: f64,
    /// Distance of the weighted fit from the physically consistent set, in standard deviations.
    far: Option<f64>,
    /// True if the weighted fit is physically consistent.
    possible: bool,
}

impl Case<'_> {
    /// Returns the prediction error of an estimator.
    fn error(&self, e: Estimator) -> Option<f64> {
        let own = self.errors.iter().find(|(own, _)| *own == e);
        own.map(|(_, e)| *e)
    }

    /// Recommends instrumental variables if noise biases least squares.
    fn unbiased(&self) -> Option<(Estimator, String)> {
        let (Some(Verdict::Biased), Some(iv)) = (self.verdict, self.error(Estimator::Iv)) else {
            return None;
        };
        Some((
            Estimator::Iv,
            format!(
                "Trust iv: least squares is biased by noise that passes into its regressor, instrumental variables are not; that their {} is {} against {} does not speak against them, because the bias helps to predict rows with the same noise.",
                self.judge.error(),
                percent(iv),
                percent(self.plain)
            ),
        ))
    }

    /// Returns a clause about a weighted fit that no body has.
    fn impossible(&self) -> String {
        format!(
            "no body has the weighted fit's parameters (they lie {} standard deviations from the nearest that one has)",
            format_significant(self.far.unwrap_or(f64::NAN), 2)
        )
    }

    /// Decides between the physically consistent and the weighted fit, if the one predicts better or no body has the
    /// parameters of the other.
    fn consistent(&self) -> Option<(Estimator, String)> {
        let bound = self.error(Estimator::Consistent)?;
        let (plain, possible) = (self.plain, self.possible);
        let (own, silence) = (self.judge.error(), self.judge.silence());
        if bound <= (1.0 - WORSE) * plain {
            return Some((
                Estimator::Consistent,
                format!(
                    "Trust consistent: its {own} is {} against {} of the weighted fit, because what the motion leaves open is decided by what a body can be.{silence}",
                    percent(bound),
                    percent(plain)
                ),
            ));
        }
        if possible {
            return None;
        }
        if bound <= (1.0 + WORSE) * plain {
            return Some((
                Estimator::Consistent,
                format!(
                    "Trust consistent: {}, and being one costs next to nothing in prediction ({} against {}).{silence}",
                    self.impossible(),
                    percent(bound),
                    percent(plain)
                ),
            ));
        }
        if self.judge == Judge::OtherMotion {
            return Some((
                Estimator::Weighted,
                format!(
                    "Trust weighted for prediction only: {}, and requiring one raises the {own} from {} to {}, so something is missing in the model.",
                    self.impossible(),
                    percent(plain),
                    percent(bound)
                ),
            ));
        }
        Some((
            Estimator::Consistent,
            format!(
                "Trust consistent: {}. That the weighted fit's {own} is {} against {} is no evidence for it, because values that no body has can follow one motion and fail on the next; it does show that something is missing in the model.{silence}",
                self.impossible(),
                percent(plain),
                percent(bound)
            ),
        ))
    }

    /// Recommends the requested estimator if it agrees with the weighted fit and predicts as well.
    fn agreeing(&self) -> Option<(Estimator, String)> {
        let written = self.written;
        // Agreement proves nothing if noise may have passed into the instruments.
        let doubted = written == Estimator::Iv
            && !matches!(self.verdict, Some(Verdict::NoSign | Verdict::Immaterial));
        let row = self.rows.iter().find(|r| r.estimator == written);
        let shift = row.and_then(|row| row.largest_shift);
        let shift = shift.filter(|s| *s < AGREES)?;
        let error = self.error(written)?;
        if written == Estimator::Weighted || doubted || !(error <= (1.0 + WORSE) * self.plain) {
            return None;
        }
        Some((
            written,
            format!(
                "Trust {}: it agrees with the weighted fit, whose parameters are those of bodies that can exist, to within {} standard deviations, and its {} is {} against {}.{}",
                written.name(),
                format_significant(shift, 2),
                self.judge.error(),
                percent(error),
                percent(self.plain),
                self.judge.silence()
            ),
        ))
    }

    /// Recommends the weighted fit.
    fn weighted(&self) -> (Estimator, String) {
        (
            Estimator::Weighted,
            format!(
                "Trust weighted: its parameters are those of bodies that can exist, its {} is {}, and {}.{}",
                self.judge.error(),
                percent(self.plain),
                match self.verdict {
                    Some(Verdict::NoSign | Verdict::Immaterial) => {
                        "instrumental variables agree with it"
                    }
                    _ => "no other fit here is shown to be better",
                },
                self.judge.silence()
            ),
        )
    }
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of weighted and consistent, and whether the weighted fit is physically consistent.
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
        use Estimator::{Consistent, Weighted};
        use Judge::{OtherMotion, Repeated, Stretches};
        for (plain, bound, possible, shift, judge, expected) in [
            (0.06, 0.07, false, 9.0, Repeated, Consistent),
            (0.06, 0.07, false, 9.0, Stretches, Consistent),
            (0.06, 0.07, false, 9.0, OtherMotion, Weighted),
            (0.07, 0.06, false, 9.0, OtherMotion, Consistent),
            (0.06, 0.06, true, 0.02, OtherMotion, Consistent),
            (0.06, 0.06, true, 9.0, OtherMotion, Weighted),
            (0.06, 0.07, true, 0.5, OtherMotion, Weighted),
        ] {
            assert_eq!(
                recommended(plain, bound, possible, shift, judge),
                expected,
                "{plain} {bound} {possible} {shift} {judge:?}"
            );
        }
    }
}
