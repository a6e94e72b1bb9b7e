//! Computed torque: the model turns a wanted acceleration into a torque.
//!
//! τ = J·(q̈r + kd/J₀·ė + kp/J₀·e) + g(q) + fv·q̇ + off + friction (Craig 1986; Khalil and Dombre 2002, sec. 14.4).
//! J₀ is the inertia that the gains were designed for. So the error keeps the designed poles after a change of the
//! model's inertia (a new estimate, a payload).
//!
//! The viscous part is the model's, at the measured velocity. Precompensation adds dry friction only; if it is off, the
//! torque contains no dry friction.

use super::config::Config;
use super::{Measured, Torque};
use crate::friction::Friction;
use crate::precompensation;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// Returns the joint torque for one tick; `feedforward` is a known additional torque, N·m. `design_inertia` must be >
/// 0.
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    measured: Measured<T>,
    reference: Reference<T>,
    feedforward: T,
) -> Torque<T> {
    let model = &config.model;
    let acceleration = reference.acceleration
        + (config.gains.proportional * (reference.position - measured.position)
            + config.gains.derivative * (reference.velocity - measured.velocity))
            / config.design_inertia;
    let gravity = model.gravity_torque(measured.position);
    let load = model.inertia * acceleration + gravity;
    // The planned load decides friction, because feedback would carry measurement noise into the load.
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
    let unlimited =
        load + model.viscous * measured.velocity + model.offset + friction + feedforward;
    Torque::saturated(config.torque_limit, unlimited, friction)
}
