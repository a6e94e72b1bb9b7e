//! Test for bias of least squares by noise in the motion.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::error::IdentifyError;
use crate::estimators::fitted::Fitted;
use crate::estimators::problem::Problem;
use crate::estimators::total::moved_by_noise;
use crate::uncertainty::jackknife::Refit;
use crate::uncertainty::parts::Parts;
use rig_output::{format_p_value, format_significant, format_value};

/// p-value below which a difference is significant.
const SHOWN: f64 = 0.01;
/// Number of standard deviations of the weighted fit below which a difference is immaterial.
const MATERIAL: f64 = 0.5;
/// Largest ratio of a bias to the one expected from the position's spectrum. Above one, because noise may not be white
/// and may pass through the controller.
const AT_MOST: f64 = 5.0;

/// Interpretation of the difference between least squares and instrumental variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Noise in the motion biases least squares.
    Biased,
    /// The difference is not significant.
    NoSign,
    /// The difference is significant but smaller than the estimate's own uncertainty.
    Immaterial,
    /// The difference is larger than the position noise can cause.
    NotNoise,
    /// No result: the instruments are not good enough.
    Undecided,
}

/// Significance of the difference between least squares and instrumental variables, and its interpretation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Endogeneity {
    /// Interpretation.
    pub verdict: Verdict,
    /// p-value of the parameter below, times the number of parameters (Bonferroni).
    pub p_value: f64,
    /// Index in `base_parameters` of the deciding parameter.
    pub parameter: usize,
    /// Difference, instrumental variables minus weighted least squares.
    pub difference: f64,
    /// Its standard deviation.
    pub std: f64,
    /// The same difference in standard deviations of the weighted fit.
    pub shift: f64,
    /// One sentence.
    pub text: String,
}

/// Hausman's test (1978) per parameter: the difference is compared with its own jackknife standard deviation. It
/// requires neither an efficient estimator nor independent rows. A significant difference is bias by noise only if it
/// is material and if the noise in the position's spectrum can cause it. `doubtful` gives the reason why the
/// instruments are too poor for the test.
pub(crate) fn endogeneity(
    problem: &Problem,
    parts: &Parts,
    weighted: &Fitted,
    iv: &Fitted,
    names: &[String],
) -> Result<Option<Endogeneity>, IdentifyError> {
    let difference = difference(&iv.kept, &weighted.kept);
    let size = difference.whole.len();
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
    let decided = Decided {
        verdict,
        name,
        size,
        p_value: p_value(k),
        difference: [difference.whole[k], std(k)],
        shift: shift(k),
        expected,
        doubtful: iv.doubtful.as_deref(),
    };
    Ok(Some(Endogeneity {
        verdict,
        p_value: p_value(k),
        parameter: k,
        difference: difference.whole[k],
        std: std(k),
        shift: shift(k),
        text: decided.text(),
    }))
}

/// Returns the difference a − b of two fits.
fn difference(a: &Refit, b: &Refit) -> Refit {
    let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
    let without = a.without.iter().zip(&b.without);
    Refit {
        whole: minus(&a.whole, &b.whole),
        without: without.map(|(a, b)| minus(a, b)).collect(),
    }
}

/// A verdict with the deciding parameter.
struct Decided<'a> {
    verdict: Verdict,
    name: &'a str,
    /// Number of parameters.
    size: usize,
    p_value: f64,
    /// Difference of the estimates and its standard deviation.
    difference: [f64; 2],
    /// In standard deviations of the weighted fit.
    shift: f64,
    /// Bias that the position's noise would cause, if it was computed.
    expected: Option<f64>,
    /// Reason to doubt the instruments, a clause.
    doubtful: Option<&'a str>,
}

impl Decided<'_> {
    /// Returns one sentence.
    fn text(&self) -> String {
        let Self { name, size, .. } = self;
        let [difference, std] = self.difference;
        let apart = format_value(difference, std);
        let by = format_significant(self.shift.abs(), 2);
        let noise = format_significant(self.expected.unwrap_or(f64::NAN), 2);
        match self.verdict {
            Verdict::Undecided => format!(
                "Whether noise in the motion biases least squares is not known: {}.",
                self.doubtful
                    .unwrap_or("the instruments are not good enough")
            ),
            Verdict::NoSign => format!(
                "Least squares and instrumental variables do not differ by more than chance (smallest p over {size} parameters {:.2}): no sign that noise in the motion biases least squares.",
                self.p_value
            ),
            Verdict::Immaterial => format!(
                "Least squares and instrumental variables differ by more than chance, but by so little that it makes no difference: most in {name}, by {by} of its standard deviation."
            ),
            Verdict::NotNoise => format!(
                "Least squares and instrumental variables differ by more than chance, most in {name} (by {apart}), but the position's noise, as its spectrum shows it, would move that by some {noise} only: it is not noise in the motion that makes the difference, but something that the model lacks."
            ),
            Verdict::Biased => format!(
                "Least squares and instrumental variables differ by more than chance, most in {name} (by {apart}, {by} standard deviations of the weighted fit, p = {} over all {size} parameters): noise in the motion or its way through the controller biases least squares. The position's noise, as its spectrum shows it, moves that by some {noise}.",
                format_p_value(self.p_value)
            ),
        }
    }
}

/// Difference of two estimates, per parameter.
struct Asked<'a> {
    p_value: Vec<f64>,
    /// In standard deviations of the weighted fit.
    shift: Vec<f64>,
    difference: &'a [f64],
}

impl Asked<'_> {
    /// Returns the parameters with a significant and material difference.
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

    /// Judges if the difference is significant and material, with the deciding parameter; the cause is still open.
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

    /// Judges if noise with the expected bias `moved` can cause a material difference.
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

#[cfg(test)]
mod tests {
    use super::*;

    const DIFFERENCE: [f64; 3] = [1e-6, 0.3, -0.2];

    fn asked(p_value: [f64; 3], shift: [f64; 3]) -> Asked<'static> {
        Asked {
            p_value: p_value.into(),
            shift: shift.into(),
            difference: &DIFFERENCE,
        }
    }

    #[test]
    fn a_difference_counts_where_it_is_shown_and_matters() {
        for (p_value, shift, expected) in [
            ([0.3, 1.0, 0.02], [0.1, 3.0, 2.0], (Verdict::NoSign, 2)),
            (
                [1e-9, 1.0, 1e-3],
                [0.0025, 3.0, -0.4],
                (Verdict::Immaterial, 2),
            ),
            (
                [1e-9, 1e-4, 1e-3],
                [0.0025, 3.0, -4.0],
                (Verdict::NotNoise, 2),
            ),
        ] {
            assert_eq!(asked(p_value, shift).by_chance(), expected, "{p_value:?}");
        }
    }

    #[test]
    fn a_difference_is_bias_only_where_noise_can_make_it() {
        let much = asked([1e-9, 1e-4, 1e-3], [0.0025, 3.0, -4.0]);
        for (moved, expected) in [
            // Noise moves only the first; then it moves the second by a fifth of its difference.
            ([1e-6, 0.01, 0.01], (Verdict::NotNoise, 2)),
            ([0.0, -0.061, 0.01], (Verdict::Biased, 1)),
        ] {
            assert_eq!(much.by_noise(&moved), expected, "{moved:?}");
        }
    }
}
