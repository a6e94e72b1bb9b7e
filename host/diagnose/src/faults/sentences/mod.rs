//! Faults of recordings in words.

mod columns;
mod models;
mod names;

pub(crate) use columns::short;
pub(crate) use names::name;

use crate::faults::finding::{Beside, Explanation, Fault};
use crate::faults::physical::Load;
use rig_model::robot::Robot;
use rig_output::format_significant;

/// Returns the fault and its correction, one or more sentences.
pub(crate) fn of(robot: &Robot, fault: &Fault) -> String {
    let text = columns::of(robot, fault.joint.unwrap_or(0), &fault.finding);
    match &fault.beside {
        Beside::Nothing => text,
        Beside::Fault(other) => {
            format!(
                "{text} Another explanation fits as well: {}",
                of(robot, other)
            )
        }
        Beside::NoFault(other) => {
            format!("{text} This is not certain: {}.", explained(robot, *other))
        }
    }
}

/// Returns an explanation without a fault, a clause.
fn explained(robot: &Robot, by: Explanation) -> String {
    let what = match by {
        Explanation::Description => "the description, with friction of its own, explains",
        Explanation::Payload(load) => &format!("{} explains", payload(robot, load)),
        Explanation::OtherMasses => "other masses and friction than described explain",
    };
    format!("{what} these data as well")
}

fn payload(robot: &Robot, load: Load) -> String {
    let last = robot.joints.last().map_or("", |joint| joint.name.as_str());
    let place = robot
        .flange_pose()
        .inverse_transform_point(&load.place.into());
    let [x, y, z] =
        [place.x, place.y, place.z].map(|p| format!("{:.2}", 0.0 + (100.0 * p).round() / 100.0));
    format!(
        "a payload of about {} kg at ({x}, {y}, {z}) m in the frame of joint {last}",
        format_significant(load.mass, 2)
    )
}
