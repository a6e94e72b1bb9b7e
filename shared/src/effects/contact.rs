//! The sliding contact of a joint, through which its dry friction acts: where a law with memory of distance stands, what grows with
//! the load, varies with the position or falls with the speed builds up as that does and not at once, and bends the contact farther
//! before it slides ([`Instant::beside`]): what bends is as stiff as it was. What is remembered is the torque that the contact holds,
//! over the model's own friction: one that sticks while its friction changes keeps its torque, as a spring does, so that no change of
//! friction does work. Beside friction that falls with the speed Dahl's law is LuGre's without micro-damping (Canudas de Wit, Olsson,
//! Åström, Lischinsky 1995, eqs. 4 to 6).
//!
//! Source: Lampaert, Al-Bender, Swevers 2003, eqs. 8 to 10, whose elements slip at their share of all the friction there is. Leaves
//! out: friction that differs with the direction, which is a constant beside one that does not. Stiffness is kept where presliding
//! holds all of the model's dry friction; where it holds a part, what bends is stiffer by what acts through it besides.

use super::{Effect, Instant, Kind, Memory};
use crate::scalar::Real;

impl Kind {
    /// Whether it is a law of friction that builds up over a distance.
    pub const fn is_presliding(self) -> bool {
        matches!(
            self,
            Self::PreslidingDahl | Self::PreslidingLugre | Self::PreslidingMaxwell
        )
    }

    /// Whether it is dry friction that acts through the same contact as presliding of the joint.
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
    /// How far the contact is bent that an effect of presliding remembers, with friction [`Instant::beside`] its own: what
    /// [`Kind::acts_through_contact`] has in the place of its direction. From −1 to 1, but where friction has just fallen below what a
    /// bristle of Dahl's law holds.
    #[inline(always)]
    pub fn bent(&self, memory: &Memory<T>, beside: T) -> T {
        let at = Instant {
            beside,
            ..Instant::default()
        };
        let share = |state: T| state / at.whole();
        match self.kind {
            Kind::PreslidingDahl => return share(memory.0[0]),
            // A bristle that is bent farther holds the breakaway of its own law.
            Kind::PreslidingLugre => return share(memory.0[0]).clamp_to(-T::ONE, T::ONE),
            _ => {}
        }
        let (mut sum, mut whole, mut alike) = (T::ZERO, T::ZERO, T::ZERO);
        for (gain, state) in self.gains.into_iter().zip(memory.0) {
            let state = share(state);
            sum += gain * state;
            whole += gain;
            alike += state;
        }
        let alike = alike * T::from_f64(0.25);
        T::select(
            T::ZERO.lt(whole),
            sum / whole.max(T::from_f64(1e-30)),
            alike,
        )
    }
}
