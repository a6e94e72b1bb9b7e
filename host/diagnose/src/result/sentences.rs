//! Sentences of a diagnosis.

use rig_shared::effects::Kind;
use rig_shared::multibody::{COLUMNS, column};

use crate::acceptance::model_check::sizes;
use crate::columns::transmission::observer::STRETCH;
use crate::columns::waves::{is_of_the_motor, ratio_is_described};
use crate::fit::solution::Solution;
use crate::outcome::{Before, Diagnosis, Remainder, Residual, Step, Verdict, Waterfall};
use crate::recordings::context::DiagnosisContext;
use crate::recordings::external_load;
use crate::result::found::Found;
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::robot::Joint;
use rig_output::{format_significant, format_unit, format_value, listed};

/// Standard deviations above which a parameter has changed.
const MOVED: f64 = 3.0;
/// RMS ratio of the refitted to the unchanged description above which the refit made it worse.
const WORSE: f64 = 1.1;

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
            "What fitting the parameters again takes off a residual had come from wrong values; what it leaves above the noise floor comes from physics that the model does not have.",
        ),
        Verdict::ParameterChange => Some(
            "What fitting the parameters again takes off a residual had come from wrong values.",
        ),
        Verdict::NothingMissing | Verdict::DataFault => None,
    }
}

fn number(x: f64) -> String {
    format_significant(x, 3)
}

fn percent(share: f64) -> String {
    format!("{} %", format_significant(100.0 * share, 3))
}

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
    words.extend(motion(d));
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
        "Without {} the fit had bent its parameters: {} came out as {before} instead of {after} {}.",
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

/// Lists the effects found and their gains.
/// Returns the sentence on an effect that increases the residual of the hold-out.
fn contradicted(step: &Step) -> Option<String> {
    let [before, after] = step.holdout_rms.filter(|_| step.is_contradicted())?;
    Some(format!(
        "The hold-out contradicts {} at joint {}: with it the residual there rises from {} to {} {} RMS. It explains the motions of the training data alone; give a recording like the hold-out with --data.",
        step.effect,
        step.joint,
        number(before),
        number(after),
        format_unit(&step.rms_unit),
    ))
}

fn effects(d: &Diagnosis) -> String {
    let names: Vec<String> = (d.steps.iter())
        .map(|s| {
            let rivals: Vec<String> = (s.set.iter())
                .filter(|name| **name != s.effect)
                .cloned()
                .collect();
            let rivals: Vec<String> = (rivals.into_iter())
                .chain(values_alike(d, s).map(str::to_owned))
                .collect();
            let or = if rivals.is_empty() {
                String::new()
            } else {
                format!(" (or {})", rivals.join(" or "))
            };
            // A joint may have one name several times, with different orders.
            let order = match s.parameters.get("order") {
                Some(order) => format!(" of order {}", format_significant(order.value, 4)),
                None => String::new(),
            };
            format!("{}{order}{or} at joint {}", s.effect, s.joint)
        })
        .collect();
    let held = d.steps.iter().all(|s| s.holdout_rms.is_some());
    let on = if held {
        "on recordings that took no part in the fit"
    } else {
        "on the recordings of the fit; none were held back"
    };
    let share = match (d.gap_closed, d.closed_by_effects()) {
        (_, Some(own)) => format!(
            ", and close {} of the gap that fitting the description again leaves {on}",
            percent(own)
        ),
        (Some(share), None) => format!(", and close {} of the gap {on}", percent(share)),
        (None, None) => String::new(),
    };
    let verb = if names.len() == 1 { "was" } else { "were" };
    format!(
        "{} {verb} missing{}.",
        listed(&names),
        if names.len() == 1 {
            share.replacen("close ", "closes ", 1)
        } else {
            share
        }
    )
}

/// Returns described values that a step's effect is collinear with, in words; None if there are none.
pub fn values_alike(d: &Diagnosis, step: &Step) -> Option<&'static str> {
    let tilt = step.effect == Kind::GravityTilt.about().name;
    // On a prismatic joint a tilt is always a constant.
    let turns = |w: &Waterfall| w.unit != "N";
    let single = matches!(&d.waterfall[..], [only] if turns(only));
    (tilt && single)
        .then_some("a first_moment that points elsewhere in the link, or another zero of q1")
}

/// Explains why a tilt of a single joint is no certain name.
fn tilt_alike(d: &Diagnosis) -> Option<&'static str> {
    (d.steps.iter()).any(|s| values_alike(d, s).is_some()).then_some(
        "Of a single joint a tilted base, a first_moment that points elsewhere in the link and another zero of q1 are one function of the position, and no motion tells them apart: the name takes first_moment and zero to be as described. A spirit level on the base settles it; if it stands level, correct first_moment (`rig identify` finds it) or the zero.",
    )
}

/// Says how an identification treats effects that may be a constant torque.
fn constant(d: &Diagnosis) -> Option<String> {
    let constant = Kind::TorqueOffset.about().name;
    let joints: Vec<String> = (d.steps.iter())
        .filter(|s| s.set.len() > 1 && s.set.iter().any(|name| name == constant))
        .map(|s| s.joint.clone())
        .collect();
    (!joints.is_empty()).then(|| {
        format!(
            "At joint {} a constant torque does as well. `rig identify` fits one as the offset of the joint's friction: a diagnosis that starts from its identified.toml counts it in.",
            listed(&joints)
        )
    })
}

/// Lists significant constant torques that were fitted because the format of the description has none.
pub(crate) fn offsets(context: &DiagnosisContext, after: &Solution) -> Option<String> {
    let base = &context.nominal.base.columns;
    let found: Vec<String> = (context.anchor.free.iter().enumerate())
        .filter(|(k, _)| context.anchor.is_unstated(*k))
        .filter(|(k, _)| after.values[*k].abs() > MOVED * after.std(*k))
        .filter_map(|(k, direction)| {
            let (b, _) = direction.first()?;
            let joint = context.robot.joints.get(base[*b] / COLUMNS)?;
            if base[*b] % COLUMNS != column::OFFSET {
                return None;
            }
            Some(format!(
                "{} {} at joint {}",
                format_value(after.values[k], after.std(k)),
                effort(joint),
                joint.name
            ))
        })
        .collect();
    (!found.is_empty()).then(|| {
        format!(
            "The description has no place for a constant torque, so one was fitted beside each joint's friction, and stands in model.toml as its offset: {}.",
            listed(&found)
        )
    })
}

/// Gives the RMS of a joint with the unchanged description, with the refitted one, and with the effects. The effects do
/// not count the gain of the refit.
fn fall(d: &Diagnosis, w: &Waterfall) -> Option<String> {
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
fn worse_refitted(d: &Diagnosis) -> Option<String> {
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

/// Gives the error of the simulated motion from the refitted description to the last model, on joints with effects.
fn motion(d: &Diagnosis) -> Option<String> {
    let of_joint = |w: &Waterfall| {
        let mut steps = d.steps.iter().filter(|s| s.joint == w.joint);
        let first = steps.next()?;
        let last = steps.next_back().unwrap_or(first);
        let unit = if w.unit == "N" { "mm" } else { "mrad" };
        let [before, after] = [first.motion_rms?[0], last.motion_rms?[1]].map(|x| number(1e3 * x));
        let place = match d.waterfall.len() {
            1 => String::new(),
            _ => format!(" at joint {}", w.joint),
        };
        Some(format!("{after} {unit} RMS{place}, {before} {unit} before"))
    };
    let told: Vec<String> = d.waterfall.iter().filter_map(of_joint).collect();
    (!told.is_empty()).then(|| format!("The simulated motion is off by {}.", told.join("; ")))
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

/// Gives the reason to believe a step.
pub(crate) fn why(found: &Found, step: &Step, profile: &FittedCandidate) -> String {
    let e = &profile.evidence;
    let j = profile.candidate.joint;
    let (unit, floor) = (effort(&found.robot.joints[j]), found.known[j]);
    let unseen = step.holdout_rms.map_or(String::new(), |[before, after]| {
        format!(
            "On the hold-out, which took no part in the fit, the residual of joint {} goes from {} to {} {unit} RMS{}.{} ",
            step.joint,
            number(before),
            number(after),
            match floor.is_nan() {
                true => String::new(),
                false => format!(", with a noise floor of {} {unit}", number(floor)),
            },
            match step.is_contradicted() {
                true => " The effect does not reduce it there: the hold-out contradicts the name.",
                false => "",
            }
        )
    });
    let runner = match (&step.runner_up, step.runner_up_gap_closed) {
        (Some(name), Some(share)) if share.is_finite() => {
            format!(
                " {name}, the next best, would have closed {}.",
                percent(share)
            )
        }
        _ => String::new(),
    };
    let followed = if profile.followed.is_some() {
        let by = match profile.candidate.kind {
            Kind::Backlash => "what was recorded before and in the stretch itself say most likely",
            _ => "the torque recorded before tells",
        };
        format!(
            " In these figures of its residual the torque of the gear is predicted over stretches of half a swing of the link, at least {} ms: twist and speed of the link at their beginning are what {by}.",
            1e3 * STRETCH
        )
    } else {
        String::new()
    };
    let gone = if profile.candidate.kind.is_external()
        && external_load::told_apart(found.search.source.runs)
    {
        " It is not there once everything is taken off that pulls on the joint, by the recordings given with --pulls-off; what of a constant is left there is the rig's own, or that of something left on."
    } else {
        ""
    };
    let rotor = found.robot.joints[j]
        .drive
        .as_ref()
        .map_or(0.0, |d| d.rotor_inertia);
    let load = if profile.candidate.kind == Kind::LoadFriction && rotor == 0.0 {
        " The rotor's inertia is not described, so that its torque counts as load of the gear here: the coefficient comes out too small. Give rotor_inertia in [joint.drive]."
    } else {
        ""
    };
    let own = &found.robot.joints[j];
    let turn = if is_of_the_motor(profile.candidate.kind) && !ratio_is_described(own) {
        format!(
            " No gear ratio of this joint is described, so that its motor's angle is not known and the joint's own stands for it: the wave has {} periods to a turn of the joint. Whether it comes from the motor or the gear, [joint.drive] with gear_ratio would tell.",
            number(profile.shapes[0])
        )
    } else {
        String::new()
    };
    format!(
        "{unseen}On stretches of the training data that it was not fitted to it takes away {} of the RMS beside everything else in the model, {} standard deviations between stretches.{gone}{load}{turn}{runner}{followed}",
        percent(e.gain),
        format_significant(e.gain_sigmas, 2)
    )
}

/// Returns the unit of a joint's effort, as printed.
fn effort(joint: &Joint) -> String {
    format_unit(joint.kind.units().1)
}

/// Says how the noise floor was found.
pub(crate) fn floor_how(found: &Found, pairs: &[(usize, usize)]) -> String {
    let runs = found.search.source.runs;
    let figure = |joint: &Joint, floor: f64| match floor.is_nan() {
        true => format!("{} not known", joint.name),
        false => format!("{} {} {}", joint.name, number(floor), effort(joint)),
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
