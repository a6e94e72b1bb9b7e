//! Limits of the rig, and the limits that act now. A limit is no fault: the rig goes on, and reports why torque is
//! missing. The set of acting limits also has marks: ticks that come late, and readings that are in doubt.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::scalar::Real;

/// Limits of the rig, joint-side unless stated otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Limits<T> {
    /// Lowest reference position, rad.
    pub position_low: T,
    /// Highest reference position, rad.
    pub position_high: T,
    /// Highest speed, rad/s.
    pub velocity: T,
    /// Highest acceleration of a reference, rad/s².
    pub acceleration: T,
    /// Highest torque, N·m.
    pub torque: T,
    /// Highest continuous motor current, A.
    pub continuous_current: T,
    /// Highest motor current, A.
    pub peak_current: T,
}

impl<T: Real<Mask = bool>> Limits<T> {
    /// Returns true if every limit is a finite positive number and the position range is not empty. NaN fails each
    /// comparison.
    pub fn is_valid(&self) -> bool {
        let huge = T::from_f64(1e9);
        let positive = |x: T| T::ZERO.lt(x) && x.lt(huge);
        positive(self.velocity)
            && positive(self.acceleration)
            && positive(self.torque)
            && positive(self.continuous_current)
            && self.continuous_current.le(self.peak_current)
            && positive(self.peak_current)
            && self.position_low.lt(self.position_high)
            && positive(self.position_high - self.position_low)
    }

    /// Returns true if no limit exceeds that of `ratings`. NaN fails each comparison.
    pub fn is_within(&self, ratings: &Self) -> bool {
        self.velocity.le(ratings.velocity)
            && self.acceleration.le(ratings.acceleration)
            && self.torque.le(ratings.torque)
            && self.continuous_current.le(ratings.continuous_current)
            && self.peak_current.le(ratings.peak_current)
            && ratings.position_low.le(self.position_low)
            && self.position_high.le(ratings.position_high)
    }
}

/// A limit that can act, or a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Limit {
    /// The commanded joint torque was cut to `Limits::torque`.
    Torque = 1,
    /// The commanded current was cut to `Limits::peak_current`.
    Current = 2,
    /// The voltage was cut to the available supply voltage.
    Voltage = 4,
    /// The reference was held at the edge of the position range.
    Position = 8,
    /// The host is silent: the rig comes to rest.
    HostSilent = 16,
    /// A control tick was missed or finished late. The next one within a tenth of a second is a fault.
    LateTick = 32,
    /// Mark: the current was read before its amplifier had settled after an edge of the bridge. The on-line estimator
    /// does not learn from such a reading.
    Unsettled = 64,
}

impl Limit {
    /// Every limit, for iteration.
    pub const ALL: [Self; 7] = [
        Self::Torque,
        Self::Current,
        Self::Voltage,
        Self::Position,
        Self::HostSilent,
        Self::LateTick,
        Self::Unsettled,
    ];

    /// Returns the name for plots and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::Current => "current",
            Self::Voltage => "voltage",
            Self::Position => "position",
            Self::HostSilent => "host silent",
            Self::LateTick => "late tick",
            Self::Unsettled => "current not settled",
        }
    }
}

/// Limits and marks that act now, as a set of bits (the values of [`Limit`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LimitSet(pub u8);

impl LimitSet {
    /// Adds a limit if `acting`.
    pub fn set(&mut self, limit: Limit, acting: bool) {
        if acting {
            self.0 |= limit as u8;
        }
    }

    /// Returns true if the limit is in the set.
    pub const fn has(self, limit: Limit) -> bool {
        self.0 & limit as u8 != 0
    }

    /// Returns the limits in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
