//! The compensation of an effect by its description.

use crate::effects::{About, Channel, Direction};

/// How an effect is compensated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A torque with the direction and share of the friction law.
    DryFriction,
    /// A torque at the measured position, in full.
    StaticTorque,
    /// A correction of the measured position.
    Position,
    /// A correction of the measured current.
    Current,
    /// A voltage in the direction of the current.
    Voltage,
}

impl Role {
    /// Returns the role by the effect's description.
    pub(crate) const fn from_about(about: &About) -> Option<Self> {
        match (about.channel, about.direction) {
            (Channel::Torque, Direction::Dry) if about.compensable => Some(Self::DryFriction),
            // A payload belongs into the model, which knows the direction of gravity.
            (Channel::Torque | Channel::Load, Direction::Indifferent)
                if about.compensable && !str_eq(about.name, "payload") =>
            {
                Some(Self::StaticTorque)
            }
            // A sensor error can be subtracted only if it is a constant or a known function of the position.
            (Channel::Position, _) if str_eq(about.name, "encoder_eccentricity") => {
                Some(Self::Position)
            }
            (Channel::Effort, _) if str_eq(about.name, "current_offset") => Some(Self::Current),
            (Channel::Voltage, _) => Some(Self::Voltage),
            _ => None,
        }
    }
}

/// Compares two texts at compile time.
const fn str_eq(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut k = 0;
    while k < a.len() && k < b.len() && a[k] == b[k] {
        k += 1;
    }
    k == a.len() && k == b.len()
}
