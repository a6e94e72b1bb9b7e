//! Torque limits of motions that are checked at samples.

use rig_shared::multibody::{column, inverse_dynamics};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::ExciteError;
use crate::bounds::Bounds;
use crate::instants::Instants;
use rig_model::simulate::{Model, SimulateError};

/// Returns the largest used share of a torque limit at instants of a motion, with full Coulomb friction.
pub(super) fn torque_share(
    model: &Model,
    bounds: &[Bounds],
    instants: &Instants<'_>,
) -> Result<f64, ExciteError> {
    let n = bounds.len();
    let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut rows = model.parameters.clone();
    for row in &mut rows {
        row[column::COULOMB] = 0.0;
    }
    let mut tau = vec![0.0; n];
    let mut share = 0.0_f64;
    // Coulomb friction of the motors also counts in full.
    let width = n * MOTOR_COLUMNS;
    let mut motors = vec![0.0; n * width];
    for k in 0..instants.count() {
        instants.fill(k, &mut q, &mut qd, &mut qdd);
        inverse_dynamics(&model.chain, &rows, &q, &qd, &qdd, &mut tau)?;
        let mut coulomb: Vec<f64> = model
            .parameters
            .iter()
            .map(|row| row[column::COULOMB].abs())
            .collect();
        if let Some(drives) = &model.motors {
            let at = |e| ExciteError::from(SimulateError::from(e));
            let t = &drives.transmission;
            t.motor_columns(&q, &qd, &qdd, &mut motors).map_err(at)?;
            for (c, value) in drives.parameters.as_flattened().iter().enumerate() {
                if c % MOTOR_COLUMNS != motor_column::COULOMB {
                    for (j, torque) in tau.iter_mut().enumerate() {
                        *torque += motors[j * width + c] * value;
                    }
                }
            }
            t.motor_directions(&q, &mut motors[..n * n]).map_err(at)?;
            for (row, own) in motors[..n * n].chunks_exact(n).zip(&drives.parameters) {
                for (sum, along) in coulomb.iter_mut().zip(row) {
                    *sum += (along * own[motor_column::COULOMB]).abs();
                }
            }
        }
        for j in 0..n {
            if let Some(limit) = bounds[j].torque {
                share = share.max((tau[j].abs() + coulomb[j]) / limit);
            }
        }
    }
    Ok(share)
}
