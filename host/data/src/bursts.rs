//! Rows stamped on arrival, several at a time: a USB latency timer, a network that collects packets.
//!
//! No row is missing. The stamps of a burst are close together. A long interval follows that lasts as long as the rows
//! of the burst took.

use rig_numerics::statistics::median;

/// Minimum ratio of the long intervals to the short ones.
const APART: f64 = 5.0;
/// Minimum share of the bursts with the median number of rows, or one more or less.
const ALIKE: f64 = 0.9;
/// Minimum share of the long intervals that differ from their median by less than half of it.
const STEADY: f64 = 0.9;
/// Minimum number of bursts.
const FEWEST: usize = 8;

/// A group of rows that arrive together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bursts {
    /// Number of rows in a burst.
    pub rows: usize,
    /// Mean number of rows per second.
    pub rate: f64,
}

/// Returns the bursts in which rows with these stamps arrived; `None` if they arrived one by one.
pub(super) fn bursts(times: &[f64]) -> Option<Bursts> {
    let intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (first, last) = (times.first()?, times.last()?);
    let mean = (last - first) / intervals.len().max(1) as f64;
    // Intervals within a burst are shorter than the mean, the one at its end is longer.
    let (short, long): (Vec<f64>, Vec<f64>) = intervals.iter().partition(|step| **step < mean);
    let (short, typical) = (median(short)?, median(long.clone())?);
    let steady = long
        .iter()
        .filter(|step| (*step / typical - 1.0).abs() < 0.5);
    if typical < APART * short || (steady.count() as f64) < STEADY * long.len() as f64 {
        return None;
    }
    let ends: Vec<usize> = (0..intervals.len())
        .filter(|k| intervals[*k] >= mean)
        .collect();
    let sizes: Vec<f64> = ends
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) as f64)
        .collect();
    let rows = median(sizes.clone())?;
    let alike = sizes.iter().filter(|size| (*size - rows).abs() <= 1.0);
    // If rows were lost, the other rows keep their time.
    let waits = typical > rows * short;
    (waits
        && sizes.len() >= FEWEST
        && rows >= 2.0
        && alike.count() as f64 >= ALIKE * sizes.len() as f64)
        .then_some(Bursts {
            rows: rows as usize,
            rate: 1.0 / mean,
        })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn bursts_are_counted_and_their_mean_rate_is_the_recordings() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(2);
        for (rows, rate) in [(2_u32, 1000.0), (4, 1000.0), (7, 250.0), (16, 1000.0)] {
            for jitter in [0.0, 0.1] {
                let times: Vec<f64> = (0..1000)
                    .map(|k| {
                        let late = jitter * f64::from(rows) / rate * rng.random::<f64>();
                        let arrival = f64::from((k / rows + 1) * rows) / rate;
                        // All rows of a burst wait for the same event.
                        arrival
                            + f64::from(k % rows) * 2e-5
                            + if k % rows == 0 {
                                0.1 * late
                            } else {
                                0.1 * late.min(1e-5)
                            }
                    })
                    .collect();
                let found = bursts(&times).unwrap();
                assert_eq!(found.rows, rows as usize);
                assert!((found.rate / rate - 1.0).abs() < 0.02, "{found:?}");
            }
        }
    }

    #[test]
    fn even_jittered_and_lossy_stamps_are_none() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let even = |k: u32| f64::from(k) * 1e-3;
        let stamps: Vec<f64> = (0..1000).map(even).collect();
        let jitter: Vec<f64> = (0..1000)
            .map(|k| even(k) + 4e-4 * (2.0 * rng.random::<f64>() - 1.0))
            .collect();
        let lossy: Vec<f64> = (0..2000)
            .map(even)
            .filter(|_| rng.random::<f64>() > 0.3)
            .collect();
        // Frames of eight rows, of which some are lost.
        let frames: Vec<f64> = (0..1000).filter(|k| (k / 8) % 9 != 4).map(even).collect();
        let twice: Vec<f64> = (0..1000)
            .map(|k| even(k) + if k % 50 == 0 { 9e-4 } else { 0.0 })
            .collect();
        for times in [stamps, jitter, lossy, frames, twice] {
            assert_eq!(bursts(&times), None);
        }
    }
}
