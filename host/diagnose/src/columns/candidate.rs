//! An effect on a joint: the name of a library entry.

use rig_shared::effects::{Channel, Kind, SHAPES};

/// An effect on a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Candidate {
    /// Kind of the effect.
    pub(crate) kind: Kind,
    /// Its joint, from 0.
    pub(crate) joint: usize,
    /// The other joint of a coupling.
    pub(crate) other: Option<usize>,
    /// Bits of a wave's order. None for other effects, and for a wave whose order is not yet known.
    pub(crate) order: Option<u64>,
}

impl Candidate {
    /// Creates a candidate without an order.
    pub(crate) const fn on(kind: Kind, joint: usize) -> Self {
        Self {
            kind,
            joint,
            other: None,
            order: None,
        }
    }

    /// Returns the candidate with another joint.
    pub(crate) fn naming(self, other: Option<usize>) -> Self {
        Self { other, ..self }
    }

    /// Returns the candidate with these shapes. Waves of different orders are different effects, and they add up.
    pub(crate) fn shaped(self, shapes: &[f64; SHAPES]) -> Self {
        let wave = repeats_by_order(self.kind);
        Self {
            order: wave.then(|| shapes[0].to_bits()),
            ..self
        }
    }

    /// Returns the library entry: one for the waves of all orders.
    pub(crate) fn sort(self) -> Self {
        Self {
            order: None,
            ..self
        }
    }

    /// Returns true if both are orders of one wave. A joint may have both.
    pub(crate) fn is_another_order(&self, other: &Self) -> bool {
        self.sort() == other.sort() && self.order != other.order
    }
}

/// Returns true if a kind is a torque that is periodic in an angle. A joint may have several orders of it.
pub(crate) fn repeats_by_order(kind: Kind) -> bool {
    kind.periodic().is_some() && kind.about().channel == Channel::Torque
}
