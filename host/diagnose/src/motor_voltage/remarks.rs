//! Values of a motor by the voltage that differ from the description's.

use crate::fit::solution::Solution;
use crate::motor_voltage::equation::{CURRENT, SPEED};
use crate::motor_voltage::winding::Contradiction;
use rig_model::robot::Robot;

/// Relative difference of back-EMF and torque constant that is reported: magnets and load change them by less.
const CONSTANT_OFF: f64 = 0.05;
/// … and that of the resistance: copper gains 0.39 % a kelvin.
const RESISTANCE_OFF: f64 = 0.25;
/// … in standard deviations.
const SURE: f64 = 5.0;

/// In SI units, back-EMF and torque constant of a brushed motor are equal. With phases this depends on the definitions
/// of voltage and current.
pub(crate) fn constant_off(robot: &Robot, joint: usize, after: &Solution) -> Option<Contradiction> {
    let own = &robot.joints[joint];
    let drive = own.drive.as_ref().filter(|d| d.pole_pairs == Some(0))?;
    let stated = drive.torque_constant;
    differs(
        [after.values[SPEED].abs(), after.std(SPEED)],
        stated,
        CONSTANT_OFF,
    )
}

/// Returns the resistance if it differs from the described.
pub(crate) fn resistance_off(
    robot: &Robot,
    joint: usize,
    after: &Solution,
) -> Option<Contradiction> {
    let own = &robot.joints[joint];
    let stated = own.drive.as_ref()?.resistance?;
    differs(
        [after.values[CURRENT], after.std(CURRENT)],
        stated,
        RESISTANCE_OFF,
    )
}

fn differs([seen, std]: [f64; 2], stated: f64, least: f64) -> Option<Contradiction> {
    let off = (seen - stated).abs();
    (off > least * stated.abs() && off > SURE * std).then_some(Contradiction {
        seen: [seen, std],
        stated,
    })
}
