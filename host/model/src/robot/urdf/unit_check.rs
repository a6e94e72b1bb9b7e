//! Refuses chains that no robot has, with the place in the file.

use std::path::Path;

use super::chain::Chain;
use crate::robot::error::RobotError;
use crate::robot::inertia::negative_inertia;
use crate::robot::serial_robot::Robot;
use crate::robot::unit_check::oversized;

/// Refuses a chain whose links, as `joints` describe them, are larger than any real link.
pub(in crate::robot) fn check_units(
    chain: &Chain,
    robot: &Robot,
    path: &Path,
) -> Result<(), RobotError> {
    // Bodies stand in the order of the chain, joints before followers in a robot.
    let axis_of = |(joint, fault)| {
        let order = robot.links_outwards();
        let axis = order.iter().position(|link| *link == joint);
        (axis.unwrap_or(joint), fault)
    };
    match oversized(&robot.axes()).or_else(|| negative_inertia(robot).map(axis_of)) {
        None => Ok(()),
        Some((axis, fault)) => Err(RobotError::Value {
            path: path.into(),
            place: chain.bodies[axis].place,
            what: fault.what,
            found: fault.found,
            advice: fault.advice,
        }),
    }
}
