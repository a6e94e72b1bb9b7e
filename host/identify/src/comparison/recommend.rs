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
    // Agreement proves nothing if noise may have passed into the instruments.
    let doubted =
        written == Estimator::Iv && !matches!(verdict, Some(Verdict::NoSign | Verdict::Immaterial));
    if let (Some(shift), Some(error)) = (shift.filter(|s| *s < AGREES), error(written))
        && written != Estimator::Weighted
        && !doubted
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
