//! Control laws: of the one-link rig here, of arms in [`arm`].
//!
//! Each law is a pure function `step(&Config, &mut State, Input) -> Output`, or without a state if it has none. [`law`]
//! selects among the position laws by [`ControlKind`]; [`current`] turns the torque's current into a bridge duty cycle.

mod adaptation;
pub mod adaptive;
pub mod arm;
pub mod computed_torque;
mod config;
pub mod current;
pub mod law;
pub mod pd;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::scalar::Real;

/// Kind of control law that turns reference and measurement into a joint torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ControlKind {
    /// PD feedback with gravity and friction feed-forward.
    #[default]
    ProportionalDerivative,
    /// Feedback linearisation with the model.
    ComputedTorque,
    /// Slotine–Li adaptive control.
    Adaptive,
}

/// Feedback gains, joint-side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Gains<T> {
    /// Position gain, N·m/rad.
    pub proportional: T,
    /// Velocity gain, N·m·s/rad.
    pub derivative: T,
    /// Adaptation rate of the adaptive law, 1/s (scales its gain matrix).
    pub adaptation: T,
    /// Closed-loop bandwidth of the current loop, Hz.
    pub current_bandwidth: T,
}

impl<T: Real> Gains<T> {
    /// Returns gains that give an inertia (kg·m²) the undamped natural frequency `bandwidth` (Hz) and the damping
    /// ratio: kp = J·ω², kd = 2ζ·J·ω. The current loop is ten times as fast, so that its lag takes less than 6° of
    /// phase at ω, and adaptation runs at ω.
    pub fn design(inertia: T, bandwidth: T, damping: T) -> Self {
        let omega = T::from_f64(core::f64::consts::TAU) * bandwidth;
        Self {
            proportional: inertia * omega.squared(),
            derivative: T::from_f64(2.0) * damping * inertia * omega,
            adaptation: omega,
            current_bandwidth: T::from_f64(10.0) * bandwidth,
        }
    }
}

impl<T: Real<Mask = bool>> Gains<T> {
    /// Returns true if all gains are finite and not negative, and the divisors among them are above zero.
    pub fn is_valid(&self) -> bool {
        let limit = T::from_f64(1.0e30);
        let in_range = |x: T| T::ZERO.le(x) && x.le(limit);
        in_range(self.proportional)
            && in_range(self.derivative)
            && in_range(self.adaptation)
            && in_range(self.current_bandwidth)
            && T::ZERO.lt(self.derivative)
            && T::ZERO.lt(self.current_bandwidth)
    }
}

/// Measured motion of the link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured<T> {
    /// Joint position, rad.
    pub position: T,
    /// Joint velocity, rad/s.
    pub velocity: T,
}

/// A joint torque within its limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Torque<T> {
    /// Torque to apply, N·m.
    pub value: T,
    /// True if the limit has reduced the torque.
    pub limited: bool,
    /// Part of the unlimited torque that came from friction precompensation, N·m.
    pub friction: T,
}

impl<T: Real<Mask = bool>> Torque<T> {
    /// Returns the `unlimited` torque cut to ±`limit`, N·m. A NaN becomes 0 and counts as limited.
    #[inline]
    pub fn saturated(limit: T, unlimited: T, friction: T) -> Self {
        let is_number = unlimited.le(unlimited);
        let unlimited = T::select(is_number, unlimited, T::ZERO);
        let value = unlimited.clamp_to(-limit, limit);
        Self {
            value,
            limited: !is_number || limit.lt(unlimited.abs()),
            friction,
        }
    }
}

#[cfg(test)]
pub(crate) mod rig {
    //! A link for the tests of the position laws, with friction that is smooth and monotone in velocity.
    use super::*;
    use crate::link::LinkParameters;
    use crate::trajectory::Reference;

    pub(crate) const LINK: LinkParameters<f64> = LinkParameters {
        inertia: 0.17,
        gravity_cos: 2.9,
        gravity_sin: -0.4,
        viscous: 0.3,
        coulomb: 0.4,
        offset: 0.05,
    };

    /// Two sines, starting at rest.
    pub(crate) fn reference(t: f64) -> Reference<f64> {
        let (w1, w2) = (2.0, 5.0);
        Reference {
            position: 0.8 * (1.0 - libm::cos(w1 * t)) + 0.2 * (1.0 - libm::cos(w2 * t)),
            velocity: 0.8 * w1 * libm::sin(w1 * t) + 0.2 * w2 * libm::sin(w2 * t),
            acceleration: 0.8 * w1 * w1 * libm::cos(w1 * t) + 0.2 * w2 * w2 * libm::cos(w2 * t),
        }
    }

    /// Advances the link by `step` seconds under a constant torque, with ten substeps.
    pub(crate) fn advance(
        link: &LinkParameters<f64>,
        x: &mut Measured<f64>,
        torque: f64,
        step: f64,
    ) {
        let h = step / 10.0;
        for _ in 0..10 {
            let friction = link.friction_torque(x.velocity, libm::tanh(x.velocity / 0.01));
            let torque = torque - link.gravity_torque(x.position) - friction - link.offset;
            x.velocity += h * torque / link.inertia;
            x.position += h * x.velocity;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn designed_gains_place_the_poles() {
        let inertia = 0.17;
        let gains = Gains::<f64>::design(inertia, 8.0, 0.7);
        let omega = libm::sqrt(gains.proportional / inertia);
        assert!((omega / core::f64::consts::TAU - 8.0).abs() < 1e-12);
        let damping = gains.derivative / (2.0 * libm::sqrt(gains.proportional * inertia));
        assert!((damping - 0.7).abs() < 1e-12 && gains.is_valid());
    }

    #[test]
    fn gains_that_cannot_work_are_not_usable() {
        let good = Gains::<f32>::design(0.2, 5.0, 1.0);
        assert!(
            !Gains {
                derivative: 0.0,
                ..good
            }
            .is_valid()
        );
        assert!(
            !Gains {
                proportional: f32::NAN,
                ..good
            }
            .is_valid()
        );
        assert!(
            !Gains {
                adaptation: -1.0,
                ..good
            }
            .is_valid()
        );
    }

    #[test]
    fn torque_limit_is_kept_and_reported() {
        assert_eq!(
            Torque::saturated(2.0, 1.5, 0.0),
            Torque {
                value: 1.5,
                limited: false,
                friction: 0.0
            }
        );
        assert_eq!(
            Torque::saturated(2.0, -3.0, 0.1),
            Torque {
                value: -2.0,
                limited: true,
                friction: 0.1
            }
        );
        assert_eq!(
            Torque::saturated(2.0_f32, f32::NAN, 0.0),
            Torque {
                value: 0.0,
                limited: true,
                friction: 0.0
            }
        );
    }
}
