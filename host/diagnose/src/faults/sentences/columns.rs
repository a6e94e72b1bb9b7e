//! Faults that columns show by themselves, in words.

use super::{models, names};
use crate::faults::columns::{FEWEST, LEAST_TO_JUDGE, LEAST_TO_LEARN, SHORTEST};
use crate::faults::finding::{Finding, Short};
use rig_data::{Implausible, sign_of_steps, unit_of_steps};
use rig_model::robot::Robot;
use rig_output::format_short;

/// Returns a sentence on recordings that are too short.
pub(crate) fn short(found: &Short) -> String {
    match *found {
        Short::Recording { rows, time } => format!(
            "The recording holds {rows} rows, {time:.2} s; at least {FEWEST} rows and {SHORTEST} s are needed, half a minute with reversals would be right."
        ),
        Short::Training {
            unburdened,
            time,
            moving,
        } => {
            let what = match unburdened {
                true => "recordings with everything taken off",
                false => "training data",
            };
            let held = match moving {
                None => format!("{time:.2} s in all"),
                Some(moving) => format!(
                    "{moving:.1} s of motion beyond the noise and the steps of its position, in {time:.1} s"
                ),
            };
            format!(
                "The {what} hold {held}; names are not learnt from less than {LEAST_TO_LEARN} s, and half a minute with reversals would be right."
            )
        }
        Short::Holdout { moving } => format!(
            "The recordings held back hold {moving:.2} s of motion beyond the noise and the steps of its position; nothing is judged by less than {LEAST_TO_JUDGE} s, and half a minute with reversals would be right."
        ),
    }
}

/// Returns a sentence on an implausible time column.
fn clock(problem: &Implausible) -> String {
    let Implausible::NotSeconds { step } = problem else {
        return format!("{problem}.");
    };
    let unit = unit_of_steps(*step);
    let sign = sign_of_steps(*step);
    format!(
        "t looks like {unit}: its steps are {}, where seconds would be right; give --unit t={sign}.",
        format_short(*step)
    )
}

/// Returns a sentence on the columns of the joint `j` (from 0), or on the recording.
pub(super) fn of(robot: &Robot, j: usize, found: &Finding) -> String {
    let n = j + 1;
    let unit = robot.joints.get(j).map_or("", |own| own.kind.units().0);
    match found {
        Finding::NoMotion => "No joint moves by more than the noise of its encoder; record a motion, or check that the position column is alive.".to_owned(),
        Finding::Short(found) => short(found),
        Finding::Clock(problem) => clock(problem),
        Finding::Column(problem, _) => format!("{problem}."),
        Finding::Fit(misfit) => models::of(robot, j, misfit),
        Finding::VelocityReversed => format!(
            "qd{n} has the opposite sign of the change of q{n} over time; reverse one of them."
        ),
        Finding::VelocityScaled {
            factor,
            name,
            of_position,
        } => {
            let what = match name.as_ref().map(names::name) {
                Some(name) if *of_position => format!("of q{n}, {name}"),
                Some(name) => format!("qd{n} looks like {name}; give it in {unit}/s"),
                None => format!(
                    "give it in {unit}/s, and check the gear ratio, the counts of the encoder and the clock"
                ),
            };
            format!(
                "qd{n} is {} times the change of q{n} over time; {what}.",
                format_short(1.0 / factor)
            )
        }
        Finding::AtLimit { limit, share } => format!(
            "tau{n} stands at its limit of {limit} for {:.0} % of the time in motion; record a motion that needs less.",
            100.0 * share
        ),
        Finding::LinkJumps => format!(
            "ql{n} jumps from one row to the next, as where counts are lost or an angle begins again after a turn; give it unwrapped."
        ),
        Finding::LinkStill => format!(
            "ql{n} stands still while q{n} moves; check that the encoder on the link is alive."
        ),
        Finding::LinkReversed => format!("ql{n} moves against q{n}; reverse its sense."),
        Finding::LinkScaled { factor, name } => {
            let what = name.as_ref().map_or_else(
                || format!("give it in {unit} of the joint, and check its counts"),
                names::name,
            );
            format!("ql{n} moves {} times as far as q{n}; {what}.", format_short(*factor))
        }
    }
}
