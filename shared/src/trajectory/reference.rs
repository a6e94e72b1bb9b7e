//! The motion that a trajectory asks for at one time.

use crate::scalar::Real;

/// Position, velocity and acceleration of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference<T> {
    /// rad
    pub position: T,
    /// rad/s
    pub velocity: T,
    /// rad/s²
    pub acceleration: T,
}

impl<T: Real> Reference<T> {
    /// Returns a reference at rest at a position.
    pub(super) fn rest(position: T) -> Self {
        Self {
            position,
            velocity: T::ZERO,
            acceleration: T::ZERO,
        }
    }

    /// Returns the reference multiplied by a number.
    pub(super) fn scaled(self, share: T) -> Self {
        Self {
            position: share * self.position,
            velocity: share * self.velocity,
            acceleration: share * self.acceleration,
        }
    }

    /// Returns the motion multiplied by an envelope with its own first and second derivative (product rule).
    pub(super) fn under(self, envelope: Self) -> Self {
        let two = T::from_f64(2.0);
        Self {
            position: envelope.position * self.position,
            velocity: envelope.velocity * self.position + envelope.position * self.velocity,
            acceleration: envelope.acceleration * self.position
                + two * envelope.velocity * self.velocity
                + envelope.position * self.acceleration,
        }
    }
}
