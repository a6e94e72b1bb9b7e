//! Messages between rig and host.
//!
//! Requests go to the rig, each with a number that the acknowledgement repeats. Reports come from the rig.
//! Floating-point values are SI and joint-side unless their name says otherwise. A change to any type here changes
//! [`schema`](super::schema()); both ends then refuse each other by name.

use heapless::{String, Vec};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::compensation::EFFECTS;
use crate::control::{ControlKind, Gains};
use crate::effects::{Effect, Kind};
use crate::estimation::{EstimatorSettings, Learning, RowCounts};
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

/// Host to rig: a numbered request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Request {
    /// Number, repeated by the acknowledgement; the host counts up.
    pub id: u16,
    /// The request.
    pub body: RequestBody,
}

/// Requests of the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is no heap to box it on, and a message is stored for one command only"
)]
pub enum RequestBody {
    /// Ask for the [`Greeting`]; variant 0 in every version, so that it is always understood.
    Hello,
    /// Sign of life only; without one the rig stops after its host time-out.
    KeepAlive,
    /// Allow motion: switches the bridge on and holds position.
    Arm,
    /// Switch the bridge off at once.
    Disarm,
    /// Run the loaded trajectory from the link's position.
    Start,
    /// Come to rest under control, then hold.
    Stop,
    /// Clear a latched fault; refused while its cause still acts.
    ClearFault,
    /// Replace the trajectory; refused while one runs, and if it would leave the limits.
    SetTrajectory(Trajectory<f32>),
    /// Replace the feedback gains.
    SetGains(Gains<f32>),
    /// Replace the control law.
    SetControl(ControlKind),
    /// Replace the model used for feed-forward.
    SetModel(LinkParameters<f32>),
    /// Replace the friction law used for precompensation.
    SetFriction(Friction<f32>),
    /// Replace the settings of the friction precompensation, or switch it off.
    SetPrecompensation(PrecompensationSettings<f32>),
    /// Replace the limits.
    SetLimits(Limits<f32>),
    /// Replace the on-line estimator's settings and restart it.
    SetEstimator(EstimatorSettings<f32>),
    /// Send telemetry until `StopStream`; a running stream ends without [`StreamEnd`].
    StartStream,
    /// End the telemetry with [`StreamEnd`]. Without a stream the last [`StreamEnd`] is sent again.
    StopStream,
    /// Send the snapshot of the first latched fault, part by part.
    GetSnapshot,
    /// Set the link's present position, rad; only while disarmed. An incremental encoder does not know it.
    SetPosition(f32),
    /// Store limits, gains, laws and models in the rig's memory for the next power on; only while disarmed.
    /// Acknowledged when done.
    Store,
    /// Stop the capture of single control ticks after this number of ticks. A capture that was not fetched is
    /// discarded.
    Capture(u16),
    /// Send the capture, part by part, once it has stopped; one part without samples if none was triggered.
    GetCapture,
    /// Replace the effects that are compensated in addition to the friction law; an empty list switches them off.
    SetEffects(Vec<Effect<f32>, EFFECTS>),
}

/// Rig to host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[allow(clippy::large_enum_variant)] // the batch is the common case; boxing needs an allocator
pub enum Report {
    /// Identity, version and rates of the rig; variant 0 in every version.
    Greeting(Greeting),
    /// Answer to a [`Request`].
    Acknowledge(Acknowledge),
    /// Consecutive state samples.
    Batch(Batch),
    /// The on-line estimate.
    Estimate(Estimate),
    /// A fault has latched.
    Fault(FaultRecord),
    /// Part of the snapshot of a latched fault.
    Snapshot(SnapshotPart),
    /// The stream has ended; holds its totals, so that losses at its end count too.
    StreamEnd(StreamEnd),
    /// Part of the capture: single control ticks.
    Capture(SnapshotPart),
    /// State of the board, about once a second.
    Health(Health),
}

/// Identity, version and rates of the rig.
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
    /// `Err` gives the reason why nothing was changed.
    pub result: Result<(), Refusal>,
}

/// A quantity with a bound that a request has exceeded, with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Bounded {
    /// Position of the link when armed, rad; bound: the end of the position range.
    ArmPosition,
    /// Speed of the link when armed, rad/s.
    ArmVelocity,
    /// Natural frequency √(kp/J) of the position loop, rad/s; bound: a share of the current loop's bandwidth.
    PositionLoop,
    /// Bandwidth kd/J of the velocity loop, rad/s; bound: likewise.
    VelocityLoop,
    /// Inertia of the model, kg·m².
    Inertia,
    /// Gravity torque of the model, N·m; bound: the torque rating.
    Gravity,
    /// Friction torque at rest, N·m; bound: the torque rating.
    DryFriction,
    /// Viscous friction, N·m·s/rad.
    ViscousFriction,
    /// Constant torque of the model, N·m; bound: the torque rating.
    Offset,
    /// Limit of the speed, rad/s; bound: the rating, or 0.
    SpeedLimit,
    /// Limit of the acceleration, rad/s²; bound: the rating, or 0.
    AccelerationLimit,
    /// Limit of the torque, N·m; bound: the rating, or 0.
    TorqueLimit,
    /// Continuous current, A; bound: the rating, or 0.
    ContinuousCurrent,
    /// Peak current, A; bound: the rating, 0, or the continuous current.
    PeakCurrent,
    /// End of the position range, rad; bound: the range of exact positions.
    PositionLimit,
    /// Width of the position range, rad; bound: 0.
    PositionRange,
    /// Speed of a motion, rad/s; bound: the limit.
    MotionSpeed,
    /// Acceleration of a motion, rad/s²; bound: the limit.
    MotionAcceleration,
    /// Position that a motion reaches, rad; bound: the end of the position range.
    MotionPosition,
    /// Position for the present counts, rad, without its sign.
    Home,
    /// Proportional gain, N·m/rad; bound: 0.
    ProportionalGain,
    /// Derivative gain, N·m·s/rad; bound: 0.
    DerivativeGain,
    /// Adaptation gain, 1/s; bound: 0.
    AdaptationGain,
    /// Bandwidth of the current loop, Hz; bounds: shares of the control rate.
    CurrentLoop,
    /// Load-dependent friction per torque; bound: 0.
    LoadFriction,
    /// Difference of the Coulomb friction between the directions, N·m, without its sign; bound: the Coulomb friction.
    DryAsymmetry,
    /// Difference of the viscous friction between the directions, N·m·s/rad, likewise.
    ViscousAsymmetry,
    /// Stribeck velocity, rad/s; bound: 0.
    StribeckVelocity,
    /// Share of the friction that is compensated in motion; bounds: 0 and 1.
    FrictionShare,
    /// Share of the friction that is compensated at rest; bounds: 0 and the share in motion, below 1.
    FrictionShareAtRest,
    /// Speed below which the direction of friction is smoothed, rad/s; bound: 0.
    VelocityThreshold,
    /// Memory of the on-line estimator, s; bound: 0.
    EstimatorMemory,
    /// Bandwidth of the on-line estimator's filter, Hz; bounds: 0 and a tenth of its rate.
    EstimatorBandwidth,
    /// Speed below which the on-line estimator does not learn, rad/s; bound: 0.
    SlipVelocity,
    /// Width of a parameter's band in the on-line estimator, in the parameter's unit; bound: 0.
    EstimatorBand,
    /// Correction of the current by the effects, A; bound: the largest plausible offset.
    CurrentCorrection,
    /// Voltage loss of the bridge by the effects, V; bound: a share of the lowest supply.
    VoltageCorrection,
    /// Error of the encoder by the effects, as a share of the velocity.
    EncoderCorrection,
    /// Motor current read with the bridge off, A, without its sign; bound: the largest plausible offset.
    IdleCurrent,
}

/// A part of the protection that a self-test has found wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum SelfTest {
    /// The outputs do not come on, or do not go off by command.
    Outputs,
    /// The comparator of positive over-current does not switch the outputs off.
    UpperComparator,
    /// The comparator of negative over-current does not switch the outputs off.
    LowerComparator,
}

/// Reason for a refused request. Nothing has changed then.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Refusal {
    /// The mode does not allow it (start while disarmed, upload while running, …).
    WrongMode,
    /// A fault is latched.
    FaultLatched,
    /// The cause of the fault still acts.
    CauseActing,
    /// A value is not finite, or one without a bound of its own is outside its physical range.
    BadValue,
    /// No trajectory is loaded.
    NoTrajectory,
    /// The settings are being stored; repeat the request after the answer to that.
    Busy,
    /// This rig cannot store settings.
    NoStorage,
    /// The memory did not accept the settings; the previous ones remain stored.
    StorageFailed,
    /// No torque and no corrected reading compensates effects of this kind.
    NotCompensable(Kind),
    /// A later `Disarm` or `Stop` came first.
    Overtaken,
    /// A quantity is beyond its bound.
    OutOfBounds {
        /// The quantity.
        quantity: Bounded,
        /// Its value.
        value: f32,
        /// Its bound.
        bound: f32,
    },
    /// The self-test of the protection failed at the start.
    SelfTestFailed(SelfTest),
    /// The stop switch is open, or was open a moment ago.
    StopSwitchOpen,
}

/// Consecutive state samples, oldest first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Batch {
    /// Batch number since `StartStream`, counting batches that the rig dropped too; a gap is a loss.
    pub sequence: u32,
    /// Control tick at which the first sample's averaging window began.
    pub first_tick: u64,
    /// The samples, one per telemetry period.
    pub samples: Vec<StateSample, BATCH>,
}

/// The state, averaged over one telemetry window to avoid aliasing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct StateSample {
    /// Unwrapped motor-encoder counts, summed over the window: exact, without rounding.
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
    /// Control tick of the last update.
    pub tick: u64,
    /// Values, in the order of [`crate::link::PARAMETER_NAMES`].
    pub value: [f32; PARAMETERS],
    /// Standard deviations, same order and units.
    pub std: [f32; PARAMETERS],
    /// True if the estimate may be used: excited, converged and within its band.
    pub trusted: [bool; PARAMETERS],
    /// RMS of the torque residual, N·m.
    pub residual_rms: f32,
    /// Rows since the estimator's last restart.
    pub rows: RowCounts,
    /// Whether the estimator has learnt since the last report, and otherwise why not.
    pub learning: Learning,
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

/// Totals of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct StreamEnd {
    /// Batches sent since `StartStream`.
    pub batches: u32,
    /// Samples sent since `StartStream`.
    pub samples: u64,
    /// Samples that the rig dropped because its transmit queue was full.
    pub dropped: u64,
    /// Control tick at which the stream's first window began; locates a loss of the whole stream.
    pub first_tick: u64,
}

/// Origin of the settings with which the rig started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum SettingsOrigin {
    /// Nothing was ever stored: the firmware's own settings.
    Defaults,
    /// The stored settings.
    Stored,
    /// The other of two stored copies, because one is damaged or this firmware cannot use the newer one.
    OlderCopy,
    /// The stored settings are damaged: the firmware's own settings.
    Damaged,
    /// The stored settings have another firmware's format or cannot be used: the firmware's own settings.
    Unusable,
}

/// Reason of the chip's last start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetCause {
    /// Power on, or a failure of the chip's supply.
    Power,
    /// The reset button or the debugger.
    Pin,
    /// The firmware, after a panic or a processor fault.
    Software,
    /// A watchdog: a part of the firmware stopped reporting, or the control tick hung where no interrupt could note it.
    Watchdog,
    /// Any other reason.
    Other,
}

/// Kind of a failure of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum CrashKind {
    /// The program found an error in itself.
    Panic,
    /// The processor could not carry out an instruction.
    ProcessorFault,
    /// The crystal stopped.
    ClockStopped,
    /// A word of the program's flash memory had two wrong bits.
    FlashError,
    /// An exception came that the program does not use.
    UnexpectedException,
    /// The watchdog reset the chip, because a part of the program had stopped reporting.
    Watchdog,
    /// No control tick had ended for 1.5 ms: it hung, or its trigger did not come.
    TickStopped,
}

/// Parts of the firmware that report to its watchdog, in the order of the bits of [`Crash::silent`].
pub const WATCHED_PARTS: [&str; 6] = [
    "the control tick",
    "the telemetry",
    "the receiver",
    "the storage",
    "the precheck of requests",
    "the start of the program",
];

/// Bytes of a source file's path in [`Crash::file`].
pub const FILE_BYTES: usize = 28;

/// A failure of the program, after which the chip restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Crash {
    /// What happened.
    pub kind: CrashKind,
    /// Address of the instruction; 0 if it is unknown.
    pub pc: u32,
    /// Link register: the address to which its function would have returned; 0 if it is unknown.
    pub lr: u32,
    /// The processor's fault status (CFSR).
    pub status: u32,
    /// Address of the access that failed; 0 if there was none.
    pub address: u32,
    /// Line of a panic in its source file, or number of an unexpected exception; else 0.
    pub line: u32,
    /// End of the path of a panic's source file, UTF-8, filled up with zeros.
    pub file: [u8; FILE_BYTES],
    /// Parts that had stopped reporting when the watchdog acted, one bit each ([`WATCHED_PARTS`]); 0 if the processor
    /// could not note them any more.
    pub silent: u8,
}

impl Crash {
    /// Returns the end of the path of a panic's source file; empty if it is unknown.
    pub fn file(&self) -> &str {
        let end = self.file.iter().position(|byte| *byte == 0);
        let bytes = self
            .file
            .get(..end.unwrap_or(FILE_BYTES))
            .unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }
}

/// The stop switch of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum StopSwitchState {
    /// None is fitted, as the board found at its start.
    NotFitted,
    /// Closed: the rig may move.
    Closed,
    /// Open: the rig is stopped and not armed.
    Open,
}

/// State of the board.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Health {
    /// Control tick of this report.
    pub tick: u64,
    /// Reason of the chip's last start.
    pub reset: ResetCause,
    /// Origin of the settings.
    pub settings: SettingsOrigin,
    /// Processor cycles per second.
    pub clock_hz: u32,
    /// True if a crystal sets the clock (some 50 ppm); else the chip's oscillator does (1 %, as every time then is).
    pub crystal: bool,
    /// True if the core has the voltage of this clock (on the STM32G474 PWR_CR5.R1MODE, read for this report).
    pub boost: bool,
    /// Processor cycles of the longest control tick since the last report, without interrupt entry.
    pub tick_cycles_max: u32,
    /// Mean processor cycles of a control tick since the last report.
    pub tick_cycles_mean: u32,
    /// Stack bytes that were never used.
    pub stack_free: u32,
    /// Damaged requests since power on.
    pub bad_requests: u32,
    /// Errors of the serial line from the host since power on: bytes with a framing or noise error, and losses for lack of
    /// room.
    pub line_errors: u32,
    /// Telemetry windows dropped for lack of room since power on.
    pub dropped: u32,
    /// The stop switch.
    pub stop_switch: StopSwitchState,
    /// The failure of the program before the last start; `None` if there was none, or if the power was off since.
    pub crash: Option<Crash>,
}
