//! PD feedback with feed-forward of inertia, gravity, offset and friction.
//!
//! τ = kp·e + kd·ė + J·q̈r + g(q) + off + friction. Gravity is taken at the measured position, so that the fixed point
//! is stable for any gains (Takegaki and Arimoto 1981). The friction part is that of [`precompensation`]. Without it
//! the feedback has to overcome friction.

use super::config::Config;
use super::{Measured, Torque};
use crate::precompensation;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// Returns the joint torque for one tick; `feedforward` is a known torque in addition to the model, N·m.
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    measured: Measured<T>,
    reference: Reference<T>,
    feedforward: T,
) -> Torque<T> {
    let model = &config.model;
    let feedback = config.gains.proportional * (reference.position - measured.position)
        + config.gains.derivative * (reference.velocity - measured.velocity);
    let load = model.inertia * reference.acceleration + model.gravity_torque(measured.position);
    let friction = precompensation::torque(
        &config.precompensation,
        &config.friction,
        reference.velocity,
        measured.velocity,
        load,
    );
    let unlimited = feedback + load + model.offset + friction + feedforward;
    Torque::saturated(config.torque_limit, unlimited, friction)
}
