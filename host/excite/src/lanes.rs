//! Samples computed side by side.

use rig_shared::lanes::Lanes;

/// Number of samples computed in parallel lanes.
pub(super) const LANES: usize = 4;
/// One value of each of these samples.
pub(super) type L = Lanes<LANES>;
