//! Adaptive control after Slotine and Li (1987, "On the adaptive control of robot manipulators").
//!
//! With e = q − qr, s = ė + Λe, the reference velocity v = q̇r − Λe and its derivative v̇ the torque is
//! τ = Y(q, v, v̇)·θ̂ − kd·s and θ̂ follows −Γ·Yᵀ·s, Λ = kp/kd. V = ½J·s² + ½θ̃ᵀΓ⁻¹θ̃ then obeys
//! V̇ ≤ −kd·s², also with friction in the regressor at v instead of q̇: friction grows with velocity, so
//! (q̇ − v)·(F(q̇) − F(v)) ≥ 0.
//!
//! Three measures make it robust on a rig. Each θ̂ is kept within its band (projection; exact for the diagonal Γ used
//! here, it only lowers V). Nothing is learnt inside a dead zone of s that measurement noise fills (Slotine and Coetsee
//! 1986), nor while the torque is limited. The sums are compensated (Kahan), because at 10 kHz a step of θ̂ is often
//! below half a unit of `f32`.
//!
//! Leaves out: velocity-weakening friction, for which the inequality above does not hold.

pub use super::adaptation::Adaptation;

use super::config::Config;
use super::{Measured, Torque};
use crate::link::{LinkParameters, PARAMETER_COUNT};
use crate::precompensation;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// State of the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    /// The parameters in use, in the order of [`PARAMETER_NAMES`](crate::link::PARAMETER_NAMES).
    pub theta: [T; PARAMETER_COUNT],
    /// Rounding error of `theta` so far.
    residue: [T; PARAMETER_COUNT],
}

impl<T: Real> State<T> {
    /// Returns a state with known parameters.
    pub fn new(start: LinkParameters<T>) -> Self {
        Self {
            theta: start.to_array(),
            residue: [T::ZERO; PARAMETER_COUNT],
        }
    }
}

/// Returns the row of the one-link model for a reference velocity and acceleration; `direction` is the smoothed sign.
pub fn regressor<T: Real>(
    position: T,
    velocity: T,
    acceleration: T,
    direction: T,
) -> [T; PARAMETER_COUNT] {
    let (sine, cosine) = position.sin_cos();
    [acceleration, cosine, sine, velocity, direction, T::ONE]
}

/// Returns the joint torque for one tick and advances the adaptation. `feedforward` is a known torque in addition to
/// the model, N·m. `gains.derivative` must be above zero.
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &mut State<T>,
    measured: Measured<T>,
    reference: Reference<T>,
    feedforward: T,
) -> Torque<T> {
    let gains = &config.gains;
    let slope = gains.proportional / gains.derivative;
    let error = measured.position - reference.position;
    let error_rate = measured.velocity - reference.velocity;
    let s = error_rate + slope * error;
    let velocity = reference.velocity - slope * error;
    let acceleration = reference.acceleration - slope * error_rate;
    // The proof needs the direction of v alone; it is smoothed like the reference's in the precompensation.
    let direction =
        precompensation::direction(velocity, T::ZERO, config.precompensation.velocity_threshold);
    let row = regressor(measured.position, velocity, acceleration, direction);
    let mut model = T::ZERO;
    for (y, theta) in row.iter().zip(state.theta) {
        model += *y * theta;
    }
    let [_, _, _, _, coulomb, _] = state.theta;
    let friction = direction * coulomb;
    let unlimited = model - gains.derivative * s + feedforward;
    let torque = Torque::saturated(config.torque_limit, unlimited, friction);
    if !torque.limited {
        let adaptation = &config.adaptation;
        let zone = adaptation.dead_zone;
        adapt(
            adaptation,
            state,
            &row,
            (s - s.clamp_to(-zone, zone)) * config.period,
        );
    }
    torque
}

fn adapt<T: Real<Mask = bool>>(
    adaptation: &Adaptation<T>,
    state: &mut State<T>,
    row: &[T; PARAMETER_COUNT],
    impulse: T,
) {
    for k in 0..PARAMETER_COUNT {
        let change = -adaptation.rate[k] * row[k] * impulse - state.residue[k];
        let sum = state.theta[k] + change;
        let kept = sum.clamp_to(adaptation.lower[k], adaptation.upper[k]);
        let inside = adaptation.lower[k].lt(sum) && sum.lt(adaptation.upper[k]);
        state.residue[k] = T::select(inside, (sum - state.theta[k]) - change, T::ZERO);
        state.theta[k] = kept;
    }
}
