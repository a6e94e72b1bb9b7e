//! The compensation of each kind of effect, or the reason why there is no compensation.

use core::fmt;

use crate::effects::{About, Channel, Direction, Kind};

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
    /// Returns the role of this kind; `None` if it cannot be compensated.
    pub const fn of(kind: Kind) -> Option<Self> {
        Self::by(kind.about())
    }

    /// Returns why this kind is not compensated, and what to do instead; `None` if it is compensated.
    pub const fn refusal(kind: Kind) -> Option<&'static str> {
        if Self::of(kind).is_some() {
            return None;
        }
        Some(match kind.about().channel {
            Channel::Transmission => {
                "it acts between motor and link, where no torque of the motor undoes it: while teeth are apart or a shaft \
                 twists, the encoder on the motor does not see where the link is"
            }
            Channel::Effort => {
                "what is read late cannot be had earlier: it is one of the recording, so shift the columns of that"
            }
            Channel::Load => {
                "a mass on the link belongs into the link's inertial parameters, with which the model compensates it"
            }
            _ => "it needs the motion of another joint, and the rig has one",
        })
    }

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

/// Why an effect cannot be compensated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectFault {
    /// No torque and no correction compensates this kind.
    NotCompensable(Kind),
    /// This parameter is not a number within its physical bounds.
    Parameter(&'static str),
    /// A value after the effect's last parameter is not 0.
    Surplus,
}

impl fmt::Display for EffectFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotCompensable(kind) => write!(
                f,
                "{} cannot be compensated: {}",
                kind.about().title,
                Role::refusal(*kind).unwrap_or_default()
            ),
            Self::Parameter(name) => {
                write!(f, "the effect's {name} is not within its physical bounds")
            }
            Self::Surplus => f.write_str("values beyond the effect's parameters must be 0"),
        }
    }
}

impl core::error::Error for EffectFault {}
