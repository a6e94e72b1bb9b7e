//! Standard parameters as a description.

use nalgebra::DVector;
use rig_shared::multibody::COLUMNS;
use rig_shared::transmission::MOTOR_COLUMNS;

use rig_model::robot::Robot;

/// Returns the description with these standard parameters.
pub(crate) fn written(
    robot: &Robot,
    pi: &DVector<f64>,
    mut remarks: Vec<String>,
) -> (Robot, Vec<String>) {
    let links = robot.link_count() * COLUMNS;
    let (joints, motors) = pi.as_slice().split_at(links);
    let mut motors = motors.to_vec();
    motors.resize(robot.joints.len() * MOTOR_COLUMNS, 0.0);
    let (result, said) = robot.with_parameters(
        joints.as_chunks::<COLUMNS>().0,
        motors.as_chunks::<MOTOR_COLUMNS>().0,
    );
    remarks.extend(said);
    (result, remarks)
}
