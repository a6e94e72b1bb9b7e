//! Faults of one recording as data.

use crate::faults::misfit::Misfit;
use crate::faults::names::Name;
use crate::faults::physical::Load;
use crate::outcome::{About, FaultKind};
use rig_data::Implausible;

/// A fault of one recording.
#[derive(Clone, Debug)]
pub(crate) struct Fault {
    /// From 0; `None` if it concerns the recording as a whole.
    pub(crate) joint: Option<usize>,
    pub(crate) finding: Finding,
    pub(crate) beside: Beside,
}

/// Another explanation that fits as well as a fault.
#[derive(Clone, Debug)]
pub(crate) enum Beside {
    /// None.
    Nothing,
    /// Another fault.
    Fault(Box<Fault>),
    /// An explanation without a fault, so that the fault is not certain.
    NoFault(Explanation),
}

/// Explanation of a recording without a fault.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Explanation {
    /// The description, with friction of its own.
    Description,
    /// A payload on the last link.
    Payload(Load),
    /// Other masses and friction than described.
    OtherMasses,
}

/// Duration of recordings that are too short.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Short {
    /// One recording: its rows, and its time, s.
    Recording {
        /// Number of rows.
        rows: usize,
        /// s
        time: f64,
    },
    /// The training recordings, or those of them without external loads.
    Training {
        /// True for the recordings without external loads.
        unburdened: bool,
        /// s
        time: f64,
        /// Time in motion, s, if that alone is too short.
        moving: Option<f64>,
    },
    /// The hold-out: its seconds in motion.
    Holdout {
        /// s in motion
        moving: f64,
    },
}

/// What is wrong.
#[derive(Clone, Debug)]
pub(crate) enum Finding {
    /// No joint moves.
    NoMotion,
    Short(Short),
    /// An implausible time column.
    Clock(Implausible),
    /// An implausible column of a joint, and what it concerns.
    Column(Implausible, About),
    /// A measured velocity against the position.
    VelocityReversed,
    /// A position that changes by `factor` times the integral of the measured velocity.
    VelocityScaled {
        factor: f64,
        name: Option<Name>,
        /// True if the name is one of the position.
        of_position: bool,
    },
    /// A torque at its limit for a share of the time in motion.
    AtLimit {
        /// N·m or N
        limit: f64,
        share: f64,
    },
    /// A link encoder with jumps …
    LinkJumps,
    /// … that stands still …
    LinkStill,
    /// … that runs against the joint …
    LinkReversed,
    /// … or moves `factor` times as far as the joint.
    LinkScaled {
        factor: f64,
        name: Option<Name>,
    },
    /// A misfit of models.
    Fit(Misfit),
}

impl Fault {
    /// Returns a fault of a joint.
    pub(crate) fn of_joint(joint: usize, finding: impl Into<Finding>) -> Self {
        Self {
            joint: Some(joint),
            finding: finding.into(),
            beside: Beside::Nothing,
        }
    }

    /// Returns a fault of the recording as a whole.
    pub(crate) fn of_recording(finding: impl Into<Finding>) -> Self {
        Self {
            joint: None,
            finding: finding.into(),
            beside: Beside::Nothing,
        }
    }

    /// Returns true if it concerns columns of joint `j`.
    pub(crate) fn concerns(&self, j: usize) -> bool {
        match (&self.finding, self.joint) {
            (Finding::Fit(Misfit::Order { order, .. }), _) => order[j] != j,
            (_, Some(joint)) => joint == j,
            (finding, None) => finding.about() == About::Motion,
        }
    }

    /// Returns true if nothing without a fault explains the data.
    pub(crate) fn is_certain(&self) -> bool {
        let doubt = match &self.finding {
            Finding::Column(problem, _) | Finding::Clock(problem) => problem.is_doubt(),
            // The drive itself may have changed.
            Finding::Fit(Misfit::GainChanged { .. }) => true,
            _ => false,
        };
        !doubt && !matches!(self.beside, Beside::NoFault(_))
    }
}

impl Finding {
    /// Returns true if the gears of all joints were forgotten, or counted twice.
    pub(crate) fn is_of_all_gears(&self) -> bool {
        matches!(self, Self::Fit(Misfit::ThroughGears { .. }))
    }

    /// Returns the kind of the fault.
    pub(crate) fn kind(&self) -> FaultKind {
        let named = |name: &Option<Name>, unnamed| name.as_ref().map_or(unnamed, Name::kind);
        match self {
            Self::NoMotion | Self::LinkStill => FaultKind::NotMoving,
            Self::Short(Short::Training {
                moving: Some(_), ..
            }) => FaultKind::NotMoving,
            Self::Short(_) => FaultKind::TooShort,
            Self::Clock(_) => FaultKind::Clock,
            Self::Column(problem, _) => of_column(problem),
            Self::VelocityScaled { name, .. } => named(name, FaultKind::Ratio),
            Self::LinkScaled { name, .. } => named(name, FaultKind::Unit),
            Self::VelocityReversed | Self::LinkReversed => FaultKind::Sign,
            Self::AtLimit { .. } => FaultKind::Saturation,
            Self::LinkJumps => FaultKind::Jump,
            Self::Fit(misfit) => misfit.kind(),
        }
    }

    /// Returns true if it names an error of the description.
    pub(crate) fn is_of_description(&self) -> bool {
        matches!(self, Self::Fit(misfit) if misfit.is_of_description())
    }

    /// Returns the check of the column that found it, if one did.
    pub(crate) fn column(&self) -> Option<&Implausible> {
        match self {
            Self::Column(problem, _) | Self::Clock(problem) => Some(problem),
            _ => None,
        }
    }

    /// Returns the columns that it concerns.
    pub(crate) fn about(&self) -> About {
        match self {
            Self::NoMotion | Self::Short(_) | Self::Clock(_) => About::Recording,
            Self::Column(_, about) => *about,
            Self::AtLimit { .. } => About::Torque,
            Self::Fit(misfit) => misfit.about(),
            _ => About::Motion,
        }
    }
}

impl From<Misfit> for Finding {
    fn from(misfit: Misfit) -> Self {
        Self::Fit(misfit)
    }
}

fn of_column(problem: &Implausible) -> FaultKind {
    match problem {
        Implausible::Jump { .. } | Implausible::Outlier { .. } | Implausible::Spike { .. } => {
            FaultKind::Jump
        }
        Implausible::HeldPosition { .. }
        | Implausible::HeldEffort { .. }
        | Implausible::Frozen { .. } => FaultKind::Held,
        Implausible::Unsigned { .. } => FaultKind::Unsigned,
        _ => FaultKind::Unit,
    }
}
