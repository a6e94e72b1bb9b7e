//! Autocorrelation of residuals, and their correlation time: how many rows count as one independent row.

use crate::statistics::sum_of_squares;

/// Largest lag, in rows, of the autocorrelation of a stream.
pub const LAGS: usize = 200;

/// Autocovariance of a stream of residuals, in constant memory.
#[derive(Clone, Debug)]
pub struct Autocorrelation {
    /// The latest residuals from `next` on, newest first.
    ring: Vec<f64>,
    next: usize,
    seen: u64,
    sums: Vec<f64>,
}

impl Default for Autocorrelation {
    fn default() -> Self {
        Self {
            ring: vec![0.0; 8 * LAGS],
            next: 7 * LAGS,
            seen: 0,
            sums: vec![0.0; LAGS + 1],
        }
    }
}

impl Autocorrelation {
    /// Adds the next residual.
    pub fn push(&mut self, e: f64) {
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
    pub fn correlation(&self) -> Vec<f64> {
        let zero = self.sums[0].max(f64::MIN_POSITIVE);
        self.sums.iter().map(|s| s / zero).collect()
    }

    /// Returns the [`correlation_time`] of the residuals so far, in rows.
    pub fn correlation_time(&self) -> f64 {
        correlation_time(&self.correlation(), self.seen)
    }

    /// Returns the number of residuals so far.
    pub fn seen(&self) -> u64 {
        self.seen
    }
}

/// Returns the correlation time 1 + 2·Σρ in rows, at least one, for the autocorrelation ρ (lag 0 first) of `seen`
/// residuals. The sum ends where ρ falls below twice its standard error (truncation of Geyer's initial sequence, 1992,
/// adapted to the noise of the estimate).
pub fn correlation_time(correlation: &[f64], seen: u64) -> f64 {
    let threshold = 2.0 / (seen.max(1) as f64).sqrt();
    let sum: f64 = correlation
        .iter()
        .skip(1)
        .take_while(|r| **r > threshold)
        .sum();
    1.0 + 2.0 * sum
}

/// Returns the correlation time 1 + 2·Σρ of a whole residual, in rows. The sum ends at the first lag without a positive
/// ρ, or after `lags`. Run k has the rows from `starts[k]` to `starts[k + 1]`; no product joins two runs.
pub fn correlation_time_to_zero(residual: &[f64], starts: &[usize], lags: usize) -> f64 {
    let squares = sum_of_squares(residual);
    let mut sum = 0.5;
    for lag in 1..=lags {
        let mut product = 0.0;
        for pair in starts.windows(2) {
            let stretch = &residual[pair[0]..pair[1]];
            if let Some(ahead) = stretch.get(lag..) {
                product += ahead.iter().zip(stretch).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        if product <= 0.0 || squares == 0.0 {
            break;
        }
        sum += product / squares;
    }
    2.0 * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pairs_have_a_correlation_time_of_two_rows() {
        // Signs without a pattern, each twice: ρ is about 0.5 at lag 1 and about 0 beyond.
        let residual: Vec<f64> = (0..20_000_u64)
            .map(|k| (k / 2 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
            .map(|k| (k ^ (k >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9))
            .map(|k| if (k ^ (k >> 32)) & 1 == 0 { 1.0 } else { -1.0 })
            .collect();
        let mut stream = Autocorrelation::default();
        residual.iter().for_each(|r| stream.push(*r));
        let found = [
            stream.correlation_time(),
            correlation_time_to_zero(&residual, &[0, residual.len()], 200),
        ];
        for time in found {
            assert!((time - 2.0).abs() < 0.3, "{found:?}");
        }
    }
}
