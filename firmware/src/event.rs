//! Events of a control tick, small enough for a queue; other code converts them to bytes.

use rig_shared::safety::{FaultRecord, SnapshotSample};
use rig_shared::wire::message::{Acknowledge, Estimate, Health, StateSample};

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
    /// State of the board.
    Health(Health),
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
