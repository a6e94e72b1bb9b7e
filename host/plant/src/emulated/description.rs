//! The description that the owner of an emulated rig has.

use std::path::Path;

use crate::PlantConfig;
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot, RobotError};

/// Returns the shipped description with the torque constant, resistance and inductance of this motor's nameplate.
/// Masses, inertia and friction keep the guesses of the description.
///
/// A wrong torque constant scales every torque by the same factor and is not identifiable from torque and motion, so
/// it is taken from the nameplate.
///
/// # Errors
/// The shipped description cannot be read.
pub fn description_of(plant: &PlantConfig) -> Result<Robot, RobotError> {
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml"))?;
    for drive in robot
        .joints
        .iter_mut()
        .filter_map(|joint| joint.drive.as_mut())
    {
        drive.torque_constant = plant.motor.torque_constant;
        drive.resistance = Some(plant.motor.resistance);
        drive.inductance = Some(plant.motor.inductance);
    }
    Ok(robot)
}
