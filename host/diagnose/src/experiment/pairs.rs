//! Pairs of rivals.

use rig_shared::effects::Kind;

use crate::experiment::lookup::confused;

/// Indices of two rivals.
pub(crate) type Pair = [usize; 2];

/// Returns all pairs.
pub(crate) fn pairs(count: usize) -> impl Iterator<Item = Pair> {
    (0..count).flat_map(|b| (0..b).map(move |a| [a, b]))
}

/// Returns true if the registry has both as the same function of torque and motion.
pub(crate) fn exact(pair: [Kind; 2]) -> bool {
    confused(pair).is_some_and(|c| c.exact)
}

/// Returns true if an effect is a constant torque while the joint moves.
pub(crate) fn constant(kind: Kind) -> bool {
    kind == Kind::TorqueOffset || exact([kind, Kind::TorqueOffset])
}
