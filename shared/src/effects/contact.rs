//! The sliding contact of a joint, through which its dry friction acts. Beside a presliding law, friction that grows
//! with the load, varies with the position or falls with speed builds up with the presliding state and not at once. It
//! also bends the contact farther before it slides ([`Instant::extra_friction_ratio`]), at the same stiffness. The
//! hidden state is the contact's torque over the model's own friction. A contact that sticks while its friction changes
//! keeps its torque, as a spring does, so that no change of friction does work. Beside friction that falls with speed,
//! Dahl's law is LuGre's without micro-damping (Canudas de Wit, Olsson, Åström, Lischinsky 1995, eqs. 4 to 6).
//!
//! Source: Lampaert, Al-Bender, Swevers 2003, eqs. 8 to 10; their elements slip at their share of the total friction.
//! Leaves out: friction that differs with the direction (a constant beside symmetric friction). If presliding
//! holds only a part of the model's dry friction, the other friction makes the contact stiffer.

use super::effect::{Effect, Memory};
use super::instant::Instant;
use super::kind::Kind;
use crate::scalar::Real;

impl Kind {
    /// Returns true if it is a presliding law: friction that builds up over a distance.
    pub const fn is_presliding(self) -> bool {
        matches!(
            self,
            Self::PreslidingDahl | Self::PreslidingLugre | Self::PreslidingMaxwell
        )
    }

    /// Returns true if it is dry friction that acts through the same contact as the joint's presliding.
    pub const fn acts_through_contact(self) -> bool {
        matches!(
            self,
            Self::LoadFriction
                | Self::PositionFriction
                | Self::Stribeck
                | Self::StribeckExponential
        )
    }
}

impl<T: Real> Effect<T> {
    /// Returns the deflection of the contact of a presliding effect with the friction `extra_friction_ratio`
    /// ([`Instant::extra_friction_ratio`]). Effects with [`Kind::acts_through_contact`] use it as their direction. It
    /// lies in −1 to 1, except with Dahl's law right after friction has fallen below the torque that the contact holds.
    #[inline(always)]
    pub fn contact_deflection(&self, memory: &Memory<T>, extra_friction_ratio: T) -> T {
        let instant = Instant {
            extra_friction_ratio,
            ..Instant::default()
        };
        let share = |state: T| state / instant.friction_ratio();
        match self.kind {
            Kind::PreslidingDahl => return share(memory.0[0]),
            // A bristle that is bent farther holds the breakaway torque of its own law.
            Kind::PreslidingLugre => return share(memory.0[0]).clamp_to(-T::ONE, T::ONE),
            _ => {}
        }
        let (mut sum, mut total_gain, mut mean_state) = (T::ZERO, T::ZERO, T::ZERO);
        for (gain, state) in self.gains.into_iter().zip(memory.0) {
            let state = share(state);
            sum += gain * state;
            total_gain += gain;
            mean_state += state;
        }
        let mean_state = mean_state * T::from_f64(0.25);
        T::select(
            T::ZERO.lt(total_gain),
            sum / total_gain.max(T::from_f64(1e-30)),
            mean_state,
        )
    }
}
