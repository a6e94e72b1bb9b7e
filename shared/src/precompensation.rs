//! Friction precompensation: the friction law as a feed-forward torque that is safe at zero velocity.
//!
//! Three things go wrong when a friction law is simply added to the command. Each has its remedy here:
//!
//! * **Direction near rest.** The sign of a measured velocity near zero is noise. Below `velocity_threshold` the
//!   direction is the reference's, above twice the threshold the measurement's, with a smooth blend in between. The
//!   reference carries no noise, so its sign may saturate early: tanh of velocity over [`REFERENCE_SHARE`] of the
//!   threshold. A reference at rest asks for no torque, however the link moves: friction then helps to stop it. A
//!   torque that followed the measured speed would cancel that help and keep a limit cycle alive (seen on the emulated
//!   rig: a disturbance of 0.03 N·m was enough to start one).
//! * **Over-compensation.** With a friction estimate above the true friction, the friction model drives the compensated
//!   link and the loop hunts. Only a share is compensated: `gain_at_rest` at zero speed rising to `gain` at the
//!   threshold (the faster of reference and link counts).
//! * **Velocity weakening.** On the falling branch of the Stribeck curve friction falls as speed rises. A torque held
//!   at the reference's speed then exceeds the friction of a link that has run ahead, and drives it further: stick-slip
//!   by feed-forward. A torque at the measured speed on the rising (viscous) branch cancels the damping that the loop
//!   needs. So each part is evaluated where the torque cannot grow with the measured speed: the Stribeck excess at the
//!   *faster* of reference and link, the viscous part at the reference.
//!
//! The torque is continuous in all its inputs. Background: Armstrong-Hélouvry, Dupont and Canudas de Wit 1994, sec. 5
//! (fixed compensation and its stability).
//!
//! Leaves out: presliding displacement. Within it true friction is below the law's; `gain_at_rest` must cover the
//! difference.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::friction::Friction;
use crate::scalar::Real;

/// Reference velocity, as a share of the velocity threshold, at which the direction is 76 % certain (tanh 1). A choice:
/// a fiftieth of the noise that the threshold stands for, far above the rounding of `f32`.
pub const REFERENCE_SHARE: f64 = 0.02;

/// Settings of the friction feed-forward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct PrecompensationSettings<T> {
    /// True if friction torque is added.
    pub enabled: bool,
    /// Share of the friction law that is compensated while sliding, 0 to 1.
    pub gain: T,
    /// Share near zero speed, below `gain` so that the loop cannot hunt, 0 to 1.
    pub gain_at_rest: T,
    /// Speed below which the measured velocity does not show the direction, rad/s.
    pub velocity_threshold: T,
}

/// Setting of the precompensation that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PrecompensationError {
    /// `gain` is not between 0 and 1.
    Gain,
    /// `gain_at_rest` is not between 0 and `gain`, or is 1.
    GainAtRest,
    /// `velocity_threshold` is not a finite number above 0.
    VelocityThreshold,
}

impl fmt::Display for PrecompensationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gain => "precompensation setting gain must lie between 0 and 1",
            Self::GainAtRest => {
                "precompensation setting gain_at_rest must lie between 0 and gain and below 1"
            }
            Self::VelocityThreshold => {
                "precompensation setting velocity_threshold must be a finite speed above 0"
            }
        })
    }
}

impl core::error::Error for PrecompensationError {}

/// Returns 0 below `low`, 1 above `high`, and a cubic with level ends between; `low` < `high`.
#[inline(always)]
fn smooth_step<T: Real>(x: T, low: T, high: T) -> T {
    let s = ((x - low) / (high - low)).clamp_to(T::ZERO, T::ONE);
    s.squared() * (T::from_f64(3.0) - T::from_f64(2.0) * s)
}

/// Returns the value if its magnitude is at most 10³⁰, else (NaN too) zero.
#[inline(always)]
pub(crate) fn finite<T: Real>(x: T) -> T {
    T::select(x.abs().le(T::from_f64(1.0e30)), x, T::ZERO)
}

/// Returns the direction of motion, −1 to 1, smooth: the reference's near rest, the measurement's beyond the threshold;
/// 0 where the reference is at rest.
///
/// Not inlined: every law calls it, and the chip's fast memory has no room for copies.
#[inline(never)]
pub fn direction<T: Real>(reference: T, measured: T, velocity_threshold: T) -> T {
    let threshold = velocity_threshold.max(T::from_f64(1.0e-6));
    let weight = smooth_step(measured.abs(), threshold, threshold + threshold);
    let reference_direction = (reference / (T::from_f64(REFERENCE_SHARE) * threshold)).tanh();
    weight * measured.sgn() * reference_direction.abs() + (T::ONE - weight) * reference_direction
}

/// Returns the share of dry friction that is given: `gain_at_rest` at rest, `gain` from the threshold on, by the faster
/// of reference and link.
#[inline(always)]
pub fn share<T: Real>(settings: &PrecompensationSettings<T>, reference: T, measured: T) -> T {
    let threshold = settings.velocity_threshold.max(T::from_f64(1.0e-6));
    let faster = reference.abs().max(measured.abs());
    settings.gain_at_rest
        + (settings.gain - settings.gain_at_rest) * smooth_step(faster, T::ZERO, threshold)
}

/// Returns the feed-forward torque against friction, N·m.
///
/// `reference` and `measured` are velocities in rad/s, `load` the torque that the gear transmits, N·m. With
/// settings and a law that pass their checks the result is finite for any input, NaN included (it counts as 0).
#[inline(always)]
pub fn torque<T: Real>(
    settings: &PrecompensationSettings<T>,
    friction: &Friction<T>,
    reference: T,
    measured: T,
    load: T,
) -> T {
    if !settings.enabled {
        return T::ZERO;
    }
    let (reference, measured, load) = (finite(reference), finite(measured), finite(load));
    let sign = direction(reference, measured, settings.velocity_threshold);
    let faster = reference.abs().max(measured.abs());
    let share = share(settings, reference, measured);
    let dry = friction.coulomb
        + friction.stribeck_excess(faster)
        + friction.load_coefficient * load.abs();
    share
        * (sign * dry
            + friction.coulomb_asymmetry * sign.squared()
            + friction.viscous * reference
            + friction.viscous_asymmetry * reference.abs())
}

impl<T: Real<Mask = bool>> PrecompensationSettings<T> {
    /// Checks the settings; if switched off they are always valid.
    ///
    /// # Errors
    /// [`PrecompensationError`] naming the setting that is out of its range.
    pub fn check(&self) -> Result<(), PrecompensationError> {
        if !self.enabled {
            return Ok(());
        }
        let in_range = |x: T, high: T| T::ZERO.le(x) && x.le(high);
        if !in_range(self.gain, T::ONE) {
            return Err(PrecompensationError::Gain);
        }
        if !in_range(self.gain_at_rest, self.gain) || !self.gain_at_rest.lt(T::ONE) {
            return Err(PrecompensationError::GainAtRest);
        }
        let threshold = self.velocity_threshold;
        if !T::ZERO.lt(threshold) || !threshold.le(T::from_f64(1.0e30)) {
            return Err(PrecompensationError::VelocityThreshold);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use super::*;
    use proptest::prelude::*;

    const SETTINGS: PrecompensationSettings<f64> = PrecompensationSettings {
        enabled: true,
        gain: 0.95,
        gain_at_rest: 0.7,
        velocity_threshold: 0.05,
    };
    const LAW: Friction<f64> = Friction {
        coulomb: 0.4,
        viscous: 0.3,
        breakaway_excess: 0.25,
        stribeck_velocity: 0.1,
        coulomb_asymmetry: 0.05,
        viscous_asymmetry: 0.02,
        load_coefficient: 0.06,
    };

    fn at(reference: f64, measured: f64, load: f64) -> f64 {
        torque(&SETTINGS, &LAW, reference, measured, load)
    }

    #[test]
    fn without_a_reference_there_is_no_torque_however_the_link_moves() {
        for k in -1000..=1000 {
            let measured = f64::from(k) / 100.0 * SETTINGS.velocity_threshold;
            assert_eq!(at(0.0, measured, 3.0), 0.0);
        }
    }

    #[test]
    fn a_slow_reference_sets_the_direction_while_the_link_sticks() {
        for reference in [0.005, -0.005] {
            for noise in [-0.04, 0.0, 0.04] {
                let torque = at(reference, noise, 0.0);
                assert!(torque * reference > 0.0);
                let true_friction = LAW.torque(reference, reference.sgn(), 0.0);
                assert!(torque.abs() > 0.65 * true_friction.abs());
                assert!(torque.abs() < true_friction.abs());
            }
        }
    }

    #[test]
    fn continuous_in_every_input() {
        // A jump stays when the step shrinks; a slope does not. The steepest slope is that of the reference's
        // sign: 0.65 N·m over 0.02·0.05 rad/s.
        let steepest = 0.8 / (REFERENCE_SHARE * SETTINGS.velocity_threshold);
        let h = 1e-5;
        for fixed in [-0.3, -0.08, -0.02, -1e-4, 0.0, 1e-4, 0.02, 0.08, 0.3] {
            for k in -40_000..40_000 {
                let x = f64::from(k) * h;
                for (a, b) in [
                    (at(x, fixed, 1.0), at(x + h, fixed, 1.0)),
                    (at(fixed, x, 1.0), at(fixed, x + h, 1.0)),
                    (at(0.1, fixed, x), at(0.1, fixed, x + h)),
                ] {
                    assert!((a - b).abs() < steepest * h, "{x} {fixed}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn torque_never_grows_with_the_measured_speed_beyond_the_direction_blend() {
        // Otherwise the feed-forward would take damping from the loop.
        for reference in [0.02, 0.1, 0.5] {
            let mut last = at(reference, 0.1, 0.0);
            for k in 1..=1000 {
                let next = at(reference, 0.1 + f64::from(k) * 1e-3, 0.0);
                assert!(next <= last + 1e-12, "{reference}: {last} {next}");
                last = next;
            }
        }
    }

    #[test]
    fn compensation_of_an_overestimated_stribeck_law_does_not_keep_the_link_moving() {
        // The link slides at rest reference; friction is 10 % below the law, PD holds position.
        let mut state = (0.05_f64, 0.5_f64);
        let h = 1e-4;
        let truth = |v: f64| 0.9 * LAW.torque(v, libm::tanh(v / 1e-3), 0.0);
        for _ in 0..100_000 {
            let command = -20.0 * state.0 - 2.0 * state.1 + at(0.0, state.1, 0.0);
            state.1 += h * (command - truth(state.1)) / 0.2;
            state.0 += h * state.1;
        }
        assert!(state.1.abs() < 1e-3, "still moving at {}", state.1);
    }

    proptest! {
        #[test]
        fn never_nan_and_never_more_than_the_law(
            reference in prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(0.0), -10.0..10.0_f64],
            measured in prop_oneof![Just(f64::NAN), Just(f64::NEG_INFINITY), Just(0.0), -10.0..10.0_f64],
            load in prop_oneof![Just(f64::NAN), -20.0..20.0_f64],
        ) {
            let torque = at(reference, measured, load);
            prop_assert!(torque.is_finite());
            let speed = if reference.is_finite() { reference.abs() } else { 0.0 };
            let most = 0.4 + 0.25 + 0.05 + 0.06 * load.abs().max(0.0) + 0.32 * speed;
            prop_assert!(torque.abs() <= 0.95 * most + 1e-12);
        }

        #[test]
        fn single_precision_agrees(reference in -3.0..3.0_f32, measured in -3.0..3.0_f32) {
            let settings = PrecompensationSettings { enabled: true, gain: 0.95_f32, gain_at_rest: 0.7, velocity_threshold: 0.05 };
            let law = Friction { coulomb: 0.4_f32, viscous: 0.3, breakaway_excess: 0.25, stribeck_velocity: 0.1,
                coulomb_asymmetry: 0.05, viscous_asymmetry: 0.02, load_coefficient: 0.06 };
            let single = torque(&settings, &law, reference, measured, 1.0);
            let double = at(reference.into(), measured.into(), 1.0);
            prop_assert!((f64::from(single) - double).abs() < 2e-6);
        }
    }

    #[test]
    fn faults_are_named_and_a_default_law_is_finite() {
        assert_eq!(SETTINGS.check(), Ok(()));
        let bad = PrecompensationSettings {
            gain_at_rest: 0.96,
            ..SETTINGS
        };
        assert_eq!(bad.check(), Err(PrecompensationError::GainAtRest));
        let bad = PrecompensationSettings {
            gain: f64::NAN,
            ..SETTINGS
        };
        assert_eq!(bad.check(), Err(PrecompensationError::Gain));
        let bad = PrecompensationSettings {
            velocity_threshold: 0.0,
            ..SETTINGS
        };
        assert_eq!(bad.check(), Err(PrecompensationError::VelocityThreshold));
        let none = torque(&SETTINGS, &Friction::default(), 0.0, 0.0, 0.0);
        assert_eq!(none, 0.0);
    }
}
