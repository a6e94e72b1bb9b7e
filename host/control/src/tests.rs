//! Laws against physics: closed forms, energy, and force balance.
#![allow(clippy::unwrap_used)]

mod contact;
mod passive;
mod sensor;
mod tracking;

use rig_model::robot::Robot;

/// A description that ships with the project.
fn robot(name: &str) -> Robot {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    Robot::load(&folder.join(name)).unwrap()
}

/// An arm with two axes that follow joints, one of them a slide.
const MIMIC: &str = "../../tests/mimic/robot.urdf";

/// The same robot without dry friction, of joints and of motors.
fn slippery(name: &str) -> Robot {
    let mut robot = robot(name);
    for joint in &mut robot.joints {
        if let Some(friction) = &mut joint.friction {
            friction.coulomb = 0.0;
        }
        if let Some(drive) = &mut joint.drive {
            drive.coulomb = 0.0;
        }
    }
    robot
}
