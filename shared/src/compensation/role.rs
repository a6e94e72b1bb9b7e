//! The compensation of an effect by its description.

use crate::effects::{About, Channel, Direction};

/// How an effect is compensated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A torque with the direction and share of the friction law.
    Dry,
    /// A torque at the measured position, in full.
    Standing,
    /// A correction of the measured position.
    Position,
    /// A correction of the measured current.
    Current,
    /// A voltage in the direction of the current.
    Voltage,
}

impl Role {
    /// Returns the role by the effect's description.
    pub(crate) const fn by(about: &About) -> Option<Self> {
        match (about.channel, about.direction) {
            (Channel::Torque, Direction::Dry) if about.compensable => Some(Self::Dry),
            // A payload belongs into the model, which knows the direction of gravity.
            (Channel::Torque | Channel::Load, Direction::Indifferent)
                if about.compensable && !same(about.name, "payload") =>
            {
                Some(Self::Standing)
            }
            // A sensor error can be subtracted only if it is a constant or a known function of the position.
            (Channel::Position, _) if same(about.name, "encoder_eccentricity") => {
                Some(Self::Position)
            }
            (Channel::Effort, _) if same(about.name, "current_offset") => Some(Self::Current),
            (Channel::Voltage, _) => Some(Self::Voltage),
            _ => None,
        }
    }
}

/// Compares two texts at compile time.
const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut k = 0;
    while k < a.len() && k < b.len() && a[k] == b[k] {
        k += 1;
    }
    k == a.len() && k == b.len()
}
