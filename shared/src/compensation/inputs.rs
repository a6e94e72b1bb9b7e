//! Inputs of the compensation in a control tick.

use crate::effects::Instant;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// Inputs of the compensation in a control tick. Joint-side, SI.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs<T> {
    /// Desired motion of the link.
    pub reference: Reference<T>,
    /// Measured position, rad.
    pub position: T,
    /// Measured velocity, rad/s.
    pub velocity: T,
    /// Motor turns per joint turn.
    pub gear_ratio: T,
    /// Angle of the motor, rad.
    pub motor_angle: T,
    /// Motor angle within one turn, rad, without the rounding error of many turns.
    pub angle_in_turn: T,
    /// True if the position is known. Otherwise effects that depend on the position give no torque.
    pub position_known: bool,
    /// True if the tick has no time for a law: all laws then hold their values.
    pub busy: bool,
    /// True if the periodic effects are updated by their angle in this tick, as every tick that is not busy must do.
    /// Otherwise they are extrapolated along a parabola.
    pub rotates_waves: bool,
    /// Torque that the drive gives, N·m.
    pub drive_torque: T,
    /// Torque that the gear transmits, without the torque of effects, N·m.
    pub load: T,
    /// Coulomb friction of the joint, N·m.
    pub coulomb: T,
    /// Viscous friction of the joint, N·m·s/rad.
    pub viscous: T,
    /// Running time, s.
    pub time: T,
    /// Temperature above that at the start, K.
    pub temperature_rise: T,
    /// Time since the last tick that was not busy, s.
    pub period: T,
    /// Delay until an ordered torque acts, s.
    pub torque_delay: T,
    /// Whole ticks of that delay, below [`HISTORY_TICKS`](super::HISTORY_TICKS) − 1.
    pub delay_ticks: u8,
    /// The fraction of a tick that remains of that delay.
    pub delay_fraction: T,
}

impl<T: Real> Inputs<T> {
    /// Returns the motor's angle: within a turn for `whole` orders, else over all turns.
    #[inline(always)]
    pub(super) fn angle(&self, whole: bool) -> T {
        if whole {
            self.angle_in_turn
        } else {
            self.motor_angle
        }
    }

    /// Returns the friction of the joint at a velocity and in a direction, N·m.
    #[inline(always)]
    pub(super) fn friction(&self, velocity: T, direction: T) -> T {
        self.coulomb * direction + self.viscous * velocity
    }

    /// Returns the inputs of an effect: at the reference's acceleration and at rest.
    #[inline(always)]
    pub(super) fn instant(&self, whole: bool) -> Instant<T> {
        Instant {
            position: self.position,
            velocity: T::ZERO,
            acceleration: self.reference.acceleration,
            direction: T::ZERO,
            motor_angle: self.angle(whole),
            drive_torque: self.drive_torque,
            // Laws of sensor delay and of payload are not compensated.
            drive_rate: T::ZERO,
            gravity: T::ZERO,
            load: self.load,
            friction: T::ZERO,
            time: self.time,
            temperature_rise: self.temperature_rise,
            other: [T::ZERO; 3],
            period: self.period,
            travel: T::ZERO,
            extra_friction_ratio: T::ZERO,
        }
    }
}
