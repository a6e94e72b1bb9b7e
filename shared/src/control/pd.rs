//! PD feedback with feed-forward of inertia, gravity, offset and friction.
//!
//! τ = kp·e + kd·ė + J·q̈r + g(q) + off + friction, gravity at the measured position so that the fixed point is
//! stable whatever the gains (Takegaki and Arimoto 1981). The friction part is that of
//! [`precompensation`]; without it the model's friction is left to the feedback.

use super::law::Config;
use super::{Measured, Torque};
use crate::precompensation;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// Joint torque for one tick; `feed` is known beside the model, N·m.
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    measured: Measured<T>,
    reference: Reference<T>,
    feed: T,
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
    let wish = feedback + load + model.offset + friction + feed;
    Torque::within(config.torque_limit, wish, friction)
}
