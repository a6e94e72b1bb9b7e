//! Sentences of the verdict.

use crate::outcome::{Before, Diagnosis, Remainder, Verdict};
use crate::result::sentences::effect::{constant, contradicted, effects, tilt_alike};
use crate::result::sentences::motion::motion_error;
use crate::result::sentences::number::number;
use crate::result::sentences::residual::{fall, sizes, what_falls, worse_refitted};
use rig_output::{format_significant, format_unit};

/// Standard deviations above which a parameter has changed.
const MOVED: f64 = 3.0;

/// Returns the verdict with its figures.
pub(crate) fn verdict(d: &Diagnosis, repeated: bool) -> Vec<String> {
    if d.verdict == Verdict::DataFault {
        let n = d.data_faults.len();
        return vec![format!(
            "{n} thing{} about the recordings cannot be, so nothing was fitted.",
            if n == 1 { "" } else { "s" }
        )];
    }
    let mut words = structure(d, repeated);
    if !d.steps.is_empty() {
        words.push(effects(d));
    }
    words.extend(d.steps.iter().filter_map(contradicted));
    words.extend(constant(d));
    words.extend(tilt_alike(d).map(str::to_owned));
    words.extend(d.waterfall.iter().filter_map(|w| fall(d, w)));
    words.extend(sizes(&d.left));
    words.extend(what_falls(d).map(str::to_owned));
    words.extend(worse_refitted(d));
    words.extend(motion_error(d));
    words.extend(d.remainder.as_ref().map(left));
    words.extend(leads(d));
    words.extend(bent(d));
    words
}

/// Says whether the description's structure holds, if no effect was added.
fn structure(d: &Diagnosis, repeated: bool) -> Vec<String> {
    let mut words = Vec::new();
    match d.verdict {
        Verdict::NothingMissing => {
            words.push(
                "With its parameters fitted again the description explains the torque; no effect had to be added."
                    .to_owned(),
            );
            if !repeated {
                words.push(
                    "No motion was recorded twice, so that what comes back in each run is not told from noise. Record the motion again and give both with --data."
                        .to_owned(),
                );
            }
            words.extend(closest(d));
        }
        Verdict::ParameterChange => {
            words.push(
                "The equations of the description hold, but not all of its values.".to_owned(),
            );
        }
        Verdict::Remainder
            if d.steps.is_empty() && d.remainder.as_ref().is_some_and(Remainder::of_a_voltage) =>
        {
            words.push(
                "With its parameters fitted again the description explains the torque; no effect had to be added. The motor's voltage is another matter."
                    .to_owned(),
            );
        }
        Verdict::Explained | Verdict::Remainder | Verdict::DataFault => {}
    }
    words
}

/// Describes the remainder.
fn left(remainder: &Remainder) -> String {
    if remainder.doubt {
        return remainder.text.clone();
    }
    format!(
        "At joint {} {} {} RMS stay without a name; with noise, what is left is {} times the floor.",
        remainder.joint,
        number(remainder.rms),
        format_unit(&remainder.unit),
        format_significant(remainder.ratio, 3)
    )
}

/// Lists the torques that were recorded before or after they act.
fn leads(d: &Diagnosis) -> impl Iterator<Item = String> {
    let pairs = d.torque_lead.iter().zip(&d.waterfall);
    pairs.filter(|(lead, _)| **lead != 0.0).map(|(lead, w)| {
        format!(
            "The torque of joint {} was recorded {} ms {} it acts, less than a sample, as where a controller holds it until its next one; this was taken out first.",
            w.joint,
            number(1e3 * lead.abs()),
            if *lead > 0.0 { "before" } else { "after" },
        )
    })
}

/// Names a parameter that the missing effects had biased.
fn bent(d: &Diagnosis) -> Option<String> {
    if d.steps.is_empty() || d.absorbed_before != Before::WithoutEffects {
        return None;
    }
    let a = d.absorbed.iter().find(|a| a.sigmas >= MOVED)?;
    let [before, after] = apart(a.before, a.after);
    Some(format!(
        "Without {} other parameters of the fit were wrong: {} was {before} instead of {after} {}.",
        if d.steps.len() == 1 { "it" } else { "them" },
        a.parameter,
        format_unit(&a.unit)
    ))
}

/// Formats two numbers with enough digits to distinguish them.
fn apart(a: f64, b: f64) -> [String; 2] {
    let with = |digits| [a, b].map(|x| format_significant(x, digits));
    let differ = |pair: &[String; 2]| pair[0] != pair[1];
    (3..8).map(with).find(differ).unwrap_or_else(|| with(8))
}

/// Names the refused candidate with the largest gain.
fn closest(d: &Diagnosis) -> Option<String> {
    let closest = (d.tried.iter())
        .filter(|t| !t.refused.is_empty())
        .max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    Some(format!(
        "{}, {} at joint {} came closest: {}.",
        match d.tried.len() {
            1 => "Of all effects one had anything to it".to_owned(),
            n => format!("Of {n} effects and places that were tried"),
        },
        closest.effect,
        closest.joint,
        closest.refused
    ))
}
