//! Friction laws.
//!
//! τ = s·(Fc + F_id·exp(−(q̇/vs)²) + μ·|τl|) + ΔFc·s² + Fv·q̇ + ΔFv·|q̇| with the direction s. F_id is breakaway minus
//! Coulomb friction, vs the Stribeck velocity (Armstrong-Hélouvry, Dupont and Canudas de Wit 1994, sec. 2.1, with the
//! Gaussian exponent), and |τl| the torque transmitted by the gear.
//!
//! Leaves out: everything with memory (presliding displacement, frictional lag, rising breakaway with dwell time),
//! the dependence on position, temperature and running time, and drag that grows faster than speed.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::scalar::Real;

/// Parameters of the static friction law, joint-side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Friction<T> {
    /// Coulomb friction Fc, N·m.
    pub coulomb: T,
    /// Viscous friction Fv, N·m·s/rad.
    pub viscous: T,
    /// Breakaway minus Coulomb friction (the book's F_id), N·m; 0 for no Stribeck effect.
    pub breakaway_excess: T,
    /// Stribeck velocity, rad/s.
    pub stribeck_velocity: T,
    /// Half the difference of Coulomb friction between the two directions, N·m.
    pub coulomb_asymmetry: T,
    /// Half the difference of viscous friction between the two directions, N·m·s/rad.
    pub viscous_asymmetry: T,
    /// Friction torque per transmitted torque, N·m/(N·m).
    pub load_coefficient: T,
}

/// Reason why a friction law is invalid, with the name of the field in [`Friction`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrictionError {
    /// Not a finite number.
    NotFinite(&'static str),
    /// Below zero, which would drive the link instead of braking it.
    Negative(&'static str),
    /// The difference between the directions exceeds the value itself: friction would drive in one of them.
    AsymmetryTooLarge(&'static str),
    /// A breakaway excess needs a Stribeck velocity above zero.
    NoStribeckVelocity,
}

impl fmt::Display for FrictionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite(name) => write!(f, "friction parameter {name} is not a finite number"),
            Self::Negative(name) => {
                write!(
                    f,
                    "friction parameter {name} is negative, it must be 0 or more"
                )
            }
            Self::AsymmetryTooLarge(name) => write!(
                f,
                "friction parameter {name} is larger than the friction it is a difference of, \
                 so friction would drive the link in one direction"
            ),
            Self::NoStribeckVelocity => write!(
                f,
                "friction parameter stribeck_velocity must be above 0 where breakaway_excess is"
            ),
        }
    }
}

impl core::error::Error for FrictionError {}

impl<T: Real> Friction<T> {
    /// Returns the part of the breakaway excess that remains at a speed in rad/s, N·m.
    #[inline(always)]
    pub fn stribeck_excess(&self, speed: T) -> T {
        // A law without Stribeck effect may have a zero velocity: avoids 0/0.
        let valid = T::ZERO.lt(self.stribeck_velocity);
        let velocity = T::select(valid, self.stribeck_velocity, T::ONE);
        let excess = T::select(valid, self.breakaway_excess, T::ZERO);
        excess * (-(speed / velocity).squared()).exp()
    }

    /// Returns the friction torque, N·m, positive if a positive torque has to overcome it.
    ///
    /// `sign` is −1, 0 or 1. It is not derived from the velocity (rad/s), because at rest the caller decides the
    /// direction. `load` is the torque transmitted by the gear, N·m.
    #[inline(always)]
    pub fn torque(&self, velocity: T, sign: T, load: T) -> T {
        let dry =
            self.coulomb + self.stribeck_excess(velocity) + self.load_coefficient * load.abs();
        sign * dry
            + self.coulomb_asymmetry * sign.squared()
            + self.viscous * velocity
            + self.viscous_asymmetry * velocity.abs()
    }
}

impl<T: Real<Mask = bool>> Friction<T> {
    /// Checks that the law can only brake.
    ///
    /// # Errors
    /// [`FrictionError`] with the first parameter that is not finite, is negative, or is a difference larger than its
    /// base value.
    pub fn check(&self) -> Result<(), FrictionError> {
        let largest = T::from_f64(1.0e30);
        for (name, value, may_be_negative) in [
            ("coulomb", self.coulomb, false),
            ("viscous", self.viscous, false),
            ("breakaway_excess", self.breakaway_excess, false),
            ("stribeck_velocity", self.stribeck_velocity, false),
            ("coulomb_asymmetry", self.coulomb_asymmetry, true),
            ("viscous_asymmetry", self.viscous_asymmetry, true),
            ("load_coefficient", self.load_coefficient, false),
        ] {
            if !value.abs().le(largest) {
                return Err(FrictionError::NotFinite(name));
            }
            if !may_be_negative && value.lt(T::ZERO) {
                return Err(FrictionError::Negative(name));
            }
        }
        if self.coulomb.lt(self.coulomb_asymmetry.abs()) {
            return Err(FrictionError::AsymmetryTooLarge("coulomb_asymmetry"));
        }
        if self.viscous.lt(self.viscous_asymmetry.abs()) {
            return Err(FrictionError::AsymmetryTooLarge("viscous_asymmetry"));
        }
        if T::ZERO.lt(self.breakaway_excess) && self.stribeck_velocity.le(T::ZERO) {
            return Err(FrictionError::NoStribeckVelocity);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic)]
    use super::*;
    use proptest::prelude::*;

    const FULL: Friction<f64> = Friction {
        coulomb: 0.4,
        viscous: 0.3,
        breakaway_excess: 0.25,
        stribeck_velocity: 0.1,
        coulomb_asymmetry: -0.05,
        viscous_asymmetry: 0.02,
        load_coefficient: 0.06,
    };

    proptest! {
        #[test]
        fn a_valid_law_never_drives(
            p in proptest::array::uniform7(0.0..1.0_f64),
            velocity in -10.0..10.0_f64,
            load in -20.0..20.0_f64,
        ) {
            let law = Friction {
                coulomb: p[0], viscous: p[1], breakaway_excess: p[2], stribeck_velocity: p[3],
                coulomb_asymmetry: 0.5 * (p[4] - 0.5), viscous_asymmetry: 0.5 * (p[5] - 0.5), load_coefficient: p[6],
            };
            prop_assume!(law.check().is_ok());
            prop_assert!(velocity * law.torque(velocity, velocity.sgn(), load) >= 0.0);
        }
    }

    #[test]
    fn breakaway_stands_at_rest_and_has_gone_at_three_stribeck_velocities() {
        let law = Friction {
            coulomb_asymmetry: 0.0,
            ..FULL
        };
        assert!((law.torque(0.0, 1.0, 0.0) - 0.65).abs() < 1e-15);
        assert!(law.stribeck_excess(0.3) < 0.25 * 1.3e-4);
    }

    #[test]
    fn the_directions_differ_by_twice_the_asymmetry_and_load_adds_its_share() {
        let forth = FULL.torque(1.0, 1.0, 0.0);
        let back = FULL.torque(-1.0, -1.0, 0.0);
        assert!((forth + back - 2.0 * (-0.05 + 0.02)).abs() < 1e-15);
        let more = FULL.torque(1.0, 1.0, -5.0) - forth;
        assert!((more - 0.06 * 5.0).abs() < 1e-15);
    }

    #[test]
    fn a_law_without_stribeck_effect_is_finite_at_rest() {
        let law = Friction {
            coulomb: 0.4_f32,
            ..Friction::default()
        };
        assert_eq!(law.torque(0.0, 0.0, 0.0), 0.0);
        assert_eq!(law.check(), Ok(()));
    }

    #[test]
    fn faults_name_their_parameter() {
        let with = |change: fn(&mut Friction<f64>)| {
            let mut law = FULL;
            change(&mut law);
            law.check()
        };
        assert_eq!(
            with(|f| f.viscous = f64::NAN),
            Err(FrictionError::NotFinite("viscous"))
        );
        assert_eq!(
            with(|f| f.load_coefficient = f64::INFINITY),
            Err(FrictionError::NotFinite("load_coefficient"))
        );
        assert_eq!(
            with(|f| f.coulomb = -0.1),
            Err(FrictionError::Negative("coulomb"))
        );
        assert_eq!(
            with(|f| f.coulomb_asymmetry = 0.41),
            Err(FrictionError::AsymmetryTooLarge("coulomb_asymmetry"))
        );
        assert_eq!(
            with(|f| f.viscous_asymmetry = -0.31),
            Err(FrictionError::AsymmetryTooLarge("viscous_asymmetry"))
        );
        assert_eq!(
            with(|f| f.stribeck_velocity = 0.0),
            Err(FrictionError::NoStribeckVelocity)
        );
        assert_eq!(with(|_| ()), Ok(()));
    }
}
