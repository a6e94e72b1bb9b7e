//! What a control tick knows.

use crate::effects::Instant;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// What a control tick knows. Joint-side, SI.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Now<T> {
    /// Where the link should be.
    pub reference: Reference<T>,
    /// Measured position, rad.
    pub position: T,
    /// Measured velocity, rad/s.
    pub velocity: T,
    /// Motor turns per joint turn.
    pub gear_ratio: T,
    /// Angle of the motor, rad.
    pub motor_angle: T,
    /// The same within one turn, without the rounding of many turns.
    pub angle_in_turn: T,
    /// Whether somebody has said where the link stands: nothing can stand at a position that nobody knows.
    pub placed: bool,
    /// Whether the tick has enough else to do: the laws then stand as they are for one tick more.
    pub busy: bool,
    /// Whether what is periodic is turned in this tick, as it must be in every one that is not busy; in the others it goes along
    /// its parabola.
    pub turns: bool,
    /// Torque that the drive gives, N·m.
    pub drive_torque: T,
    /// Torque that the gear transmits, without that of effects, N·m.
    pub load: T,
    /// Coulomb friction of the joint, N·m.
    pub coulomb: T,
    /// Viscous friction of the joint, N·m·s/rad.
    pub viscous: T,
    /// Running time, s.
    pub time: T,
    /// Temperature above that at the start, K.
    pub warming: T,
    /// Time since the last tick that was not busy, s.
    pub period: T,
    /// How long a torque that is ordered takes to act, s.
    pub lead: T,
    /// The same in whole ticks, below [`GIVEN`](super::GIVEN) − 1.
    pub lead_ticks: u8,
    /// What is left of it, as a share of a tick.
    pub lead_share: T,
}

impl<T: Real> Now<T> {
    /// The motor's angle as an effect wants it.
    #[inline(always)]
    pub(super) fn angle(&self, whole: bool) -> T {
        if whole {
            self.angle_in_turn
        } else {
            self.motor_angle
        }
    }

    /// Friction of the joint at a velocity and in a direction, N·m.
    #[inline(always)]
    pub(super) fn friction(&self, velocity: T, direction: T) -> T {
        self.coulomb * direction + self.viscous * velocity
    }

    /// At the reference's acceleration, at rest.
    #[inline(always)]
    pub(super) fn instant(&self, whole: bool) -> Instant<T> {
        Instant {
            position: self.position,
            velocity: T::ZERO,
            acceleration: self.reference.acceleration,
            direction: T::ZERO,
            motor_angle: self.angle(whole),
            drive_torque: self.drive_torque,
            // Laws of what a sensor reads late, and of masses, are not compensated.
            drive_rate: T::ZERO,
            gravity: T::ZERO,
            load: self.load,
            friction: T::ZERO,
            time: self.time,
            warming: self.warming,
            other: [T::ZERO; 3],
            period: self.period,
            beside: T::ZERO,
        }
    }
}
