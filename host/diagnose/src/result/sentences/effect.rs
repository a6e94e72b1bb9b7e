//! Sentences on the effects found.

use rig_shared::effects::Kind;

use crate::columns::transmission::observer::STRETCH;
use crate::columns::waves::{is_of_the_motor, ratio_is_described};
use crate::outcome::{Diagnosis, Step, Waterfall};
use crate::recordings::external_load;
use crate::result::found::Found;
use crate::result::sentences::number::{number, percent};
use crate::search::fitted_candidate::FittedCandidate;
use rig_output::{format_significant, format_unit, listed};

/// Lists the effects found and their gains.
pub(crate) fn effects(d: &Diagnosis) -> String {
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
pub(crate) fn tilt_alike(d: &Diagnosis) -> Option<&'static str> {
    (d.steps.iter()).any(|s| values_alike(d, s).is_some()).then_some(
        "Of a single joint a tilted base, a first_moment that points elsewhere in the link and another zero of q1 are one function of the position, and no motion tells them apart: the name takes first_moment and zero to be as described. A spirit level on the base settles it; if it stands level, correct first_moment (`rig identify` finds it) or the zero.",
    )
}

/// Says how an identification treats effects that may be a constant torque.
pub(crate) fn constant(d: &Diagnosis) -> Option<String> {
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

/// Returns the sentence on an effect that increases the residual of the hold-out.
pub(crate) fn contradicted(step: &Step) -> Option<String> {
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

/// Gives the reason to believe a step.
pub(crate) fn why(found: &Found, step: &Step, profile: &FittedCandidate) -> String {
    let e = &profile.evidence;
    let j = profile.candidate.joint;
    let (unit, floor) = (
        format_unit(found.robot.joints[j].kind.units().1),
        found.known[j],
    );
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
