//! Sentences on the torque residuals and on the noise floor.

use crate::outcome::{Diagnosis, Left, Residual, Verdict, Waterfall};
use crate::result::found::Found;
use crate::result::sentences::number::number;
use rig_model::robot::Joint;
use rig_output::{format_significant, format_unit, listed};

/// RMS ratio of the refitted to the unchanged description above which the refit made it worse.
const WORSE: f64 = 1.1;

/// Returns the data that a joint was judged on.
pub(crate) fn data_of(left: &Left) -> &'static str {
    match left.on_holdout {
        true => "the hold-out",
        false => "blocks of the training data left out of the fit in turn",
    }
}

/// Returns a sentence on the residual of each joint's torque.
pub(crate) fn sizes(left: &[Left]) -> Option<String> {
    let first = left.first()?;
    let of = |l: &Left| {
        format!(
            "joint {} {} {} RMS ({} % of {} {} RMS)",
            l.joint,
            format_significant(l.after, 3),
            format_unit(&l.unit),
            format_significant(l.percent_of_torque, 2),
            format_significant(l.torque, 3),
            format_unit(&l.unit)
        )
    };
    let all: Vec<String> = left.iter().map(of).collect();
    Some(format!(
        "Residual of the written model and its share of the recorded torque, on {}: {}.",
        data_of(first),
        all.join("; ")
    ))
}

/// Explains the residuals of the description and of its refit. None if the refit made the hold-out worse, or reduced
/// nothing.
pub fn what_falls(d: &Diagnosis) -> Option<&'static str> {
    // A missing effect may bias parameters so that the refit alone reduces nothing.
    let falls =
        |w: &Waterfall| matches!(w.judged(), [described, refitted, ..] if refitted < described);
    let fallen = d.waterfall.iter().any(falls) && worse_refitted(d).is_none();
    if d.residual != Residual::Torque || !fallen {
        return None;
    }
    match d.verdict {
        Verdict::Explained | Verdict::Remainder => Some(
            "The part of a residual that goes when the parameters are fitted again came from wrong values of the description. The part that stays above the noise floor comes from physics that the model does not have.",
        ),
        Verdict::ParameterChange => Some(
            "The part of a residual that goes when the parameters are fitted again came from wrong values of the description.",
        ),
        Verdict::NothingMissing | Verdict::DataFault => None,
    }
}

/// Gives the RMS of a joint with the unchanged description, with the refitted one, and with the effects. The effects do
/// not count the gain of the refit.
pub(crate) fn fall(d: &Diagnosis, w: &Waterfall) -> Option<String> {
    let [described, refitted, effects @ ..] = w.judged() else {
        return None;
    };
    let on = if w.holdout.is_empty() {
        "on the training data"
    } else {
        "on the hold-out"
    };
    let unit = format_unit(&w.unit);
    let last = match effects.last().filter(|_| !d.steps.is_empty()) {
        Some(last) => format!(
            ", {} with the effect{} found as well",
            number(*last),
            if effects.len() == 1 { "" } else { "s" }
        ),
        None => String::new(),
    };
    Some(format!(
        "The torque residual of joint {} is {} {unit} RMS {on} with the description as it stands, {} with its parameters fitted again{last}; {}.",
        w.joint,
        number(*described),
        number(*refitted),
        match w.judged_floor().is_nan() {
            true => "no noise floor is known".to_owned(),
            false => format!("the noise floor is {} {unit}", number(w.judged_floor())),
        },
    ))
}

/// Lists joints whose hold-out the unchanged description predicts better: the motion did not determine the parameters.
pub(crate) fn worse_refitted(d: &Diagnosis) -> Option<String> {
    let joints: Vec<String> = (d.waterfall.iter())
        // Parameters biased only by the missing effect are right with it.
        .filter(|w| matches!(w.holdout[..], [given, _, ..] if w.holdout[1..].iter().all(|rms| *rms > WORSE * given)))
        .map(|w| w.joint.clone())
        .collect();
    (!joints.is_empty()).then(|| {
        format!(
            "Parameters fitted to the training data predict the hold-out worse than the description does at {}: the training motion does not determine them. Give it livelier motion, or a description by `rig identify`, which weighs what the data leave open.",
            listed(&joints)
        )
    })
}

/// Says how the noise floor was found.
pub(crate) fn floor_how(found: &Found, pairs: &[(usize, usize)]) -> String {
    let runs = found.search.source.runs;
    let figure = |joint: &Joint, floor: f64| match floor.is_nan() {
        true => format!("{} not known", joint.name),
        false => format!(
            "{} {} {}",
            joint.name,
            number(floor),
            format_unit(joint.kind.units().1)
        ),
    };
    let figures: Vec<String> = (found.robot.joints.iter().zip(found.known))
        .map(|(joint, floor)| figure(joint, *floor))
        .collect();
    match pairs.first() {
        Some(&(a, b)) => {
            let more = if pairs.len() > 1 {
                format!(" and {} more pairs", pairs.len() - 1)
            } else {
                String::new()
            };
            format!(
                "What differs between repeated runs of one motion ({} and {}{more}), over √2, after the low-pass: {}.",
                runs[a].label,
                runs[b].label,
                figures.join(", ")
            )
        }
        None => format!(
            "No motion was recorded twice, so the floor is the noise of the torque's reading beyond the band of the motion with that of the positions' reading, a lower limit: {}. It is not known where that noise is not told from the signal.",
            figures.join(", ")
        ),
    }
}
