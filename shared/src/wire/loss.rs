//! The host's end of the telemetry: finds exactly which samples are missing.

use core::fmt;

use super::message::{BATCH, Batch, StreamEnd};

/// Number of batches behind the newest for which duplicate and late are distinguished.
const REMEMBERED: u32 = u64::BITS;

/// Consecutive windows without samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Control tick at which the first missing window began.
    pub first_tick: u64,
    /// Missing windows (samples).
    pub missing: u64,
}

/// Reason why a batch was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BatchRefusal {
    /// The batch was received before.
    Duplicate,
    /// A later batch was received before it. Its samples were already counted as missing, and stay so.
    Late,
    /// Empty, or its number and tick contradict those before.
    Inconsistent,
}

/// The rig's totals contradict what was received: the end belongs to another stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EndMismatch {
    /// Windows of the stream according to the rig.
    pub announced: u64,
    /// Windows up to the last sample received.
    pub seen: u64,
}

impl fmt::Display for EndMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "The rig ended a stream of {} samples, but {} had come or were missing already: the end belongs to another stream.",
            self.announced, self.seen
        )
    }
}

impl core::error::Error for EndMismatch {}

/// Counts of a stream so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LossCounts {
    /// Batches taken.
    pub batches: u64,
    /// Samples taken.
    pub received: u64,
    /// Samples known to be missing.
    pub missing: u64,
    /// Batches refused as [`BatchRefusal::Duplicate`].
    pub duplicates: u64,
    /// Batches refused as [`BatchRefusal::Late`].
    pub late: u64,
    /// Batches refused as [`BatchRefusal::Inconsistent`].
    pub inconsistent: u64,
}

/// Reassembles a stream and finds its gaps: at the start by the first batch's number, in between by number and tick, at
/// the end by the rig's totals.
#[derive(Clone, Debug)]
pub struct Reassembly {
    decimation: u64,
    /// Tick at which window 0 began, if known.
    origin: Option<u64>,
    /// Number of the next batch in order, without wrapping.
    next_sequence: u64,
    /// Index of the next window in order.
    next_window: u64,
    /// Bit i is set if batch `next_sequence − 1 − i` was taken.
    taken: u64,
    counts: LossCounts,
}

impl Reassembly {
    /// Returns the state before a stream with windows of `decimation` control ticks (0 counts as 1).
    pub fn new(decimation: u16) -> Self {
        Self {
            decimation: u64::from(decimation.max(1)),
            origin: None,
            next_sequence: 0,
            next_window: 0,
            taken: 0,
            counts: LossCounts::default(),
        }
    }

    /// Returns the counts of the stream so far.
    pub fn counts(&self) -> LossCounts {
        self.counts
    }

    /// Returns the control tick at which window 0 began; `None` before the first batch.
    pub fn origin(&self) -> Option<u64> {
        self.origin
    }

    /// Takes the next batch; returns the gap before it, if any. The batch's samples then follow the gap.
    ///
    /// # Errors
    /// [`BatchRefusal`] if the batch must not be used; it is counted and changes nothing else.
    pub fn accept(&mut self, batch: &Batch) -> Result<Option<Gap>, BatchRefusal> {
        // The number wraps at 32 bits: the nearest value to the expected one is taken.
        let ahead = batch.sequence.wrapping_sub(self.next_sequence as u32);
        if (ahead as i32) < 0 {
            return Err(self.refuse_old(ahead.wrapping_neg()));
        }
        let placed = self.place(batch, u64::from(ahead));
        let Some((origin, first_window)) = placed else {
            self.counts.inconsistent += 1;
            return Err(BatchRefusal::Inconsistent);
        };
        let missing = first_window - self.next_window;
        let gap = (missing > 0).then_some(Gap {
            first_tick: origin + self.next_window * self.decimation,
            missing,
        });
        self.origin = Some(origin);
        self.next_window = first_window + batch.samples.len() as u64;
        self.next_sequence += u64::from(ahead) + 1;
        self.taken = self.taken.checked_shl(ahead.saturating_add(1)).unwrap_or(0) | 1;
        self.counts.batches += 1;
        self.counts.received += batch.samples.len() as u64;
        self.counts.missing += missing;
        Ok(gap)
    }

    /// Returns the tick of window 0 and the batch's first window; `None` if they contradict the batches before.
    fn place(&self, batch: &Batch, ahead: u64) -> Option<(u64, u64)> {
        let first_window = (self.next_sequence + ahead).checked_mul(BATCH as u64)?;
        let ticks = first_window.checked_mul(self.decimation)?;
        let origin = batch.first_tick.checked_sub(ticks)?;
        // The end of the batch must fit into a tick too.
        batch
            .first_tick
            .checked_add(self.decimation * BATCH as u64)?;
        let agrees = self.origin.is_none_or(|known| known == origin);
        (agrees && !batch.samples.is_empty() && first_window >= self.next_window)
            .then_some((origin, first_window))
    }

    fn refuse_old(&mut self, behind: u32) -> BatchRefusal {
        let taken =
            behind <= REMEMBERED && (self.taken >> (behind - 1).min(REMEMBERED - 1)) & 1 == 1;
        if taken {
            self.counts.duplicates += 1;
            BatchRefusal::Duplicate
        } else {
            self.counts.late += 1;
            BatchRefusal::Late
        }
    }

    /// Closes the stream with the rig's totals; returns the gap at its end, if any. Afterwards `received + missing` is
    /// the number of samples in the stream.
    ///
    /// # Errors
    /// [`EndMismatch`] if the totals cannot belong to this stream; nothing has changed then.
    pub fn finish(&mut self, end: &StreamEnd) -> Result<Option<Gap>, EndMismatch> {
        let announced = end.samples.saturating_add(end.dropped);
        let mismatch = EndMismatch {
            announced,
            seen: self.next_window,
        };
        if self.origin.is_some_and(|origin| origin != end.first_tick) {
            return Err(mismatch);
        }
        let missing = announced.checked_sub(self.next_window).ok_or(mismatch)?;
        if end.samples < self.counts.received
            || u64::from(end.batches) < self.counts.batches & u64::from(u32::MAX)
        {
            return Err(mismatch);
        }
        let gap = (missing > 0).then_some(Gap {
            first_tick: end
                .first_tick
                .saturating_add(self.next_window.saturating_mul(self.decimation)),
            missing,
        });
        self.origin = Some(end.first_tick);
        self.next_window = announced;
        self.counts.missing += missing;
        Ok(gap)
    }
}

#[cfg(test)]
#[path = "loss_test.rs"]
mod test;
