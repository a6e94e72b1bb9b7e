//! What a control tick has to say, small enough to pass on in a queue; bytes are made of it elsewhere.

use rig_shared::safety::{FaultRecord, SnapshotSample};
use rig_shared::wire::message::{Acknowledge, Estimate, Health, StateSample};

/// One thing to be told to the host.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // the estimate is 70 bytes; a queue of notes is small all the same
pub enum Note {
    /// A request has been answered.
    Answer(Acknowledge, Topic),
    /// A telemetry window is complete. `missed` windows before it found the queue full.
    Sample {
        /// The window's mean.
        sample: StateSample,
        /// Windows lost before it.
        missed: u32,
    },
    /// The on-line estimate.
    Estimate(Estimate),
    /// A fault has latched.
    Fault(FaultRecord),
    /// One control tick of the fault snapshot.
    Snapshot(Kept),
    /// One control tick of the triggered capture.
    Capture(Kept),
    /// How the board is.
    Health(Health),
}

/// What an accepted request means for the conversation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Topic {
    /// Nothing.
    None,
    /// The greeting is due.
    Greeting,
    /// A stream begins with the window that begins at this tick.
    StreamStart(u64),
    /// The stream ends.
    StreamEnd,
    /// A snapshot is about to come, of this fault if there is one.
    Snapshot(Option<FaultRecord>),
}

/// One kept control tick, with its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// Index, 0 the oldest.
    pub index: u16,
    /// Ticks kept in all; 0 where there is nothing, and then `sample` means nothing.
    pub total: u16,
    /// The tick.
    pub sample: SnapshotSample,
}
