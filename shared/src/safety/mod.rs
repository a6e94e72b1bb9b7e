//! Faults, limits, the mode of the rig, and what is kept of the moment a fault came.
//!
//! Two types for two things: a [`Fault`] is latched and switches the bridge off; a [`Limit`] acts while it
//! must and the rig goes on.

mod fault;
mod limit;
mod mode;
pub mod monitor;
mod snapshot;
pub mod voltage;

pub use fault::{Fault, FaultLatch, FaultRecord};
pub use limit::{Limit, LimitSet, Limits};
pub use mode::Mode;
pub use snapshot::{Snapshot, SnapshotSample};
