//! A line with flipped bits and with lost or repeated bytes, to test recordings over a bad line.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::port::Port;

/// Error rates of the line; each is a probability, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbance {
    /// A byte has one bit flipped.
    pub flip: f64,
    /// A byte is lost.
    pub drop_byte: f64,
    /// A whole chunk (the bytes of one write or read) is lost.
    pub drop_chunk: f64,
    /// A whole chunk is repeated.
    pub repeat_chunk: f64,
}

/// Number of errors of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DisturbanceCounts {
    /// Bits flipped.
    pub flipped: u64,
    /// Single bytes lost.
    pub dropped_bytes: u64,
    /// Chunks lost.
    pub dropped_chunks: u64,
    /// Chunks repeated.
    pub repeated_chunks: u64,
}

/// A line with errors in both directions in front of another port; equal seeds give equal errors.
pub struct Lossy<P> {
    inner: P,
    disturbance: Disturbance,
    rng: Pcg64Mcg,
    to_host: VecDeque<u8>,
    counts: DisturbanceCounts,
}

impl<P: Port> Lossy<P> {
    /// Creates a line with errors in front of `inner`.
    pub fn new(inner: P, disturbance: Disturbance, seed: u64) -> Self {
        Self {
            inner,
            disturbance,
            rng: Pcg64Mcg::seed_from_u64(seed),
            to_host: VecDeque::new(),
            counts: DisturbanceCounts::default(),
        }
    }

    /// Returns the errors so far.
    pub fn counts(&self) -> DisturbanceCounts {
        self.counts
    }

    /// Returns the port behind.
    pub fn inner(&self) -> &P {
        &self.inner
    }

    /// Returns the bytes of `chunk` that reach the other end.
    fn disturb(&mut self, chunk: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(chunk.len());
        if self.rng.random_bool(self.disturbance.drop_chunk) {
            self.counts.dropped_chunks += 1;
            return out;
        }
        let repeats = self.rng.random_bool(self.disturbance.repeat_chunk);
        self.counts.repeated_chunks += u64::from(repeats);
        for _ in 0..=u8::from(repeats) {
            for byte in chunk {
                if self.rng.random_bool(self.disturbance.drop_byte) {
                    self.counts.dropped_bytes += 1;
                } else if self.rng.random_bool(self.disturbance.flip) {
                    self.counts.flipped += 1;
                    out.push(byte ^ (1 << self.rng.random_range(0..8_u32)));
                } else {
                    out.push(*byte);
                }
            }
        }
        out
    }
}

impl<P: Port> Port for Lossy<P> {
    fn read(&mut self, into: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let deadline = self.inner.now() + timeout;
        loop {
            let count = into.len().min(self.to_host.len());
            if count > 0 {
                for (place, byte) in into.iter_mut().zip(self.to_host.drain(..count)) {
                    *place = byte;
                }
                return Ok(count);
            }
            let left = deadline.saturating_sub(self.inner.now());
            if left.is_zero() {
                return Ok(0);
            }
            let mut chunk = [0; 512];
            let got = self.inner.read(&mut chunk, left)?;
            let got = chunk.get(..got).unwrap_or_default();
            if !got.is_empty() {
                let through = self.disturb(got);
                self.to_host.extend(through);
            }
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let through = self.disturb(bytes);
        self.inner.write(&through)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}
