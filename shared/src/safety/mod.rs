//! Faults, limits, the mode of the rig, and the snapshot at a fault.
//!
//! A [`Fault`] is latched, ends every motion and lets the rig brake or coast ([`Reaction`]). A [`Limit`] acts as long as
//! needed, and the rig goes on.

mod fault;
mod limit;
mod mode;
pub mod monitor;
mod snapshot;
pub mod voltage;

pub use fault::{Fault, FaultLatch, FaultRecord, Reaction};
pub use limit::{Limit, LimitSet, Limits};
pub use mode::Mode;
pub use snapshot::{Snapshot, SnapshotSample};
