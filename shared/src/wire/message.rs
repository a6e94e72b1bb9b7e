//! What the rig and the host say to each other.
//!
//! Requests go to the rig, each with a number that the acknowledgement repeats; reports come from it.
//! Floating-point values are SI and joint-side unless their name says otherwise. A change to any type
//! here changes [`schema`](super::schema()), and both ends then refuse each other by name.

use heapless::{String, Vec};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::compensation::EFFECTS;
use crate::control::{ControlKind, Gains};
use crate::effects::{Effect, Kind};
use crate::estimation::EstimatorSettings;
use crate::friction::Friction;
use crate::link::LinkParameters;
use crate::precompensation::PrecompensationSettings;
use crate::safety::{FaultRecord, LimitSet, Limits, Mode, SnapshotSample};
use crate::trajectory::Trajectory;

/// Samples in one telemetry batch.
pub const BATCH: usize = 8;
/// Parameters of the one-link model: see [`crate::link::PARAMETER_NAMES`].
pub const PARAMETERS: usize = crate::link::PARAMETER_COUNT;
/// Samples of the fault snapshot carried by one report.
pub const SNAPSHOT_PART: usize = 8;

/// Host to rig: a numbered wish.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Request {
    /// Repeated by the acknowledgement; the host counts up.
    pub id: u16,
    /// What is wished.
    pub body: RequestBody,
}

/// What the host can ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to box it on, and a message is stored for one command only"
)]
pub enum RequestBody {
    /// Ask for the [`Greeting`]; first in every version, so that it is always understood.
    Hello,
    /// Nothing but a sign of life; without one the rig stops after its host time-out.
    KeepAlive,
    /// Allow motion: the bridge is switched on and holds position.
    Arm,
    /// Bridge off, at once.
    Disarm,
    /// Run the loaded trajectory from where the link stands.
    Start,
    /// Come to rest under control, then hold.
    Stop,
    /// Forget a latched fault; refused while its cause still acts.
    ClearFault,
    /// Replace the trajectory; refused while one runs and where it would leave the limits.
    SetTrajectory(Trajectory<f32>),
    /// Replace the feedback gains.
    SetGains(Gains<f32>),
    /// Replace the control law.
    SetControl(ControlKind),
    /// Replace the model used for feed-forward.
    SetModel(LinkParameters<f32>),
    /// Replace the friction law used for precompensation.
    SetFriction(Friction<f32>),
    /// Replace how the friction law is used near zero speed, or switch it off.
    SetPrecompensation(PrecompensationSettings<f32>),
    /// Replace the limits.
    SetLimits(Limits<f32>),
    /// Replace the on-line estimator's settings and start it anew.
    SetEstimator(EstimatorSettings<f32>),
    /// Send telemetry until `StopStream`; a stream that runs is ended without [`StreamEnd`].
    StartStream,
    /// End the telemetry with [`StreamEnd`]. Without a stream the last one's end is sent again.
    StopStream,
    /// Send the snapshot of the first latched fault, part by part.
    GetSnapshot,
    /// Say where the link stands now, rad; only while disarmed. An incremental encoder cannot know.
    SetPosition(f32),
    /// Keep limits, gains, laws and models in the rig's own memory, for the next power on; only while disarmed.
    /// Answered when it is done.
    Store,
    /// Have the capture of single control ticks stand still so many ticks from now. One that waits to be
    /// fetched is given up.
    Capture(u16),
    /// Send the capture, part by part, once it stands still; one part without samples where none was triggered.
    GetCapture,
    /// Replace the effects that are compensated beside the friction law; none to compensate none.
    SetEffects(Vec<Effect<f32>, EFFECTS>),
}

/// Rig to host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(clippy::large_enum_variant)] // the batch is the common case; boxing needs an allocator
pub enum Report {
    /// Who speaks, in which version, at which rates; first in every version.
    Greeting(Greeting),
    /// Answer to a [`Request`].
    Acknowledge(Acknowledge),
    /// Consecutive state samples.
    Batch(Batch),
    /// The on-line estimate.
    Estimate(Estimate),
    /// A fault has latched.
    Fault(FaultRecord),
    /// Part of the snapshot that a latched fault kept.
    Snapshot(SnapshotPart),
    /// The stream has ended; what was sent in all, so that losses at its end count too.
    StreamEnd(StreamEnd),
    /// Part of the capture: single control ticks.
    Capture(SnapshotPart),
    /// How the board is, about once a second.
    Health(Health),
}

/// Who speaks, in which version, at which rates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Greeting {
    /// [`super::PROTOCOL_VERSION`] of the rig. This and `schema` come first in every version.
    pub protocol: u16,
    /// [`super::schema()`] of the rig: a fingerprint of every type in this file.
    pub schema: u64,
    /// Firmware version as text.
    pub firmware: String<24>,
    /// Control ticks per second.
    pub control_rate_hz: u32,
    /// Control ticks averaged into one telemetry sample.
    pub telemetry_decimation: u16,
    /// Control ticks per estimator update.
    pub estimator_decimation: u16,
    /// Encoder counts per motor turn.
    pub counts_per_motor_turn: u32,
    /// Motor turns per joint turn.
    pub gear_ratio: f32,
    /// Motor torque constant, N·m/A.
    pub torque_constant: f32,
}

/// Answer to a [`Request`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Acknowledge {
    /// The request's number.
    pub id: u16,
    /// `Err` says why nothing was changed.
    pub result: Result<(), Refusal>,
}

/// Why a request was refused. Nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// The mode does not allow it (start while disarmed, upload while running, …).
    WrongMode,
    /// A fault is latched.
    FaultLatched,
    /// The cause of the fault still acts.
    CauseActing,
    /// A value is not finite or outside its physical range.
    BadValue,
    /// The trajectory would leave the limits.
    OutsideLimits,
    /// No trajectory is loaded.
    NoTrajectory,
    /// The settings are being stored; ask again when that has been answered.
    Busy,
    /// This rig cannot keep settings.
    NoStorage,
    /// The memory did not take the settings; those stored before still stand.
    StorageFailed,
    /// Effects of this kind have no torque and no corrected reading that would undo them.
    NotCompensable(Kind),
}

/// Consecutive state samples, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Batch {
    /// Counts batches since `StartStream`, those that the rig had to drop too; a gap is a loss.
    pub sequence: u32,
    /// Control tick at which the first sample's averaging window began.
    pub first_tick: u64,
    /// The samples, one per telemetry period.
    pub samples: Vec<StateSample, BATCH>,
}

/// The state, averaged over one telemetry window so that nothing is aliased.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct StateSample {
    /// Unwrapped motor-encoder counts summed over the window: exact, no rounding.
    pub position_sum: i64,
    /// Estimated joint velocity, mean, rad/s.
    pub velocity: f32,
    /// Motor current, mean, A.
    pub current: f32,
    /// Motor voltage (duty × supply), mean, V.
    pub voltage: f32,
    /// Reference position, mean, rad.
    pub reference: f32,
    /// Commanded joint torque, mean, N·m.
    pub torque_command: f32,
    /// Limits that acted during the window.
    pub limits: LimitSet,
    /// Mode at the window's end.
    pub mode: Mode,
}

/// The on-line estimate of the one-link model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Estimate {
    /// Control tick of the last update that went in.
    pub tick: u64,
    /// Values, in the order of [`crate::link::PARAMETER_NAMES`].
    pub value: [f32; PARAMETERS],
    /// Standard deviations, same order and units.
    pub std: [f32; PARAMETERS],
    /// Whether each may be trusted: excited, converged and within its band.
    pub trusted: [bool; PARAMETERS],
    /// RMS of the torque residual, N·m.
    pub residual_rms: f32,
}

/// Part of a fault snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SnapshotPart {
    /// Index of the first sample in the snapshot, 0 the oldest.
    pub first: u16,
    /// Samples in the whole snapshot.
    pub total: u16,
    /// The samples.
    pub samples: Vec<SnapshotSample, SNAPSHOT_PART>,
}

/// What a stream held in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct StreamEnd {
    /// Batches sent since `StartStream`.
    pub batches: u32,
    /// Samples sent since `StartStream`.
    pub samples: u64,
    /// Samples the rig itself had to drop because its transmit queue was full.
    pub dropped: u64,
    /// Control tick at which the stream's first window began; places a loss of the whole stream.
    pub first_tick: u64,
}

/// Where the settings came from that the rig started with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum SettingsOrigin {
    /// Nothing was ever stored: the firmware's own.
    Defaults,
    /// As stored.
    Stored,
    /// One of the two stored copies is damaged, or the newer one is of no use to this firmware: the other.
    OlderCopy,
    /// What is stored is damaged: the firmware's own.
    Damaged,
    /// What is stored is of another firmware's form, or cannot be used: the firmware's own.
    Unusable,
}

/// Why the chip last started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetCause {
    /// Power on, or the supply of the chip broke down.
    Power,
    /// The reset button or the debugger.
    Pin,
    /// The firmware itself, after a panic or a processor fault.
    Software,
    /// The independent watchdog: a part of the firmware no longer reported.
    Watchdog,
    /// Another one.
    Other,
}

/// How the board is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Health {
    /// Control tick of this report.
    pub tick: u64,
    /// Why the chip last started.
    pub reset: ResetCause,
    /// Where the settings came from.
    pub settings: SettingsOrigin,
    /// Processor cycles in a second.
    pub clock_hz: u32,
    /// A crystal sets the pace (some 50 ppm); else the chip's own oscillator (1 %), and every time is so wrong.
    pub crystal: bool,
    /// Processor cycles that the longest control tick took since the last report, interrupt entry excluded.
    pub tick_cycles_max: u32,
    /// Processor cycles that a control tick took on average since the last report.
    pub tick_cycles_mean: u32,
    /// Bytes of the stack that have never been used.
    pub stack_free: u32,
    /// Requests that came damaged since power on.
    pub bad_requests: u32,
    /// Telemetry windows that found no room since power on.
    pub dropped: u32,
}
