//! Ring of the last control ticks before the first fault.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// One control tick in the snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct SnapshotSample {
    /// Control tick.
    pub tick: u64,
    /// Unwrapped encoder counts.
    pub position: i64,
    /// Motor current, A.
    pub current: f32,
    /// Duty cycle, −1 to 1.
    pub duty: f32,
    /// Supply voltage, V.
    pub supply: f32,
    /// Reference position, rad.
    pub reference: f32,
}

/// A ring of the last `N` ticks that stops a few ticks after the first fault.
#[derive(Clone, Debug)]
pub struct Snapshot<const N: usize> {
    ring: [SnapshotSample; N],
    next: usize,
    filled: usize,
    /// Ticks still to be stored after a fault; `None` before a fault.
    remaining: Option<usize>,
}

impl<const N: usize> Default for Snapshot<N> {
    fn default() -> Self {
        Self {
            ring: [SnapshotSample::default(); N],
            next: 0,
            filled: 0,
            remaining: None,
        }
    }
}

impl<const N: usize> Snapshot<N> {
    /// Ticks stored after the fault: an eighth of the ring shows the fault reaction.
    pub const AFTER: usize = N / 8;

    /// Stores a tick, unless the snapshot is frozen.
    pub fn push(&mut self, sample: SnapshotSample) {
        match &mut self.remaining {
            Some(0) => return,
            Some(remaining) => *remaining -= 1,
            None => {}
        }
        if let Some(slot) = self.ring.get_mut(self.next) {
            *slot = sample;
        }
        self.next = if self.next + 1 < N { self.next + 1 } else { 0 };
        self.filled = (self.filled + 1).min(N);
    }

    /// Freezes the snapshot after [`Self::AFTER`] more ticks. Further calls change nothing.
    pub fn freeze(&mut self) {
        self.remaining.get_or_insert(Self::AFTER);
    }

    /// Returns true if no more ticks are stored.
    pub fn is_frozen(&self) -> bool {
        self.remaining == Some(0)
    }

    /// Empties and restarts the ring. Its time is independent of the ring's length, because a control tick calls it.
    pub fn release(&mut self) {
        self.next = 0;
        self.filled = 0;
        self.remaining = None;
    }

    /// Returns the number of stored ticks.
    pub fn len(&self) -> usize {
        self.filled
    }

    /// Returns true if no tick is stored yet.
    pub fn is_empty(&self) -> bool {
        self.filled == 0
    }

    /// Returns the `index`-th stored tick, 0 the oldest.
    pub fn get(&self, index: usize) -> Option<&SnapshotSample> {
        if index >= self.filled {
            return None;
        }
        // While the ring is not yet full, `next` equals `filled` and the oldest is at 0.
        let oldest = if self.filled < N { 0 } else { self.next };
        let position = oldest + index;
        self.ring
            .get(if position < N { position } else { position - N })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn at(tick: u64) -> SnapshotSample {
        SnapshotSample {
            tick,
            ..Default::default()
        }
    }

    #[test]
    fn keeps_what_came_before_the_fault_and_a_little_after() {
        let mut snapshot = Snapshot::<16>::default();
        for tick in 0..100 {
            snapshot.push(at(tick));
        }
        snapshot.freeze();
        for tick in 100..200 {
            snapshot.push(at(tick));
            snapshot.freeze();
        }
        assert!(snapshot.is_frozen());
        let ticks: std::vec::Vec<u64> = (0..snapshot.len())
            .map(|k| snapshot.get(k).unwrap().tick)
            .collect();
        assert_eq!(ticks, (86..102).collect::<std::vec::Vec<_>>());
        assert!(snapshot.get(16).is_none());
    }

    #[test]
    fn a_released_ring_is_as_a_new_one() {
        let mut snapshot = Snapshot::<16>::default();
        for tick in 0..30 {
            snapshot.push(at(tick));
            snapshot.freeze();
        }
        snapshot.release();
        assert!(snapshot.is_empty() && !snapshot.is_frozen());
        assert!(snapshot.get(0).is_none());
        snapshot.push(at(50));
        assert_eq!((snapshot.len(), snapshot.get(0).unwrap().tick), (1, 50));
    }

    #[test]
    fn a_young_ring_starts_at_its_first_tick() {
        let mut snapshot = Snapshot::<16>::default();
        assert!(snapshot.is_empty());
        for tick in 5..9 {
            snapshot.push(at(tick));
        }
        assert_eq!(snapshot.get(0).unwrap().tick, 5);
        assert_eq!(snapshot.get(3).unwrap().tick, 8);
        assert!(snapshot.get(4).is_none());
    }
}
