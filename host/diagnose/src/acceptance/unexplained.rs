//! Residuals that no known effect explains, with their causes.

use rig_shared::effects::Kind;

use crate::acceptance::lack_of_fit::Misfit;
use crate::acceptance::residual_dependence::dependence::Dependence;
use crate::outcome::{DataFault, Left};

/// A residual that no known effect explains.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Unexplained {
    /// Name of the joint.
    pub(crate) joint: String,
    /// Unit of the residual, ASCII.
    pub(crate) unit: String,
    /// RMS beyond the noise floor, in that unit.
    pub(crate) rms: f64,
    /// Residual RMS over the noise floor.
    pub(crate) ratio: f64,
    /// Coordinates that it depends on.
    pub(crate) places: Vec<Dependence>,
    /// Why it counts as unexplained.
    pub(crate) cause: RemainderCause,
}

/// Reason why a residual counts as unexplained. Residuals are RMS values in the unit of [`Unexplained::unit`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum RemainderCause {
    /// The training residual exceeds the noise floor and depends on the motion.
    BeyondFloor {
        /// True if effects of the joint were accepted.
        beside_effects: bool,
        /// Its clearest dependence on a coordinate, if any.
        shown: Option<Dependence>,
    },
    /// The mean residual differs between the recordings without and with external loads.
    ChangedBesides {
        /// Difference of the means, without minus with.
        step: f64,
        /// Its standard deviation.
        std: f64,
    },
    /// The mean residual differs between two runs of one motion.
    ChangedBetween {
        /// Difference of the means, second minus first run.
        step: f64,
        /// Its standard deviation.
        std: f64,
        /// Labels of the two runs.
        runs: [String; 2],
    },
    /// Most of the residual lies in a few short stretches.
    Disturbance {
        /// Share of the squares in these stretches.
        share: f64,
        /// Number of stretches.
        count: usize,
        /// Recording with the largest one.
        label: String,
        /// Start and end of the largest one, s.
        time: [f64; 2],
        /// RMS of the largest one over that of the others.
        times: f64,
    },
    /// The residual is far above the reading noise, and no motion was repeated.
    FarAboveReading {
        /// The residual.
        residual: f64,
    },
    /// The fitted friction falls with the speed over nearly all speeds.
    FallsThroughout {
        /// Velocity of the fitted law, rad/s or m/s.
        velocity: f64,
        /// Largest recorded speed, rad/s or m/s.
        fastest: f64,
        /// Unit of the position, ASCII.
        position_unit: &'static str,
    },
    /// A free function takes away residual that the right effects would not leave.
    LackOfFit {
        /// Names of the joint's effects; empty if none was found.
        names: Vec<&'static str>,
        /// The free function.
        misfit: Misfit,
    },
    /// The residual of the hold-out exceeds its noise floor, and the training data do not show why.
    OnHoldOut {
        /// Training residual over its noise floor, if it is also above the noise.
        training_ratio: Option<f64>,
    },
    /// The effects do not reduce the residual of the hold-out.
    NotCarriedOver,
    /// A law that was dropped for its values reduces the residual of a joint without effects.
    TakenByNone {
        /// The law.
        kind: Kind,
        /// Share of the RMS that it removes on blocks outside its fit.
        gain: f64,
    },
    /// The recordings are too short to search for effects.
    TooShort {
        /// How short they are.
        fault: DataFault,
        /// The residual.
        residual: f64,
        /// Its share of the torque's RMS.
        share: f64,
    },
    /// The written model leaves the gap open.
    GapOpen {
        /// Its residual.
        left: Left,
        /// True if an effect was found on the joint.
        named: bool,
    },
}

impl RemainderCause {
    /// Returns true if it is not a residual beyond a known floor, but a reason to doubt a full explanation.
    pub(crate) fn is_doubt(&self) -> bool {
        !matches!(self, Self::BeyondFloor { .. } | Self::OnHoldOut { .. })
    }
}
