//! The compensation of each kind of effect, or the reason why there is no compensation.

use core::fmt;

use super::role::Role;
use crate::effects::{Channel, Kind};

impl Role {
    /// Returns the role of this kind; `None` if it cannot be compensated.
    pub const fn of(kind: Kind) -> Option<Self> {
        Self::from_about(kind.about())
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
