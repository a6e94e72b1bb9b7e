//! Faults that models of the robot show, as data.

use crate::faults::names::Name;
use crate::faults::undo::Columns;
use crate::outcome::{About, FaultKind};

/// Evidence for the column with the wrong sense, of torque and position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sense {
    /// The reference runs against the position.
    Reference,
    /// Gravity has the right sense, so the position is reversed.
    GravityRight,
    /// Gravity has the wrong sense too, so the torque is reversed.
    GravityWrong,
    /// None.
    Open,
}

/// Other sign of a reversed column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reversal {
    /// The reference runs against it as well.
    AgainstReference,
    /// The other column of the joint, reversed, explains the recording too.
    OrOther,
    /// None.
    Alone,
}

/// Described parts of a torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Needs {
    Gravity,
    Inertia,
    Both,
}

/// What is wrong. `left` are residual shares of the torque's variance: as recorded, and without the fault.
#[derive(Clone, Debug)]
pub(crate) enum Misfit {
    /// A torque that is cut for some per cent of the time, below what the motion needs.
    Clipped {
        /// N·m or N
        level: f64,
        /// Mean torque that the motion needs beyond the level.
        excess: f64,
        percent: f64,
    },
    /// A torque that is `shift` seconds behind the position.
    Shifted { shift: f64, left: [f64; 2] },
    /// A position that fits its torque if multiplied by `factor`.
    Scaled {
        factor: f64,
        /// True if the best factor is negative.
        reversed: bool,
        name: Option<Name>,
        left: [f64; 2],
    },
    /// All positions fit if multiplied by `factor`.
    AllScaled { factor: f64, left: [f64; 2] },
    /// All torques or positions by the gear ratio of their own joint.
    ThroughGears {
        /// True for the torques.
        torque: bool,
        /// True if the ratios were applied twice, false if not at all.
        twice: bool,
        left: [f64; 2],
    },
    /// A position from another zero.
    Zero {
        /// Angle to add, rad.
        angle: f64,
        left: [f64; 2],
    },
    /// A reversed torque or position.
    Reversed {
        /// True for the torque.
        torque: bool,
        other: Reversal,
        left: [f64; 2],
    },
    /// A joint axis that points the other way.
    AxisReversed { left: [f64; 2] },
    /// Columns in another order, see [`crate::faults::undo::Undo::Order`].
    Order {
        which: Columns,
        order: Vec<usize>,
        /// True if the other columns of these joints explain it too.
        twin: bool,
        left: [f64; 2],
    },
    /// Torque and position in opposite senses.
    Opposed {
        /// Friction power, W.
        loss: f64,
        /// The joint's own inertia, kg·m² or kg.
        inertia: f64,
        sense: Sense,
    },
    /// Gravity of another direction.
    GravityTurned {
        /// Degrees.
        angle: f64,
        left: [f64; 2],
    },
    /// Gravity on a joint that is described as upright.
    LevelAxis {
        /// Largest torque of gravity, N·m.
        strength: f64,
        /// The same as described, N·m.
        stated: f64,
    },
    /// Gravity that is strongest at another position than described.
    StrongestElsewhere {
        /// Position where it is strongest, rad.
        at: f64,
        /// The same as described, rad.
        stated: f64,
        /// Difference within half a turn, rad.
        off: f64,
    },
    /// Gravity that acts `times` as described, below zero.
    GravityReversed {
        times: f64,
        /// True if friction and inertia have the right sense.
        held: bool,
    },
    /// Torques of several joints, all a thousand times too large or small.
    Thousandfold {
        joints: Vec<usize>,
        /// Smallest and largest factor.
        factors: [f64; 2],
        /// True if they are too large.
        large: bool,
    },
    /// A torque that is `factor` times the described.
    TorqueTimes {
        factor: f64,
        needs: Needs,
        name: Option<Name>,
    },
    /// A clock that makes the inertia `times` the described.
    InertiaTimes { times: f64 },
    /// A torque that is `factor` times the described in all its parts.
    Alike {
        factor: f64,
        weight: f64,
        viscous: f64,
        dry: f64,
    },
    /// A described rotor with more inertia than its joint; kg·m² or kg.
    HeavyRotor { rotor: f64, whole: f64 },
    /// A torque whose gain changes within the recording.
    GainChanged {
        /// Earliest and latest time of the change, s.
        between: [f64; 2],
        /// Gain after the change over that before, and its standard deviation.
        factor: [f64; 2],
        left: [f64; 2],
    },
    /// A torque without its sign, which should be negative for some per cent of the time.
    Magnitude { percent: f64 },
}

impl Misfit {
    /// Returns the kind of the fault.
    pub(crate) fn kind(&self) -> FaultKind {
        let named = |name: &Option<Name>, unnamed| name.as_ref().map_or(unnamed, Name::kind);
        match self {
            Self::Shifted { .. } | Self::InertiaTimes { .. } => FaultKind::Clock,
            Self::Scaled {
                reversed: false,
                name,
                ..
            } => named(name, FaultKind::Ratio),
            Self::TorqueTimes { name, .. } => named(name, FaultKind::Unit),
            Self::Scaled { .. }
            | Self::Reversed { .. }
            | Self::AxisReversed { .. }
            | Self::Opposed { .. }
            | Self::GravityReversed { .. } => FaultKind::Sign,
            Self::Clipped { .. } => FaultKind::Saturation,
            Self::AllScaled { .. } | Self::Thousandfold { .. } => FaultKind::Unit,
            Self::Zero { .. } => FaultKind::Zero,
            Self::Order { .. } => FaultKind::Swap,
            Self::GravityTurned { .. }
            | Self::LevelAxis { .. }
            | Self::StrongestElsewhere { .. } => FaultKind::Gravity,
            Self::Alike { .. } | Self::HeavyRotor { .. } | Self::ThroughGears { .. } => {
                FaultKind::Ratio
            }
            Self::Magnitude { .. } => FaultKind::Magnitude,
            Self::GainChanged { .. } => FaultKind::Gain,
        }
    }

    /// Returns true if it names an error of the description.
    pub(crate) fn is_of_description(&self) -> bool {
        match self {
            Self::AxisReversed { .. }
            | Self::Zero { .. }
            | Self::GravityTurned { .. }
            | Self::LevelAxis { .. }
            | Self::StrongestElsewhere { .. }
            | Self::GravityReversed { .. }
            | Self::HeavyRotor { .. } => true,
            Self::Scaled { name, .. } | Self::TorqueTimes { name, .. } => {
                name.as_ref().is_some_and(Name::is_of_description)
            }
            _ => false,
        }
    }

    /// Returns the columns that it concerns.
    pub(crate) fn about(&self) -> About {
        match self {
            Self::GravityTurned { .. }
            | Self::LevelAxis { .. }
            | Self::StrongestElsewhere { .. }
            | Self::InertiaTimes { .. } => About::Recording,
            Self::Scaled { .. }
            | Self::AllScaled { .. }
            | Self::ThroughGears { torque: false, .. }
            | Self::Zero { .. }
            | Self::Reversed { torque: false, .. }
            | Self::AxisReversed { .. }
            | Self::Order {
                which: Columns::Positions | Columns::Joints,
                ..
            }
            | Self::GravityReversed { .. } => About::Motion,
            _ => About::Torque,
        }
    }
}
