//! Results of a voltage-driven diagnosis in words.

use crate::faults::sentences::name;
use crate::voltage::controllers::{Driven, Shown};
use crate::voltage::faults::{FEWEST_STEPS, FEWEST_WINDOWS, VoltageUnit, Wrong};
use crate::voltage::fit::WINDOW;
use crate::voltage::free_run::FreeRun;
use crate::voltage::halt::Cause;
use crate::voltage::search::Refusal;
use rig_model::robot::VoltageController;
use rig_output::{format_significant, format_trimmed};
use rig_shared::effects::Kind;

/// Method of the noise floor, a sentence.
pub(super) const FLOOR: &str = "The encoder's smallest step over √12, of the position: a lower bound, as no repeated runs are compared here.";
/// Remark on effects on the voltage, a sentence.
pub(super) const VOLTAGE_OR_FRICTION: &str = "An effect on the voltage and friction at rest can pass for each other; a measured current would tell.";

impl From<Cause> for &'static str {
    fn from(cause: Cause) -> Self {
        match cause {
            Cause::LeftTravel => {
                "the simulated position is further from the recorded one than the joint travels in the recordings"
            }
            Cause::Unbounded => "the simulated motion grows without bounds",
            Cause::DrivingFriction => "the friction with its effects would drive the joint",
        }
    }
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str((*self).into())
    }
}

/// Returns a fault of a recording and its correction.
pub(super) fn fault(wrong: &Wrong) -> String {
    match wrong {
        Wrong::Implausible(problem) => format!("{problem}."),
        Wrong::TooShort { duration } => format!(
            "The recordings give {duration:.2} s of motion; without torque or current at least {} s are needed.",
            FEWEST_WINDOWS * WINDOW
        ),
        Wrong::Still => format!(
            "The joint does not move by {FEWEST_STEPS} steps of its encoder; record a motion, or check that the position column is alive."
        ),
        Wrong::Turned => "u1 drives the joint against its sense: the torque per volt comes out negative. Turn the sign of u1 (or of the duty cycle), or that of q1.".into(),
        Wrong::Dead => "u1 is 0 in every row while the joint moves; check that the column is the motor's voltage and was recorded.".into(),
        Wrong::Supply { low, high } => {
            let [low, high] = [low, high].map(|x| format_trimmed(*x, 4));
            let stays = match low == high {
                true => format!("at {low} V"),
                false => format!("between {low} and {high} V"),
            };
            format!(
                "u1 stays {stays} while the joint turns both ways: it looks like the supply. Give the voltage at the motor, or the duty cycle as duty1 with the supply as supply."
            )
        }
        Wrong::PositionScaled {
            factor,
            name: named,
            left,
        } => {
            let [recorded, own] = left.map(|share| format_significant(100.0 * share, 2));
            format!(
                "q1 fits its voltage {} times as large (the model then leaves {own} % of the voltage's squares, as recorded {recorded} %): {}.",
                format_trimmed(*factor, 4),
                name(named)
            )
        }
        Wrong::VoltageScaled { unit, emf } => {
            let [what, mend] = match unit {
                VoltageUnit::Milli => ["u1 looks like mV", "give it in V"],
                VoltageUnit::Kilo => ["u1 looks like kV", "give it in V"],
                VoltageUnit::Centi => ["u1 looks like hundredths of a volt", "give it in V"],
                VoltageUnit::Duty => [
                    "u1 looks like a duty cycle",
                    "give it in V, or name it duty1 with the supply as supply",
                ],
                VoltageUnit::Unknown => [
                    "u1 is no voltage of the described drive",
                    "check its unit (V; a duty cycle is duty1 with the supply as supply), the torque constant and the gear ratio",
                ],
            };
            let [found, stated] = emf.map(|x| format_significant(x, 3));
            format!(
                "{what}: the back-EMF comes out at {found} V·s/rad, where the description's torque constant and gear ratio make {stated}; {mend}."
            )
        }
        Wrong::Late { by, left } => {
            let [recorded, own] = left.map(|share| format_significant(100.0 * share, 2));
            let [word, mend] = match *by > 0.0 {
                true => ["behind", "earlier"],
                false => ["ahead of", "later"],
            };
            format!(
                "u1 is {} s {word} q1: moved that much {mend}, the model leaves {own} % of its squares, as recorded {recorded} %; give both by one clock.",
                format_significant(by.abs(), 2)
            )
        }
        Wrong::Magnitude { left } => {
            let [recorded, own] = left.map(|share| format_significant(100.0 * share, 2));
            let compared = match left[1] < left[0] {
                true => format!(
                    " (with the sense of the motion the model leaves {own} % of its squares, as recorded {recorded} %)"
                ),
                false => String::new(),
            };
            format!(
                "u1 is never negative though the joint turns both ways: it is a magnitude whose sign was lost{compared}. Record the signed voltage."
            )
        }
    }
}

/// Returns the reason why a tried effect is rejected, a clause.
pub(super) fn refusal(refusal: Refusal) -> String {
    match refusal {
        Refusal::NotSimulated => "cannot be simulated with these parameters".into(),
        Refusal::FitsWorse => "others take away more".into(),
        Refusal::Another => "another takes away more".into(),
        Refusal::Chance { wins, pieces } => format!(
            "helps in {wins} of {pieces} pieces of recordings not fitted to, which may be chance"
        ),
        Refusal::Small => {
            "takes less than 3 % off the motion of recordings it was not fitted to".into()
        }
        Refusal::AfterChance => "one that fits better may be chance".into(),
    }
}

/// Returns a remark on a described effect that the simulation lacks.
pub(super) fn left_out(kind: Kind) -> String {
    format!(
        "{} of the description is not part of the simulation of a joint under voltage.",
        kind.about().title
    )
}

/// Returns the voltage that drives the model, a clause.
fn voltage(driven: Driven) -> String {
    let law = "given by the controller that each recording shows, within the supply";
    let Driven { closed, all } = driven;
    match closed {
        0 => "as it was recorded".into(),
        _ if closed == all => law.into(),
        _ => format!("{law} in {closed} of {all} recordings and as it was recorded in the others"),
    }
}

/// Returns the method of the simulation, a sentence.
pub(super) fn motion(driven: Driven) -> String {
    format!("The motor voltage drives each model, {}.", voltage(driven))
}

/// Returns sentences on the free runs of the first and the last model. `controllers` is true if the recordings show
/// their controllers, `unit` is rad or m.
pub(super) fn summary(
    driven: Driven,
    [first, last]: [&FreeRun; 2],
    on_holdout: bool,
    controllers: bool,
    unit: &str,
) -> String {
    let on = match on_holdout {
        true => "the recordings held back",
        false => "the recordings it was fitted to",
    };
    let run = match last {
        FreeRun::Diverged { .. } => diverged(last, controllers),
        FreeRun::Followed {
            rms, mean_absolute, ..
        } => format!(
            "On {on} it is off by {} (RMS; {} in the mean of the absolute error); before any effect {}.",
            thousandths(*rms, unit),
            thousandths(*mean_absolute, unit),
            match first.rms() {
                Some(rms) => format!("it was off by {}", thousandths(rms, unit)),
                None => "the free run diverged".to_owned(),
            }
        ),
    };
    format!(
        "No torque or current was recorded: the model was driven by the motor voltage, {}, from the first row of each recording to its last, and its position was compared. {run}",
        voltage(driven)
    )
}

/// Returns sentences on where and why a run diverged; empty if it did not.
fn diverged(run: &FreeRun, controllers: bool) -> String {
    let FreeRun::Diverged {
        recording,
        time,
        why,
    } = run
    else {
        return String::new();
    };
    let mend = match controllers {
        false => {
            "Record the reference (ref1) as well, so that the loop can be closed, or give shorter recordings."
        }
        true => {
            "The motion asks more of the drive than the training recordings; give a recording of such a motion to learn from."
        }
    };
    format!(
        "The free run diverges in {recording} at {time:.2} s: {why}. It says nothing of the model. {mend}"
    )
}

/// Returns a warning on a run over one recording, if it diverged.
pub(super) fn diverged_alone(run: &FreeRun) -> Option<String> {
    match run {
        FreeRun::Followed { .. } => None,
        FreeRun::Diverged {
            recording,
            time,
            why,
        } => Some(format!(
            "{recording}: the free run diverges at {time:.2} s: {why}. Its errors say nothing of the model."
        )),
    }
}

/// Returns sentences on the residual of the last model; `floor` in rad or m, the rest as for [`summary`].
pub(super) fn left_over(last: &FreeRun, floor: f64, controllers: bool, unit: &str) -> String {
    match last.rms() {
        None => diverged(last, controllers),
        Some(rms) => format!(
            "The simulated position is off by {}, {:.0} times the encoder's noise; no further effect helps recordings that it was not fitted to. A recording with the current, or the same motion twice, would say how much of it is the model's.",
            thousandths(rms, unit),
            rms / floor.max(f64::MIN_POSITIVE)
        ),
    }
}

/// Returns the reason to believe an effect, by the errors on left-out recordings with it and before.
pub(super) fn why(with: f64, before: f64, unit: &str) -> String {
    format!(
        "The simulated position of recordings that it was not fitted to is off by {} with it, {} before.",
        thousandths(with, unit),
        thousandths(before, unit)
    )
}

/// Returns a sentence on a rotor whose described inertia, kg·m², is more than the drive's.
pub(super) fn rotor(stated: f64, found: f64) -> String {
    let [stated, found] = [stated, found].map(|x| format_significant(x, 3));
    format!(
        "The rotor's inertia of {stated} kg·m² in the description is more than the motion shows of the drive, {found} kg·m², which stands in model.toml."
    )
}

/// Formats a position error.
fn thousandths(error: f64, unit: &str) -> String {
    format!("{:.2} m{unit}", 1e3 * error)
}

/// Returns a controller in words: its terms with their gains. `unit` is rad or m.
pub fn terms(c: &VoltageController, unit: &str) -> String {
    let mut list = vec![format!(
        "proportional {} 1/{unit}",
        format_significant(c.proportional, 3)
    )];
    for (name, gain, per) in [
        ("integral", c.integral, format!("1/({unit}·s)")),
        ("derivative", c.derivative, format!("s/{unit}")),
        (
            "velocity feed-forward",
            c.velocity_feedforward,
            format!("s/{unit}"),
        ),
        (
            "acceleration feed-forward",
            c.acceleration_feedforward,
            format!("s²/{unit}"),
        ),
    ] {
        if gain != 0.0 {
            list.push(format!("{name} {} {per}", format_significant(gain, 3)));
        }
    }
    list.join(", ")
}

/// Returns sentences on the recordings' controllers and supply; empty if they show none.
pub(super) fn controllers(list: &[Shown], unit: &str) -> Vec<String> {
    let Some(first) = list.first() else {
        return Vec::new();
    };
    let each: Vec<String> = (list.iter())
        .map(|shown| {
            let s = if shown.count == 1 { "" } else { "s" };
            format!(
                "{} ({} recording{s})",
                terms(&shown.controller, unit),
                shown.count
            )
        })
        .collect();
    let [none, slope] = first.controller.supply.map(|x| format_significant(x, 3));
    let mut words = vec![format!(
        "The recordings show this controller, its output a share of the supply: {}. The supply is {none} V without load and changes by {slope} V up to a share of one.",
        each.join("; ")
    )];
    if list.len() > 1 {
        words.push(format!(
            "model.toml has the controller with {}; change [joint.voltage_controller] to simulate another.",
            terms(&first.controller, unit)
        ));
    }
    words
}
