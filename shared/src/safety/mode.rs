//! Mode of the rig and its transitions.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The mode of the rig.
///
/// ```text
///   power on
///      │
///      ▼       offset in band             Arm                  Start
///  Calibrating ──────────────► Disarmed ───────► Holding ───────────────► Running
///      │                         ▲   ▲            │   ▲                      │
///      │ offset out of band      │   └──Disarm────┤   └─at rest─ Stopping ◄──┘ end, Stop,
///      │                         │                │                 │          host silent
///      ▼                ClearFault                ▼                 ▼
///    Fault ◄──────────────────────────── a fault, from any mode; the motor brakes or coasts
/// ```
///
/// `Disarm` is accepted in every mode with the bridge on, and ends the braking after a fault. Nothing moves without `Arm`. The first reference of `Holding`
/// is the position of the link at that moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Mode {
    /// Measuring the current sensor's offset; the bridge is off.
    #[default]
    Calibrating,
    /// Bridge off, ready to be armed.
    Disarmed,
    /// Bridge on, holding position.
    Holding,
    /// Running a trajectory.
    Running,
    /// Coming to rest under control.
    Stopping,
    /// A fault is latched: the motor brakes or coasts ([`Fault::reaction`](super::Fault::reaction)).
    Fault,
}

impl Mode {
    /// Returns true if the rig controls the motor.
    pub const fn drives(self) -> bool {
        matches!(self, Self::Holding | Self::Running | Self::Stopping)
    }

    /// Returns the name for tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Calibrating => "calibrating",
            Self::Disarmed => "disarmed",
            Self::Holding => "holding",
            Self::Running => "running",
            Self::Stopping => "stopping",
            Self::Fault => "fault",
        }
    }
}
