//! Sentences on the unexplained residual.

use crate::acceptance::lack_of_fit::{Misfit, Times};
use crate::acceptance::model_check::NEARLY_ALL;
use crate::acceptance::unexplained::{RemainderCause, Unexplained};
use crate::outcome::{FloorFrom, Left};
use crate::result::sentences::place;
use crate::result::sentences::residual::data_of;
use rig_model::robot::title_of;
use rig_output::{format_significant, format_unit, format_value};

/// Returns what is left without an explanation, and why, in sentences.
pub(crate) fn text(left: &Unexplained) -> String {
    let (joint, unit) = (&left.joint, format_unit(&left.unit));
    match &left.cause {
        RemainderCause::BeyondFloor {
            beside_effects,
            shown,
        } => format!(
            "{:.0} % more than the noise floor is left in joint {joint} and no {}effect of the library explains it. {}",
            100.0 * (left.ratio - 1.0),
            if *beside_effects { "further " } else { "" },
            shown.as_ref().map_or_else(
                || "It goes with no coordinate of the motion beyond chance.".to_owned(),
                place::text
            ),
        ),
        RemainderCause::ChangedBesides { step, std } => format!(
            "Of joint {joint} {} {unit} more are left on average in the recordings with everything taken off that pulls on it than in the others, and no effect explains that: more than that has changed in between, or the recordings stand in each other's place.",
            format_value(*step, *std),
        ),
        RemainderCause::ChangedBetween {
            step,
            std,
            runs: [a, b],
        } => format!(
            "Of joint {joint} {} {unit} more are left on average in {b} than in {a}, the same motion: a constant has changed in between (a sensor's zero, something that pulls). It counts as noise here and hides what is smaller; record the motion twice without a change.",
            format_value(*step, *std),
        ),
        RemainderCause::Disturbance {
            share,
            count,
            label,
            time: [from, to],
            times,
        } => format!(
            "{:.0} % of the residual's variance of joint {joint} is in {count} stretch{} of half a second, the loudest from {from:.1} to {to:.1} s of {label} with {} times the RMS of the others: something touched the joint or held it there, or that piece of the recording is damaged. Look at it, or record the motion again.",
            100.0 * share,
            if *count == 1 { "" } else { "es" },
            format_significant(*times, 2),
        ),
        RemainderCause::FarAboveReading { residual } => format!(
            "Of joint {joint} {} {unit} are left, {} times what torque and positions vary by from sample to sample. No motion was recorded twice, so nobody knows how much of that is noise: record the training motion again and give both.",
            format_significant(*residual, 3),
            format_significant(left.ratio, 2)
        ),
        RemainderCause::FallsThroughout {
            velocity,
            fastest,
            position_unit,
        } => {
            let speed = format_unit(&format!("{position_unit}/s"));
            format!(
                "The friction of joint {joint} falls with the speed up to {} {speed} or beyond, of {} {speed} that it goes at most. Stribeck friction has fallen long before, unless the motion is too slow to show where it ends (record a faster one): something else that falls with the speed, such as a magnetic brake, has no name here. Coulomb and viscous friction beside it are not told either way.",
                format_significant(*velocity, 3),
                format_significant(*fastest, 3),
            )
        }
        RemainderCause::LackOfFit { names, misfit } => lack_of_fit(joint, names, misfit),
        RemainderCause::OnHoldOut { training_ratio } => on_holdout(left, *training_ratio),
        RemainderCause::NotCarriedOver => format!(
            "Of the data held back the names take nothing off in joint {joint}: they explain the training data alone, and are no more than guesses. Record more to learn from.",
        ),
        RemainderCause::TakenByNone { kind, gain } => format!(
            "The law of {} takes {:.0} % off what is left of joint {joint}, on stretches that it was not fitted to, but not with values that such a rig has: something is missing that has no name here.",
            title_of(*kind),
            100.0 * gain
        ),
        RemainderCause::TooShort {
            fault,
            residual,
            share,
        } => format!(
            "{} The parameters are fitted; of joint {joint} {} {unit} RMS are left, {} % of its torque, and nobody knows whether an effect is missing.",
            fault.text,
            format_significant(*residual, 3),
            format_significant(100.0 * share, 2)
        ),
        RemainderCause::GapOpen { left: worst, named } => gap_open(worst, *named, left.rms),
    }
}

/// Says which free function takes residual away beside the effects `names` of a joint.
fn lack_of_fit(joint: &str, names: &[&str], misfit: &Misfit) -> String {
    let what = format!(
        "a free function of the {}{}",
        misfit.coordinate,
        match misfit.times {
            Times::One => "",
            Times::Direction => ", turned with the direction,",
            Times::Acceleration => ", times the acceleration,",
        }
    );
    let percent = format_significant(100.0 * misfit.gain, 2);
    if names.is_empty() {
        return format!(
            "No effect of the library explains what is left of joint {joint}, but {what} takes {percent} % off it, on stretches that it was not fitted to: something is missing that has no name here."
        );
    }
    format!(
        "With {} in the model {what} still takes {percent} % off what is left of joint {joint}, on stretches that it was not fitted to. The right name would leave it nothing: {} may stand for an effect that the library does not hold.",
        names.join(" and "),
        if names.len() == 1 {
            "this one"
        } else {
            "one of these"
        },
    )
}

/// Says how the hold-out differs from the training data.
fn on_holdout(left: &Unexplained, training_ratio: Option<f64>) -> String {
    let why = match training_ratio {
        Some(here) => format!(
            "the training data at {here:.2} times, where it goes with nothing: what the model is wrong in shows more in the motion held back"
        ),
        None => "the training data are not: they show something that the training data hardly do"
            .to_owned(),
    };
    format!(
        "The data held back are left at {} times the noise floor in joint {}, {why}. Give a recording like them with --data.",
        format_significant(left.ratio, 3),
        left.joint
    )
}

/// Says how much the effects take off a joint's residual, and how much of it, `more`, stays.
fn gap_open(worst: &Left, named: bool, more: f64) -> String {
    let number = |x: f64| format_significant(x, 3);
    let unit = format_unit(&worst.unit);
    let names = match named {
        true => format!(
            "The effects found reduce the residual of joint {} from {} to {} {unit} RMS",
            worst.joint,
            number(worst.before),
            number(worst.after),
        ),
        false => format!(
            "The residual of joint {} is {} {unit} RMS, and no effect of the library reduces it",
            worst.joint,
            number(worst.after)
        ),
    };
    let why = match worst.floor_from {
        FloorFrom::Unknown => "No noise floor is known that no model made: the motion was not recorded twice, and the noise of the torque is not told from its signal. How much of the residual is noise stays open. Record the training motion again and give both".to_owned(),
        from => format!(
            "That is {} times the noise floor of {} {unit}{}, and less than {:.0} % of the gap is closed: {} {unit} RMS stay unexplained",
            number(worst.after / worst.floor),
            number(worst.floor),
            match from {
                FloorFrom::TorqueReading => " (the noise of the torque reading alone, as no motion was recorded twice)",
                _ => "",
            },
            100.0 * NEARLY_ALL,
            number(more),
        ),
    };
    format!("{names}, on {}. {why}.", data_of(worst))
}

#[cfg(test)]
mod tests;
