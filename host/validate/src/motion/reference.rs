//! The reference at the start of a recording.

use crate::ValidateError;
use rig_data::prepare::{Recording, first_block};
use rig_data::{Block, JUDGED_ROWS, strange_references};
use rig_model::robot::Robot;

/// Returns the reference of every joint in the first row, where a substitute controller is designed. The inner error is
/// the sentence on why a motion along the references would not be that of the recording.
pub(super) fn first_reference(
    robot: &Robot,
    recording: &dyn Recording,
) -> Result<Result<Vec<f64>, String>, ValidateError> {
    Ok(first_block(recording, JUDGED_ROWS)?.map_or_else(
        || Err("The recording has no rows.".to_owned()),
        |block| of_block(robot, &block),
    ))
}

pub(super) fn no_reference(joint: &str, j: usize) -> String {
    format!(
        "The recording has no reference for joint {joint} (column ref{}).",
        j + 1
    )
}

fn of_block(robot: &Robot, block: &Block) -> Result<Vec<f64>, String> {
    let mut first = Vec::new();
    for (j, (columns, joint)) in block.joints.iter().zip(&robot.joints).enumerate() {
        let value = columns.reference.as_ref().and_then(|r| r.first().copied());
        first.push(value.ok_or_else(|| no_reference(&joint.name, j))?);
    }
    let controlled = |joint: usize| {
        (robot.joints.get(joint.saturating_sub(1))).is_some_and(|j| j.controller.is_some())
    };
    match strange_references(block, robot).into_iter().next() {
        Some(found) if controlled(found.joint()) => Err(format!(
            "A simulated controller cannot follow these references as the robot did: {found}."
        )),
        Some(found) => Err(format!(
            "The description has no [joint.controller], and a stand-in cannot follow these references: {found}."
        )),
        None => Ok(first),
    }
}
