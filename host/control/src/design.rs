//! Gains for a robot, from the law's own model.

use super::error::ControlError;
use super::law_model::LawModel;
use super::settings::Settings;
use rig_model::simulate::SimulateError;
use rig_shared::control::arm::ControlFault;
use rig_shared::control::arm::pid::PidGains;
use rig_shared::transmission::MotorSpace;

/// Converts a fault of the design, before the motion begins.
pub(crate) fn at_start(fault: ControlFault) -> ControlError {
    match fault {
        ControlFault::Multibody(error) => SimulateError::from(error).into(),
        ControlFault::Transmission(error) => SimulateError::from(error).into(),
        fault => ControlError::Law {
            law: "design",
            time: 0.0,
            fault,
        },
    }
}

/// Returns the largest inertia of each joint over some positions, kg·m² or kg, in joint or in motor coordinates.
pub(crate) fn inertias(
    model: &LawModel,
    positions: &[Vec<f64>],
    of_motors: bool,
) -> Result<Vec<f64>, ControlError> {
    let n = model.parameters.len();
    let mut largest = vec![0.0_f64; n];
    let (mut matrix, mut turned) = (vec![0.0; n * n], vec![0.0; n * n]);
    for q in positions {
        (model.view())
            .inertia_matrix(q, &mut matrix)
            .map_err(at_start)?;
        if let (true, Some(motors)) = (of_motors, &model.motors) {
            let space = MotorSpace::at(&motors.transmission, q, &vec![0.0; n])
                .map_err(SimulateError::from)?;
            (space.inertia_matrix(&matrix, &mut turned)).map_err(SimulateError::from)?;
            matrix.copy_from_slice(&turned);
        }
        for (j, own) in largest.iter_mut().enumerate() {
            *own = own.max(matrix[j * n + j]);
        }
    }
    Ok(largest)
}

/// Returns the gains of the motors' PID.
pub(crate) fn pid(
    model: &LawModel,
    positions: &[Vec<f64>],
    settings: &Settings,
) -> Result<Vec<PidGains<f64>>, ControlError> {
    let gain = |j| PidGains::design(j, settings.bandwidth, settings.damping);
    Ok(inertias(model, positions, true)?
        .into_iter()
        .map(gain)
        .collect())
}
