//! The state of the rig as the page shows it: always sent whole, so that a lost message is healed by the next.

use rig_link::{COLUMNS, UNITS, describe_learning};
use rig_shared::estimation::Learning;
use rig_shared::link::PARAMETER_NAMES;
use rig_shared::safety::{Limit, Mode};
use serde::Serialize;

/// Units of the on-line parameters, ASCII, in the order of [`PARAMETER_NAMES`].
pub(crate) const PARAMETER_UNITS: [&str; PARAMETER_NAMES.len()] =
    ["kg*m^2", "N*m", "N*m", "N*m*s/rad", "N*m", "N*m"];

/// What does not change while the rig is watched.
#[derive(Debug, Serialize)]
pub(crate) struct Hello {
    pub op: &'static str,
    /// Where the samples come from.
    pub source: String,
    pub firmware: String,
    /// Samples per second.
    pub sample_rate: f64,
    /// Joint torque per motor current, N·m/A, from the rig's greeting.
    pub torque_per_ampere: f64,
    pub columns: [&'static str; COLUMNS.len()],
    pub units: [&'static str; COLUMNS.len()],
    pub modes: [&'static str; 6],
    /// Bit and name of every limit.
    pub limits: Vec<(u8, &'static str)>,
    pub parameters: [&'static str; PARAMETER_NAMES.len()],
    pub parameter_units: [&'static str; PARAMETER_NAMES.len()],
    /// Why the estimator learns nothing, by the number of [`Learning`].
    pub learning: [&'static str; Learning::ALL.len()],
    /// The parameters of the description that was sent to the rig.
    pub described: Option<[f32; PARAMETER_NAMES.len()]>,
}

impl Hello {
    /// Returns the names that do not depend on the rig.
    pub(crate) fn new(source: String) -> Self {
        Self {
            op: "hello",
            source,
            firmware: String::new(),
            sample_rate: 0.0,
            torque_per_ampere: 0.0,
            columns: COLUMNS,
            units: UNITS,
            modes: [
                Mode::Calibrating,
                Mode::Disarmed,
                Mode::Holding,
                Mode::Running,
                Mode::Stopping,
                Mode::Fault,
            ]
            .map(Mode::name),
            limits: (Limit::ALL.map(|limit| (limit as u8, limit.name()))).to_vec(),
            parameters: PARAMETER_NAMES,
            parameter_units: PARAMETER_UNITS,
            learning: Learning::ALL.map(describe_learning),
            described: None,
        }
    }
}

/// The loaded motion.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct MotionStatus {
    pub file: String,
    pub joint: String,
    /// rad
    pub start: f64,
    /// s
    pub duration: f64,
}

/// A running recording.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RecordingStatus {
    pub file: String,
    pub samples: u64,
    pub missing: u64,
}

/// How far the last stop has got.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum StopPhase {
    /// Stop was never asked for.
    #[default]
    None,
    /// Sent, not yet confirmed.
    Sent,
    /// The board has confirmed the stop and brings the link to rest.
    Confirmed,
    /// The board has confirmed that the bridge is off.
    Off,
    /// The board has not answered.
    Failed,
}

/// The last stop.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct StopStatus {
    /// Number of stops so far.
    pub count: u64,
    pub phase: StopPhase,
    /// Time from the request to the board's first answer, ms.
    pub answer_ms: Option<f64>,
    /// Time from the request to the bridge off, ms.
    pub off_ms: Option<f64>,
}

/// What changes while the rig is watched.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Status {
    pub op: &'static str,
    pub mode: &'static str,
    pub limits: u8,
    /// The latched fault as sentences.
    pub fault: Option<String>,
    pub motion: Option<MotionStatus>,
    pub recording: Option<RecordingStatus>,
    /// Samples received since the start.
    pub received: u64,
    /// Samples that the line or the rig lost since the start.
    pub missing: u64,
    pub gaps: u64,
    pub bad_frames: u64,
    /// Seconds of the rig per second of this computer over the last seconds.
    pub speed: Option<f64>,
    pub stop: StopStatus,
    /// What the user should know, such as settings that were not sent.
    pub notice: Option<String>,
    /// Why the line has ended.
    pub ended: Option<String>,
}

impl Status {
    pub(crate) fn new() -> Self {
        Self {
            op: "status",
            mode: Mode::Calibrating.name(),
            limits: 0,
            fault: None,
            motion: None,
            recording: None,
            received: 0,
            missing: 0,
            gaps: 0,
            bad_frames: 0,
            speed: None,
            stop: StopStatus::default(),
            notice: None,
            ended: None,
        }
    }
}
