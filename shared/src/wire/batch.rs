//! The rig's end of the telemetry: numbers samples in batches, so that every loss shows.

use heapless::Vec;

use super::message::{BATCH, Batch, StateSample, StreamEnd};

/// Collects samples into batches.
///
/// Window k of a stream begins at control tick `first_tick + k·decimation` and belongs to batch ⌊k/[`BATCH`]⌋. So
/// position in the stream, tick and sequence number determine each other. A batch that the rig drops leaves a gap in
/// the numbers, like a batch that the line loses. A batch is sent whole or not at all; only the last of a stream may be
/// short.
#[derive(Clone, Debug, Default)]
pub struct Batcher {
    first_tick: u64,
    decimation: u16,
    /// Windows since the start, with or without a sample.
    windows: u64,
    /// Samples of the present batch: all of its windows so far, unless `spoilt`.
    samples: Vec<StateSample, BATCH>,
    spoilt: bool,
    batches_sent: u32,
    samples_sent: u64,
    running: bool,
}

impl Batcher {
    /// Returns a batcher without a stream.
    pub fn new() -> Self {
        Self::default()
    }

    /// Starts a stream with its first window at control tick `first_tick`, and `decimation` ticks per window.
    pub fn start(&mut self, first_tick: u64, decimation: u16) {
        *self = Self {
            first_tick,
            decimation,
            running: true,
            ..Self::default()
        };
    }

    /// Returns true if a stream runs.
    pub fn is_running(&self) -> bool {
        self.running
    }

    /// Adds the next window's sample; returns a batch when one is full. Does nothing without a stream.
    ///
    /// The batch counts as sent: call [`Batcher::refused`] if the transmit queue has no room.
    pub fn push(&mut self, sample: StateSample) -> Option<Batch> {
        if !self.running {
            return None;
        }
        if self.samples.push(sample).is_err() {
            self.spoilt = true;
        }
        self.advance()
    }

    /// Marks the next window as without sample. Its batch is not sent; the windows count as dropped.
    pub fn skip(&mut self) {
        if self.running {
            self.spoilt = true;
            let _spoilt_batches_are_never_sent = self.advance();
        }
    }

    /// Corrects the totals for a batch that the transmit queue refused: its samples count as dropped.
    pub fn refused(&mut self, batch: &Batch) {
        self.batches_sent = self.batches_sent.wrapping_sub(1);
        self.samples_sent = self.samples_sent.saturating_sub(batch.samples.len() as u64);
    }

    /// Ends the stream; returns its last, short batch if there is one.
    pub fn close(&mut self) -> Option<Batch> {
        self.running = false;
        self.take()
    }

    /// Returns the totals so far; after [`Batcher::close`] those of the whole stream. May be called repeatedly until
    /// the next start, so that a lost answer can be repeated.
    pub fn end(&self) -> StreamEnd {
        StreamEnd {
            batches: self.batches_sent,
            samples: self.samples_sent,
            dropped: self.windows.saturating_sub(self.samples_sent),
            first_tick: self.first_tick,
        }
    }

    fn advance(&mut self) -> Option<Batch> {
        self.windows = self.windows.wrapping_add(1);
        if self.windows.is_multiple_of(BATCH as u64) {
            self.take()
        } else {
            None
        }
    }

    fn take(&mut self) -> Option<Batch> {
        let samples = core::mem::take(&mut self.samples);
        let spoilt = core::mem::take(&mut self.spoilt);
        if spoilt || samples.is_empty() {
            return None;
        }
        let first_window = self.windows.wrapping_sub(samples.len() as u64);
        self.batches_sent = self.batches_sent.wrapping_add(1);
        self.samples_sent = self.samples_sent.wrapping_add(samples.len() as u64);
        Some(Batch {
            // The number wraps after more than a year; the host extends it.
            sequence: (first_window / BATCH as u64) as u32,
            first_tick: self
                .first_tick
                .wrapping_add(first_window.wrapping_mul(u64::from(self.decimation))),
            samples,
        })
    }
}
