//! Dry friction of joints and motors as a feed-forward torque.

use super::fault::ControlFault;
use super::model::ArmModel;
use crate::friction::Friction;
use crate::multibody::{MAX_JOINTS, column};
use crate::precompensation::{self, PrecompensationSettings};
use crate::scalar::Real;
use crate::transmission::motor_column;

/// Adds the Coulomb friction that is given as feed-forward, by the rules of [`precompensation`]: the direction is the
/// reference's near rest and the measurement's beyond the threshold. The friction of a motor acts along its own motion,
/// and its threshold is that of its joint times the motor's ratio.
pub(super) fn add_dry_friction<T: Real>(
    model: &ArmModel<'_, T>,
    settings: &PrecompensationSettings<T>,
    q: &[T],
    reference: &[T],
    measured: &[T],
    tau: &mut [T],
) -> Result<(), ControlFault> {
    let dry = |coulomb| Friction {
        coulomb,
        ..Friction::default()
    };
    for (i, (own, row)) in tau.iter_mut().zip(model.parameters).enumerate() {
        let law = dry(row[column::COULOMB]);
        *own += precompensation::torque(settings, &law, reference[i], measured[i], T::ZERO);
    }
    let Some(motors) = &model.motors else {
        return Ok(());
    };
    let n = tau.len();
    let mut along = [T::ZERO; MAX_JOINTS * MAX_JOINTS];
    let along = &mut along[..n * n];
    let (mut wanted, mut actual) = ([T::ZERO; MAX_JOINTS], [T::ZERO; MAX_JOINTS]);
    let t = motors.transmission;
    t.motor_directions(q, along)?;
    t.motor_speeds(q, reference, &mut wanted[..n])?;
    t.motor_speeds(q, measured, &mut actual[..n])?;
    for (k, (row, own)) in along.chunks_exact(n).zip(motors.parameters).enumerate() {
        let ratio = row[k].abs();
        let scaled = PrecompensationSettings {
            velocity_threshold: settings.velocity_threshold * ratio,
            ..*settings
        };
        let law = dry(own[motor_column::COULOMB]);
        let torque = precompensation::torque(&scaled, &law, wanted[k], actual[k], T::ZERO);
        for (entry, &share) in tau.iter_mut().zip(row) {
            *entry += share * torque;
        }
    }
    Ok(())
}
