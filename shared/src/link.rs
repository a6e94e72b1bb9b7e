//! One-link dynamics, linear in its parameters.
//!
//! τ = J·q̈ + gc·cos q + gs·sin q + fv·q̇ + fc·sgn q̇ + off, the rigid link with lumped gravity and friction
//! (Khalil and Dombre 2002, ch. 9; Siciliano et al. 2009, sec. 7.2).
//!
//! Leaves out: elasticity and backlash of the gear, friction beyond Coulomb and viscous (see
//! [`friction`](crate::friction)), presliding and sticking at zero velocity, anything that depends on
//! temperature or time.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::lanes::Lanes;
use crate::scalar::Real;

/// Number of parameters of the one-link model.
pub const PARAMETER_COUNT: usize = 6;

/// Names of the parameters, in the order of every parameter vector.
pub const PARAMETER_NAMES: [&str; PARAMETER_COUNT] = ["J", "gc", "gs", "fv", "fc", "off"];

/// Parameters of τ = J·q̈ + gc·cos q + gs·sin q + fv·q̇ + fc·sgn q̇ + off, joint-side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct LinkParameters<T> {
    /// Inertia about the joint axis with the drive's reflected inertia, kg·m².
    pub inertia: T,
    /// Gravity torque at q = 0, N·m (multiplies cos q).
    pub gravity_cos: T,
    /// Gravity torque at q = π/2, N·m (multiplies sin q).
    pub gravity_sin: T,
    /// Viscous friction, N·m·s/rad.
    pub viscous: T,
    /// Coulomb friction, N·m.
    pub coulomb: T,
    /// Constant torque, N·m.
    pub offset: T,
}

impl<T: Real> LinkParameters<T> {
    /// Returns the parameters of a vector in the order of [`PARAMETER_NAMES`].
    pub const fn from_array(theta: [T; PARAMETER_COUNT]) -> Self {
        let [inertia, gravity_cos, gravity_sin, viscous, coulomb, offset] = theta;
        Self {
            inertia,
            gravity_cos,
            gravity_sin,
            viscous,
            coulomb,
            offset,
        }
    }

    /// Returns a vector in the order of [`PARAMETER_NAMES`].
    pub const fn to_array(self) -> [T; PARAMETER_COUNT] {
        [
            self.inertia,
            self.gravity_cos,
            self.gravity_sin,
            self.viscous,
            self.coulomb,
            self.offset,
        ]
    }

    /// Returns the parameters with a drive's inertia added: N²·Jm for gear ratio N and rotor inertia Jm, kg·m² on the
    /// motor side (Khalil and Dombre 2002, eq. 9.37).
    #[inline(always)]
    #[must_use]
    pub fn with_drive(self, gear_ratio: T, rotor_inertia: T) -> Self {
        Self {
            inertia: self.inertia + gear_ratio.squared() * rotor_inertia,
            ..self
        }
    }

    /// Returns the torque that holds the link at `position` (rad) against gravity, N·m.
    #[inline(always)]
    pub fn gravity_torque(&self, position: T) -> T {
        let (sine, cosine) = position.sin_cos();
        self.gravity_cos * cosine + self.gravity_sin * sine
    }

    /// Returns the friction torque, N·m, positive if a positive torque has to overcome it. `sign` is −1, 0 or 1. It is
    /// not derived from the velocity (rad/s), because at rest the caller decides the direction.
    #[inline(always)]
    pub fn friction_torque(&self, velocity: T, sign: T) -> T {
        self.viscous * velocity + self.coulomb * sign
    }

    /// Returns the joint torque, N·m, for a motion in rad, rad/s and rad/s².
    #[inline(always)]
    pub fn inverse_dynamics(&self, position: T, velocity: T, acceleration: T) -> T {
        self.inertia * acceleration
            + self.gravity_torque(position)
            + self.friction_torque(velocity, velocity.sgn())
            + self.offset
    }

    /// Returns the acceleration, rad/s², under a joint torque, N·m. The inertia must not be zero. At exactly zero
    /// velocity Coulomb friction is zero here: sticking is not modelled.
    #[inline(always)]
    pub fn forward_dynamics(&self, position: T, velocity: T, torque: T) -> T {
        (torque
            - self.gravity_torque(position)
            - self.friction_torque(velocity, velocity.sgn())
            - self.offset)
            / self.inertia
    }

    /// Returns the kinetic energy at a velocity in rad/s, J.
    #[inline(always)]
    pub fn kinetic_energy(&self, velocity: T) -> T {
        T::from_f64(0.5) * self.inertia * velocity.squared()
    }

    /// Returns the potential energy at a position in rad, J: gc·sin q − gs·cos q. Its derivative is the gravity torque.
    #[inline(always)]
    pub fn potential_energy(&self, position: T) -> T {
        let (sine, cosine) = position.sin_cos();
        self.gravity_cos * sine - self.gravity_sin * cosine
    }

    /// Returns the power that friction and the constant torque take from the link, W.
    #[inline(always)]
    pub fn dissipated_power(&self, velocity: T) -> T {
        (self.friction_torque(velocity, velocity.sgn()) + self.offset) * velocity
    }
}

impl LinkParameters<f64> {
    /// Returns the parameters in single precision, as the rig uses them.
    pub const fn to_f32(self) -> LinkParameters<f32> {
        LinkParameters {
            inertia: self.inertia as f32,
            gravity_cos: self.gravity_cos as f32,
            gravity_sin: self.gravity_sin as f32,
            viscous: self.viscous as f32,
            coulomb: self.coulomb as f32,
            offset: self.offset as f32,
        }
    }
}

/// Computes the inverse dynamics of a batch: `torque[k]` from `position[k]`, `velocity[k]` and `acceleration[k]`.
///
/// Runs over the shortest of the four slices: `N` samples at a time, then the rest one by one. Returns the number of
/// written torques. Four or eight lanes suit desktop processors.
pub fn inverse_dynamics_batch<const N: usize>(
    parameters: &LinkParameters<f64>,
    position: &[f64],
    velocity: &[f64],
    acceleration: &[f64],
    torque: &mut [f64],
) -> usize {
    let count = position
        .len()
        .min(velocity.len())
        .min(acceleration.len())
        .min(torque.len());
    let (position, position_rest) = position.get(..count).unwrap_or(&[]).as_chunks::<N>();
    let (velocity, velocity_rest) = velocity.get(..count).unwrap_or(&[]).as_chunks::<N>();
    let (acceleration, acceleration_rest) =
        acceleration.get(..count).unwrap_or(&[]).as_chunks::<N>();
    let (torque, torque_rest) = torque
        .get_mut(..count)
        .unwrap_or(&mut [])
        .as_chunks_mut::<N>();

    let wide = LinkParameters::from_array(parameters.to_array().map(Lanes::<N>::splat));
    for (((q, qd), qdd), out) in position.iter().zip(velocity).zip(acceleration).zip(torque) {
        *out = wide.inverse_dynamics(Lanes(*q), Lanes(*qd), Lanes(*qdd)).0;
    }
    for (((q, qd), qdd), out) in position_rest
        .iter()
        .zip(velocity_rest)
        .zip(acceleration_rest)
        .zip(torque_rest)
    {
        *out = parameters.inverse_dynamics(*q, *qd, *qdd);
    }
    count
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use super::*;
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec;

    const LINK: LinkParameters<f64> = LinkParameters {
        inertia: 0.17,
        gravity_cos: 2.9,
        gravity_sin: -0.4,
        viscous: 0.3,
        coulomb: 0.4,
        offset: 0.05,
    };

    /// One Runge–Kutta step of position, velocity and the energy lost to friction and offset.
    fn step(link: &LinkParameters<f64>, x: [f64; 3], h: f64) -> [f64; 3] {
        let f = |x: [f64; 3]| {
            [
                x[1],
                link.forward_dynamics(x[0], x[1], 0.0),
                link.dissipated_power(x[1]),
            ]
        };
        let ahead = |k: [f64; 3], s: f64| core::array::from_fn(|i| x[i] + s * k[i]);
        let k1 = f(x);
        let k2 = f(ahead(k1, h / 2.0));
        let k3 = f(ahead(k2, h / 2.0));
        let k4 = f(ahead(k3, h));
        core::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    fn energy(link: &LinkParameters<f64>, x: [f64; 3]) -> f64 {
        link.kinetic_energy(x[1]) + link.potential_energy(x[0]) + x[2]
    }

    #[test]
    fn energy_is_kept_without_friction_and_accounted_for_with_it() {
        let frictionless = LinkParameters {
            viscous: 0.0,
            coulomb: 0.0,
            offset: 0.0,
            ..LINK
        };
        // With Coulomb friction only up to the first reversal: there the step crosses the jump of sgn.
        for (link, steps) in [(frictionless, 200_000), (LINK, 40_000)] {
            let mut x = [0.9, 0.0, 0.0];
            x[1] = -0.5;
            let start = energy(&link, x);
            let mut moved = 0.0_f64;
            for _ in 0..steps {
                let next = step(&link, x, 5e-5);
                if link.coulomb > 0.0 && next[1] >= 0.0 {
                    break;
                }
                x = next;
                moved = moved.max((x[0] - 0.9).abs());
            }
            assert!(moved > 1.0, "the link must really swing: {moved}");
            assert!((energy(&link, x) - start).abs() < 1e-9);
            if link.coulomb > 0.0 {
                assert!(x[2] > 0.1, "friction must have taken energy: {}", x[2]);
            }
        }
    }

    #[test]
    fn gravity_torque_is_the_slope_of_the_potential_energy() {
        for k in -30..=30 {
            let q = f64::from(k) * 0.1;
            let slope = (LINK.potential_energy(q + 1e-6) - LINK.potential_energy(q - 1e-6)) / 2e-6;
            assert!((slope - LINK.gravity_torque(q)).abs() < 1e-8);
        }
    }

    #[test]
    fn the_drive_adds_its_inertia_whatever_the_sign_of_the_gear() {
        for ratio in [50.0, -50.0] {
            let with = LINK.with_drive(ratio, 2e-5);
            assert!((with.inertia - (0.17 + 0.05)).abs() < 1e-12);
            assert_eq!(with.gravity_cos, LINK.gravity_cos);
        }
    }

    proptest! {
        #[test]
        fn forward_undoes_inverse(q in -3.0..3.0_f64, qd in -6.0..6.0_f64, qdd in -60.0..60.0_f64) {
            let torque = LINK.inverse_dynamics(q, qd, qdd);
            prop_assert!((LINK.forward_dynamics(q, qd, torque) - qdd).abs() < 1e-12 * 100.0);
        }

        #[test]
        fn single_precision_errs_by_its_rounding(q in -3.0..3.0_f64, qd in -6.0..6.0_f64, qdd in -60.0..60.0_f64) {
            let (q, qd, qdd) = (q as f32, qd as f32, qdd as f32);
            let single = LINK.to_f32().inverse_dynamics(q, qd, qdd);
            let double = LINK.inverse_dynamics(q.into(), qd.into(), qdd.into());
            // Six products of at most 10 N·m, each rounded a few times to 24 bits.
            prop_assert!((f64::from(single) - double).abs() < 4e-6);
        }

        #[test]
        fn batches_agree_with_the_scalar_to_rounding(
            motion in proptest::collection::vec((-9.0..9.0_f64, -6.0..6.0_f64, -60.0..60.0_f64), 0..40),
        ) {
            let q: Vec<f64> = motion.iter().map(|m| m.0).collect();
            let qd: Vec<f64> = motion.iter().map(|m| m.1).collect();
            let qdd: Vec<f64> = motion.iter().map(|m| m.2).collect();
            for wide in [false, true] {
                let mut torque = vec![f64::NAN; motion.len()];
                let written = if wide {
                    inverse_dynamics_batch::<8>(&LINK, &q, &qd, &qdd, &mut torque)
                } else {
                    inverse_dynamics_batch::<4>(&LINK, &q, &qd, &qdd, &mut torque)
                };
                prop_assert_eq!(written, motion.len());
                for k in 0..motion.len() {
                    let expected = LINK.inverse_dynamics(q[k], qd[k], qdd[k]);
                    prop_assert!((torque[k] - expected).abs() < 1e-14 * 20.0);
                }
            }
        }
    }

    #[test]
    fn the_vector_has_the_order_of_the_names() {
        let vector = LINK.to_array();
        assert_eq!(PARAMETER_NAMES[3], "fv");
        assert_eq!(vector[3], LINK.viscous);
        assert_eq!(LinkParameters::from_array(vector), LINK);
    }
}
