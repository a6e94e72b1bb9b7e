//! Computed torque: the model turns a wanted acceleration into a torque.
//!
//! τ = J·(q̈r + kd/J₀·ė + kp/J₀·e) + g(q) + fv·q̇ + off + friction (Craig 1986; Khalil and Dombre 2002, sec. 14.4).
//! J₀ is the inertia that the gains were designed for, so the error obeys the designed poles also after the
//! model's inertia has changed (an estimate taken over, a payload).
//!
//! The viscous part is the model's, at the measured velocity, and the precompensation adds the dry friction
//! alone; with precompensation off there is no dry friction in the torque.

use super::law::Config;
use super::{Measured, Torque};
use crate::friction::Friction;
use crate::precompensation;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// Joint torque for one tick; `feed` is known beside the model, N·m. `design_inertia` must be above zero.
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    measured: Measured<T>,
    reference: Reference<T>,
    feed: T,
) -> Torque<T> {
    let model = &config.model;
    let acceleration = reference.acceleration
        + (config.gains.proportional * (reference.position - measured.position)
            + config.gains.derivative * (reference.velocity - measured.velocity))
            / config.design_inertia;
    let gravity = model.gravity_torque(measured.position);
    let load = model.inertia * acceleration + gravity;
    // The feedback part would carry measurement noise into the load: the planned load decides friction.
    let planned = model.inertia * reference.acceleration + gravity;
    let dry = Friction {
        viscous: T::ZERO,
        viscous_asymmetry: T::ZERO,
        ..config.friction
    };
    let friction = precompensation::torque(
        &config.precompensation,
        &dry,
        reference.velocity,
        measured.velocity,
        planned,
    );
    let wish = load + model.viscous * measured.velocity + model.offset + friction + feed;
    Torque::within(config.torque_limit, wish, friction)
}
