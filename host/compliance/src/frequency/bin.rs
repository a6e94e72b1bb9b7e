//! The transforms of the columns of one joint at one frequency.

use super::two_mass::C;

/// Acceleration of the reference, or torque, over the largest one, from which on it excites a band. What a recording without noise
/// shows below is coherent by rounding and by friction alone.
pub(super) const EXCITED: f64 = 1e-3;

/// Transforms at one frequency.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bin {
    /// rad/s.
    pub omega: f64,
    /// Instrument: reference, or the torque itself.
    pub instrument: C,
    /// Torque.
    pub torque: C,
    /// Velocity of the motor, joint side.
    pub velocity: C,
    /// Friction of the motor over its size.
    pub sign: C,
    /// Friction of the link over its size, by a model.
    pub link_sign: C,
    /// Torque that a gap takes away, over c and the gap, by a model.
    pub gap: C,
    /// Torque of gravity on the link less its linear part, by a model, and that of the other joints' motion.
    pub gravity: C,
}

impl Bin {
    /// Applies a function to each transform.
    pub(super) fn map(&self, f: impl Fn(C) -> C) -> Self {
        self.zip(self, |x, _| f(x))
    }

    /// Applies a function to each transform of two bins of one frequency.
    pub(super) fn zip(&self, other: &Self, f: impl Fn(C, C) -> C) -> Self {
        Self {
            omega: self.omega,
            instrument: f(self.instrument, other.instrument),
            torque: f(self.torque, other.torque),
            velocity: f(self.velocity, other.velocity),
            sign: f(self.sign, other.sign),
            link_sign: f(self.link_sign, other.link_sign),
            gap: f(self.gap, other.gap),
            gravity: f(self.gravity, other.gravity),
        }
    }
}
