//! Results of the link encoder in words.

use rig_shared::effects::Kind;

use crate::link_encoder::law::{Law, Refusal};
use crate::link_encoder::reading::{GearReading, Reading};
use crate::link_encoder::result::Named;
use crate::outcome::Place;
use rig_model::robot::{Joint, JointKind};
use rig_output::{format_significant, format_unit, format_value};

/// Returns the reason why a law is rejected, a clause.
pub(super) fn refusal(refusal: Refusal) -> String {
    let why = match refusal {
        Refusal::Another => return "another takes away more across the transmission".to_owned(),
        Refusal::Chance { p_value, trials } => {
            format!("p = {p_value:.2}, corrected for {trials} trials")
        }
        Refusal::LittleGain { gain, least } => format!(
            "it takes away {:.1} % of what is left, less than {:.0} %",
            100.0 * gain,
            100.0 * least
        ),
        Refusal::Uncertain { sigmas } => {
            format!("its gain is only {sigmas:.1} of its standard deviations")
        }
        Refusal::Shadow => "it is no more than what another law is off by".to_owned(),
        Refusal::Unresolved { size, least } => {
            let [size, least] = [size, least].map(|own| format_significant(own, 2));
            format!("its {size} are less than two steps of the encoders, {least}")
        }
    };
    format!("across the transmission {why}")
}

/// Returns the reason to believe a law, sentences.
pub(super) fn why(joint: &Joint, named: &Named) -> String {
    let [before, after] = named.step.judged().map(|x| length(joint, x));
    let how = match named.law {
        Law::Twist => "goes with the torque on the gear",
        Law::Play(_) => "changes from one value to another with the sign of the torque on the gear",
        Law::Wave(_) => "repeats with the motor's angle",
    };
    let on = match named.step.holdout_rms {
        Some(_) => "on the hold-out",
        None => "on the training data",
    };
    format!(
        "What the encoder on the link reads apart from the joint's own {how}: beside everything else the law takes it from {before} to {after} RMS {on}, at a floor of {}. No friction of the motor can do that.",
        length(joint, named.floor)
    )
}

/// Returns sentences on joint `n` (from 1), whether or not a law was found.
pub(super) fn reading(joint: &Joint, n: usize, reading: &Reading) -> Vec<String> {
    let name = &joint.name;
    let [before, after] = reading.rms.map(|x| length(joint, x));
    let floor = length(joint, reading.floor);
    let mut words = vec![match &reading.gear {
        None => format!(
            "The encoder on the link of joint {name} shows neither twist nor play of the transmission: beside constant, scale and instant it reads {after} RMS apart from the joint's own, at a floor of {floor}. What the torque shows at reversals is friction."
        ),
        Some(found) => format!(
            "The encoder on the link of joint {name} shows {}: what it reads apart from the joint's own falls from {before} to {after} RMS, at a floor of {floor}.{}",
            gear(joint, found),
            match (found.kind, found.gives) {
                (Kind::Backlash, true) =>
                    " Closed teeth are stiffer than that: something gives beside them, and the stiffness is that of both.",
                _ => "",
            }
        ),
    }];
    words.extend(reading.scale.map(|scale| {
        format!(
            "By it the joint moves {} times as far as q{n} says; check gear ratio and counts.",
            format_significant(1.0 / (1.0 + scale), 5)
        )
    }));
    words.extend(reading.waves.iter().map(|[amplitude, order]| {
        format!(
            "What the two encoders of joint {name} read apart has a wave of {}, {order} to a turn of the joint: one of them, or the gear's last stage, is off its axis; nothing tells which.",
            length(joint, *amplitude)
        )
    }));
    words
}

/// Returns play and stiffness of a gear, a noun with its complements.
fn gear(joint: &Joint, gear: &GearReading) -> String {
    let (p, f) = joint.kind.units();
    let value = |k: usize, unit: &str| {
        let [value, std] = gear.values[k];
        let value = if std.is_finite() {
            format_value(value, std)
        } else {
            format!("more than {}", format_significant(value, 2))
        };
        format!("{value} {unit}")
    };
    let per = format_unit(&format!("{f}/{p}"));
    match gear.kind {
        Kind::Backlash => format!(
            "a play of {} behind a stiffness of {}",
            value(0, p),
            value(1, &per)
        ),
        _ => format!("a stiffness of {} without play", value(0, &per)),
    }
}

/// Returns the sentence of a place of q − ql.
pub(super) fn place(place: &Place) -> String {
    format!("Of what the two encoders read apart: {}", place.text)
}

/// Returns a sentence on a described effect that is fitted again.
pub(super) fn fitted_again(effect: &str, joint: &str) -> String {
    format!(
        "The description's {effect} of joint {joint} stays, fitted again to what the encoder on the link reads."
    )
}

/// Formats a small length or angle.
fn length(joint: &Joint, x: f64) -> String {
    let unit = match joint.kind {
        JointKind::Revolute => "mrad",
        JointKind::Prismatic => "mm",
    };
    format!("{} {unit}", format_significant(1e3 * x, 3))
}
