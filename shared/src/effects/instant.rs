//! Inputs of an effect.

use crate::scalar::Real;

/// Inputs of an effect at one instant. Joint-side, SI.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant<T> {
    /// rad or m
    pub position: T,
    /// rad/s or m/s
    pub velocity: T,
    /// rad/s² or m/s²
    pub acceleration: T,
    /// Direction of motion, −1 to 1. Not derived from the velocity: near rest the caller decides it.
    pub direction: T,
    /// Angle of the motor, rad.
    pub motor_angle: T,
    /// Torque of the motor by its current and nominal constant, times the ratio, N·m.
    pub drive_torque: T,
    /// Change of the drive torque, N·m/s.
    pub drive_rate: T,
    /// Torque that the gear transmits to the link, without friction and the drive's own inertia, N·m.
    pub load: T,
    /// Dry and viscous friction of the joint by its model without effects, against positive motion, N·m.
    pub friction: T,
    /// Torque of gravity per kg·m of first moment along x of the link's frame, m/s².
    pub gravity: T,
    /// Running time, s.
    pub time: T,
    /// Temperature above that at the start, K; 0 where it is not measured.
    pub temperature_rise: T,
    /// Position, velocity and acceleration of the other joint that the effect names; 0 where it names none.
    pub other: [T; 3],
    /// Time since the last instant, s.
    pub period: T,
    /// Travel of the contact since the last instant, rad or m. A controller takes the velocity times the period; between
    /// samples of a recording that would be half a period late, and a fitted stroke too long by it.
    pub travel: T,
    /// Ratio of other effects' friction that acts through the joint's contact to the model's friction, 1. The contact
    /// bends farther by this ratio before it slides.
    pub extra_friction_ratio: T,
}

impl<T: Real> Instant<T> {
    /// Returns the ratio of all friction that acts through the joint's contact to the model's friction, 1.
    #[inline(always)]
    pub(super) fn friction_ratio(&self) -> T {
        // Fits and precompensation may give a slightly negative friction.
        (T::ONE + self.extra_friction_ratio).max(T::from_f64(MIN_FRICTION_RATIO))
    }
}

/// Smallest share of a contact's own friction that remains when effects reduce it, 1.
const MIN_FRICTION_RATIO: f64 = 0.1;
