//! Correlation time of a residual.

/// Largest lag, in rows, of the residuals' autocorrelation.
pub(crate) const LAGS: usize = 200;

/// Autocovariance of a stream of residuals.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    /// The latest residuals from `next` on, newest first.
    ring: Vec<f64>,
    next: usize,
    seen: u64,
    sums: Vec<f64>,
}

impl Default for Memory {
    fn default() -> Self {
        Self {
            ring: vec![0.0; 8 * LAGS],
            next: 7 * LAGS,
            seen: 0,
            sums: vec![0.0; LAGS + 1],
        }
    }
}

impl Memory {
    /// Adds the next residual.
    pub(crate) fn push(&mut self, e: f64) {
        // Written backwards, so that earlier residuals follow in order; zeros before the first.
        if self.next == 0 {
            self.next = self.ring.len() - LAGS;
            let (start, end) = self.ring.split_at_mut(self.next);
            end.copy_from_slice(&start[..LAGS]);
        }
        self.next -= 1;
        self.ring[self.next] = e;
        let before = &self.ring[self.next..=self.next + LAGS];
        for (sum, past) in self.sums.iter_mut().zip(before) {
            *sum += e * past;
        }
        self.seen += 1;
    }

    /// Returns the autocorrelation at lags 0 … [`LAGS`].
    pub(crate) fn correlation(&self) -> Vec<f64> {
        let zero = self.sums[0].max(f64::MIN_POSITIVE);
        self.sums.iter().map(|s| s / zero).collect()
    }

    /// Returns the correlation time 1 + 2·Σρ in rows, at least one. The sum ends where ρ falls below twice its standard
    /// error (truncation of Geyer's initial sequence, 1992, adapted to the noise of the estimate).
    pub(crate) fn length(&self) -> f64 {
        memory_of(&self.correlation(), self.seen)
    }

    /// Returns the number of residuals so far.
    pub(crate) fn seen(&self) -> u64 {
        self.seen
    }
}

/// Returns [`Memory::length`] for a given autocorrelation (lag 0 first) of `seen` residuals.
pub(crate) fn memory_of(correlation: &[f64], seen: u64) -> f64 {
    let threshold = 2.0 / (seen.max(1) as f64).sqrt();
    let sum: f64 = correlation
        .iter()
        .skip(1)
        .take_while(|r| **r > threshold)
        .sum();
    1.0 + 2.0 * sum
}
