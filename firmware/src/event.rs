//! Events of a control tick, small enough for a queue; other code converts them to bytes.

use rig_shared::safety::{FaultRecord, SnapshotSample};
use rig_shared::wire::message::{
    Acknowledge, Crash, Estimate, Health, ResetCause, SettingsOrigin, StateSample, StopSwitchState,
};

/// One event to report to the host.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // the estimate is 70 bytes; a queue of events is small all the same
pub enum Event {
    /// A request has been answered.
    Answer(Acknowledge, FollowUp),
    /// A telemetry window is complete. `missed_windows` windows before it found the queue full.
    Sample {
        /// The window's mean.
        sample: StateSample,
        /// Windows lost before it.
        missed_windows: u32,
    },
    /// The on-line estimate.
    Estimate(Estimate),
    /// A fault has latched.
    Fault(FaultRecord),
    /// One control tick of the fault snapshot.
    Snapshot(RecordedTick),
    /// One control tick of the triggered capture.
    Capture(RecordedTick),
    /// Measurements of the board; what it found at its start is added outside the tick.
    Health(BoardMeasurement),
}

/// Measurements of the board since its last health report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardMeasurement {
    /// As [`Health::tick`].
    pub tick: u64,
    /// As [`Health::boost`].
    pub boost: bool,
    /// As [`Health::tick_cycles_max`].
    pub tick_cycles_max: u32,
    /// As [`Health::tick_cycles_mean`].
    pub tick_cycles_mean: u32,
    /// As [`Health::stack_free`].
    pub stack_free: u32,
    /// As [`Health::bad_requests`].
    pub bad_requests: u32,
    /// As [`Health::line_errors`].
    pub line_errors: u32,
    /// As [`Health::dropped`].
    pub dropped: u32,
    /// As [`Health::stop_switch`].
    pub stop_switch: StopSwitchState,
}

/// What the board found at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardStart {
    /// As [`Health::reset`].
    pub reset: ResetCause,
    /// As [`Health::settings`].
    pub settings: SettingsOrigin,
    /// As [`Health::clock_hz`].
    pub clock_hz: u32,
    /// As [`Health::crystal`].
    pub crystal: bool,
    /// As [`Health::crash`].
    pub crash: Option<Crash>,
}

impl BoardStart {
    /// Returns the health report with these measurements.
    pub fn health(&self, measured: &BoardMeasurement) -> Health {
        Health {
            tick: measured.tick,
            reset: self.reset,
            settings: self.settings,
            clock_hz: self.clock_hz,
            crystal: self.crystal,
            boost: measured.boost,
            tick_cycles_max: measured.tick_cycles_max,
            tick_cycles_mean: measured.tick_cycles_mean,
            stack_free: measured.stack_free,
            bad_requests: measured.bad_requests,
            line_errors: measured.line_errors,
            dropped: measured.dropped,
            stop_switch: measured.stop_switch,
            crash: self.crash,
        }
    }
}

/// Consequence of an accepted request for the session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FollowUp {
    /// Nothing.
    None,
    /// The greeting is due.
    Greeting,
    /// A stream begins with the window that begins at this tick.
    StreamStart(u64),
    /// The stream ends.
    StreamEnd,
    /// A snapshot follows, of this fault if there is one.
    Snapshot(Option<FaultRecord>),
}

/// One recorded control tick with its index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedTick {
    /// Index, 0 the oldest.
    pub index: u16,
    /// Number of ticks kept; 0 if there are none: `sample` is then not valid.
    pub total: u16,
    /// The tick.
    pub sample: SnapshotSample,
}
