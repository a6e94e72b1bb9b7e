//! Remarks on a motor whose values by the voltage differ from the description's.

use crate::fit::solution::Solution;
use crate::motor_voltage::equation::{CURRENT, SPEED};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_value};

/// Relative difference of back-EMF and torque constant that is reported: magnets and load change them by less.
const CONSTANT_OFF: f64 = 0.05;
/// … and that of the resistance: copper gains 0.39 % a kelvin.
const RESISTANCE_OFF: f64 = 0.25;
/// … in standard deviations.
const SURE: f64 = 5.0;

/// In SI units, back-EMF and torque constant of a brushed motor are equal. With phases this depends on the definitions
/// of voltage and current.
pub(crate) fn constant_off(robot: &Robot, joint: usize, after: &Solution) -> Option<String> {
    let own = &robot.joints[joint];
    let drive = own.drive.as_ref().filter(|d| d.pole_pairs == Some(0))?;
    let stated = drive.torque_constant;
    let (seen, std) = (after.values[SPEED].abs(), after.std(SPEED));
    differs(seen, std, stated, CONSTANT_OFF).then(|| {
        format!(
            "The back-EMF of joint {}'s motor is {} V·s/rad, its torque constant in the description {} N·m/A; for a brushed motor they are one number, so torques that were computed from the current are {} times as large as stated.",
            own.name,
            format_value(seen, std),
            format_significant(stated, 3),
            format_significant(seen / stated, 3)
        )
    })
}

/// Returns a sentence if the resistance differs from the described.
pub(crate) fn resistance_off(robot: &Robot, joint: usize, after: &Solution) -> Option<String> {
    let own = &robot.joints[joint];
    let stated = own.drive.as_ref()?.resistance?;
    let (seen, std) = (after.values[CURRENT], after.std(CURRENT));
    differs(seen, std, stated, RESISTANCE_OFF).then(|| {
        format!(
            "The winding of joint {}'s motor has {} Ω by its voltage and {} Ω in the description.",
            own.name,
            format_value(seen, std),
            format_significant(stated, 3)
        )
    })
}

fn differs(seen: f64, std: f64, stated: f64, least: f64) -> bool {
    let off = (seen - stated).abs();
    off > least * stated.abs() && off > SURE * std
}
