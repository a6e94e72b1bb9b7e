//! What the rig is doing, and what it may do next.

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
///    Fault ◄──────────────────────────── a fault, from any mode; the bridge is off
/// ```
///
/// `Disarm` is heard in every mode with the bridge on. Nothing moves without `Arm`, and the reference
/// that `Holding` starts from is where the link stands at that moment.
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
    /// A fault is latched; bridge off.
    Fault,
}

impl Mode {
    /// Whether the bridge's outputs are driven.
    pub const fn drives(self) -> bool {
        matches!(self, Self::Holding | Self::Running | Self::Stopping)
    }

    /// What a table calls it.
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
