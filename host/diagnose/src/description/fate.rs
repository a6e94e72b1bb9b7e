//! Fates of the described effects.

use std::collections::BTreeMap;

use rig_shared::effects::Kind;

use crate::outcome::{Fate, Value};

/// Reason why a described effect is held as stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HeldBecause {
    /// A fitted tilt is the direction of gravity, which the description states beside it.
    DirectionOfGravity,
    /// It acts on the motor voltage alone.
    VoltageAlone,
    /// The temperature was not recorded throughout.
    NoTemperature,
    /// It was left out of the search.
    LeftOut,
    /// A delay within the uncertainty of the sampling instants.
    WithinSampling,
    /// Its torque is collinear with other parameters along this motion.
    Collinear,
    /// The recordings neither show nor contradict it.
    NotShown,
    /// It is simulated, but not fitted to a voltage.
    NotFittedToVoltage,
    /// The simulation of a joint under voltage does not have it.
    NotSimulated,
}

/// A stated value of a described effect.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StatedParameter {
    /// Name of the parameter.
    pub(crate) name: &'static str,
    /// The described value, SI.
    pub(crate) stated: f64,
    /// Unit, ASCII.
    pub(crate) unit: String,
}

/// Treatment of a described effect in the last model, with its details.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum FateCause {
    /// It is part of its link.
    InTheLink,
    /// It stays with its described parameters.
    Held {
        /// Why.
        why: HeldBecause,
        /// True if its torque was subtracted from the recordings.
        taken_off: bool,
    },
    /// It was refitted together with everything else.
    FittedAgain {
        /// Parameters that have changed, with their new values.
        changed: Vec<(StatedParameter, f64)>,
    },
    /// The recordings contradict it.
    Dropped {
        /// Its parameters.
        stated: Vec<StatedParameter>,
        /// True for a tilt that another one replaces.
        replaced_tilt: bool,
    },
}

/// Fate of a described effect.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DescribedFate {
    /// Its law, that of the last model if it is in it.
    pub(crate) kind: Kind,
    /// Its joint, from 0.
    pub(crate) joint: usize,
    /// Its treatment.
    pub(crate) cause: FateCause,
    /// Its fitted parameters; empty if it was not refitted.
    pub(crate) parameters: BTreeMap<String, Value>,
}

impl FateCause {
    /// Returns the fate for the result.
    pub(crate) fn fate(&self) -> Fate {
        match self {
            Self::InTheLink => Fate::InTheLink,
            Self::Held { .. } => Fate::Held,
            Self::FittedAgain { .. } => Fate::FittedAgain,
            Self::Dropped { .. } => Fate::Dropped,
        }
    }
}
