//! Sentences on the described effects.

use crate::description::fate::{DescribedFate, FateCause, HeldBecause, StatedParameter};
use rig_model::robot::title_of;
use rig_output::{format_significant, format_unit};

/// Says what becomes of a described effect on a joint of this name.
pub(crate) fn fate(own: &DescribedFate, joint: &str) -> String {
    let what = format!("{} of joint {joint}", title_of(own.kind));
    match &own.cause {
        FateCause::InTheLink => format!(
            "The description's payload on joint {joint} counts as part of its link, where model.toml has it."
        ),
        FateCause::Held { why, taken_off } => format!(
            "The description's {what} is held as stated{}: {}.",
            if *taken_off {
                ", and was taken off the recordings"
            } else {
                ""
            },
            held_because(*why)
        ),
        FateCause::FittedAgain { changed } => format!(
            "The description's {what} stays, fitted again together with everything else.{}",
            what_changed(changed)
        ),
        FateCause::Dropped {
            stated,
            replaced_tilt,
        } => {
            let values: Vec<String> = (stated.iter())
                .map(|p| format!("{} {} {}", p.name, format_significant(p.stated, 3), p.unit))
                .collect();
            format!(
                "The description's {what} ({}) is not in model.toml: beside everything else that these recordings show it does not stand as stated.{}",
                values.join(", "),
                match replaced_tilt {
                    true => " What they show of a tilt is in the direction of gravity.",
                    false => "",
                }
            )
        }
    }
}

/// Returns the reason to hold an effect, a clause.
fn held_because(why: HeldBecause) -> &'static str {
    match why {
        HeldBecause::DirectionOfGravity => {
            "what is fitted of a tilt is the direction of gravity, which the description states beside it"
        }
        HeldBecause::VoltageAlone => "it shows in the motor's voltage alone",
        HeldBecause::NoTemperature => "the temperature was not recorded throughout",
        HeldBecause::LeftOut => "it was left out of the search",
        HeldBecause::WithinSampling => {
            "it is no longer than what the instants of sampling may make of it"
        }
        HeldBecause::Collinear => {
            "along this motion its torque is a combination of what other parameters give"
        }
        HeldBecause::NotShown => "these recordings neither show nor contradict it",
        HeldBecause::NotFittedToVoltage => {
            "it takes part in the simulation, and is not fitted to a voltage"
        }
        HeldBecause::NotSimulated => {
            "the simulation of a joint that its voltage drives does not have it"
        }
    }
}

/// Lists changed values, with a space before; empty if none changed.
fn what_changed(changed: &[(StatedParameter, f64)]) -> String {
    let list: Vec<String> = (changed.iter())
        .map(|(p, value)| {
            let unit = match p.unit.as_str() {
                "1" => String::new(),
                unit => format!(" {}", format_unit(unit)),
            };
            let [from, to] = [p.stated, *value].map(|x| format_significant(x, 4));
            format!("{} from {from} to {to}{unit}", p.name)
        })
        .collect();
    match list.as_slice() {
        [] => String::new(),
        list => format!(" Changed: {}.", list.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changed_of_an_effect_is_said_with_both_values() {
        let parameter = |name, stated, unit: &str| StatedParameter {
            name,
            stated,
            unit: unit.into(),
        };
        assert_eq!(what_changed(&[]), "");
        let changed = [
            (parameter("cosine", 0.2, "N*m"), 0.3),
            (parameter("order", 9.0, "1"), 12.0),
        ];
        assert_eq!(
            what_changed(&changed),
            " Changed: cosine from 0.2000 to 0.3000 N·m, order from 9.000 to 12.00."
        );
    }
}
