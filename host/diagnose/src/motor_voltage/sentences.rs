//! Results of the motor voltages in words.

use crate::motor_voltage::analysis::{LEAST_SHARE, least_volts};
use crate::motor_voltage::winding::{Contradiction, DeadZone, Lack, Left, Part, Refusal};
use crate::outcome::Place;
use crate::result::sentences;
use rig_output::{format_significant, format_value};

/// Returns a sentence on a joint from whose voltage nothing follows.
pub(super) fn lack(joint: &str, lack: Lack) -> String {
    let why = match lack {
        Lack::ClampedAlone => {
            return format!(
                "The motor voltage of joint {joint} with the joints clamped is not used: it takes that of all other recordings beside it, and a drive of its own."
            );
        }
        Lack::Inseparable => "the motion does not tell resistance and back-EMF apart".to_owned(),
        Lack::Unexplained(left) => format!(
            "resistance and back-EMF leave {} % of its squares unexplained",
            format_significant(100.0 * left, 2)
        ),
        Lack::NotPositive(own) => format!("by it the {} would not be positive", part(own)),
    };
    format!("Nothing is concluded from the motor voltage of joint {joint}: {why}.")
}

/// Returns the name of a coefficient.
fn part(part: Part) -> &'static str {
    match part {
        Part::Resistance => "resistance",
        Part::BackEmf => "back-EMF",
    }
}

/// Returns the name of a coefficient with its motor's.
pub(super) fn of_the_motor(own: Part, joint: &str) -> String {
    format!("{} of the motor of {joint}", part(own))
}

/// Returns the reason why a dead zone is rejected, a clause.
pub(super) fn refusal(refusal: &Refusal) -> String {
    match refusal {
        Refusal::LeftOut => "it was left out".to_owned(),
        Refusal::NoVoltage => "it takes no voltage along the current".to_owned(),
        Refusal::Evidence(why) => sentences::refusal::refusal(why),
        Refusal::Small { volts, share } => format!(
            "{} V, which take {} % of what is left; at least {} V and {} % would be a dead zone",
            format_significant(*volts, 2),
            format_significant(100.0 * share, 2),
            least_volts(),
            100.0 * LEAST_SHARE
        ),
    }
}

/// Returns a sentence on a back-EMF that contradicts the torque constant.
pub(super) fn constant(joint: &str, found: Contradiction) -> String {
    let ([seen, std], stated) = (found.seen, found.stated);
    format!(
        "The back-EMF of joint {joint}'s motor is {} V·s/rad, its torque constant in the description {} N·m/A; for a brushed motor they are one number, so torques that were computed from the current are {} times as large as stated.",
        format_value(seen, std),
        format_significant(stated, 3),
        format_significant(seen / stated, 3)
    )
}

/// Returns a sentence on a resistance that differs from the described.
pub(super) fn resistance(joint: &str, found: Contradiction) -> String {
    let [seen, std] = found.seen;
    format!(
        "The winding of joint {joint}'s motor has {} Ω by its voltage and {} Ω in the description.",
        format_value(seen, std),
        format_significant(found.stated, 3)
    )
}

/// Returns a sentence on a dead zone that was found.
pub(super) fn dead_zone(dead: &DeadZone) -> String {
    let step = &dead.step;
    let held = match step.holdout_rms {
        Some(_) => "on the hold-out",
        None => "on the training data",
    };
    let [before, after] = step.judged().map(|rms| format_significant(rms, 3));
    let std = step.parameters.values().next().map_or(0.0, |v| v.std);
    format!(
        "The inverter of joint {} loses {} V with the sign of the current: what resistance and back-EMF leave of the motor's voltage falls from {before} to {after} V RMS {held}.",
        step.joint,
        format_value(dead.volts, std)
    )
}

/// Returns the reason to believe a dead zone, one sentence.
pub(super) fn why(dead: &DeadZone) -> String {
    let fades = match dead.fade {
        0.0 => String::new(),
        fade => format!(", which fades below {fade} A"),
    };
    let [resistance, _] = dead.moved;
    let [after, std] = resistance.after;
    format!(
        "The voltage follows R·i + L·di/dt + k·ω but for a step where the current changes its sign{fades}, down to a floor of {} V; without the step the resistance had come out as {} Ω instead of {}.",
        format_significant(dead.floor, 3),
        format_significant(resistance.before, 3),
        format_value(after, std),
    )
}

/// Returns a sentence on a described effect that is fitted again.
pub(super) fn fitted_again(effect: &str, joint: &str) -> String {
    format!(
        "The description's {effect} of joint {joint} stays, fitted again to the motor's voltage."
    )
}

/// Returns sentences on the unexplained remainder.
pub(super) fn left(left: &Left) -> String {
    let where_to = (left.place.as_ref())
        .map_or("It goes with neither current nor speed alone.", |place| {
            place.text.as_str()
        });
    format!(
        "Of the motor's voltage at joint {} {} V RMS are left that are no noise, and no effect of the library explains them. {where_to} The inverter may be the cause, or a sensor whose current stands for the torque: then the torque is bent as well. Nothing else is concluded from this voltage.",
        left.joint,
        format_significant(left.rms, 3),
    )
}

/// Returns the sentence of a place of the voltage.
pub(super) fn place(place: &Place) -> String {
    format!("Of the motor's voltage: {}", place.text)
}
