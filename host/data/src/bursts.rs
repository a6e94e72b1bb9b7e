//! Rows stamped on arrival, several at a time: a USB latency timer, a network that collects packets.
//!
//! No row is missing. The stamps of a burst are close together. A long interval follows that lasts as long as the rows
//! of the burst took. The positions change from row to row as if the rows were evenly spaced. Rows that are recorded only
//! where a robot stops are close together, too, but there it moves between the stops.

use rig_numerics::statistics::median;

use super::columns::{Layout, Role};

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

/// Sizes of the changes of the positions from row to row.
pub(super) struct Changes {
    /// Columns of the positions.
    columns: Vec<usize>,
    last: Option<Vec<f64>>,
    /// Sum over the joints, by row from the second on.
    pub sizes: Vec<f64>,
}

impl Changes {
    pub(super) fn of(layout: &Layout) -> Self {
        let is_position = |k: &usize| {
            let role = &layout.columns[*k].role;
            matches!(role, Role::Position(_) | Role::MotorPosition(_))
        };
        Self {
            columns: (0..layout.columns.len()).filter(is_position).collect(),
            last: None,
            sizes: Vec::new(),
        }
    }

    /// Takes the values of a row.
    pub(super) fn push(&mut self, values: &[f64]) {
        let now: Vec<f64> = self.columns.iter().map(|k| values[*k]).collect();
        if let Some(last) = &self.last {
            let steps = now.iter().zip(last).map(|(now, last)| (now - last).abs());
            self.sizes.push(steps.sum());
        }
        self.last = Some(now);
    }
}

/// Returns the bursts in which rows with these stamps arrived; `None` if they arrived one by one. `moved` has the sizes of the
/// changes of the positions ([`Changes`]).
pub(super) fn bursts(times: &[f64], moved: &[f64]) -> Option<Bursts> {
    let intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (first, last) = (times.first()?, times.last()?);
    let mean = (last - first) / intervals.len().max(1) as f64;
    // Intervals within a burst are shorter than the mean, the one at its end is longer.
    let (short, long): (Vec<f64>, Vec<f64>) = intervals.iter().partition(|step| **step < mean);
    let short_count = short.len();
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
    let between: f64 = ends.iter().filter_map(|k| moved.get(*k)).sum();
    let within = moved.iter().sum::<f64>() - between;
    let [between, within] = [between / long.len() as f64, within / short_count as f64];
    // By rows the two are alike, by stamps they have the ratio of the intervals: which is nearer?
    if between * between * short > within * within * typical {
        return None;
    }
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
                let even = vec![1e-3; times.len() - 1];
                assert_eq!(bursts(&times, &[]), bursts(&times, &even));
                let found = bursts(&times, &even).unwrap();
                assert_eq!(found.rows, rows as usize);
                assert!((found.rate / rate - 1.0).abs() < 0.02, "{found:?}");
            }
        }
    }

    /// Five rows at 100 Hz in each pose, some seconds apart, with and without noise of the positions.
    #[test]
    fn rows_where_a_robot_stops_are_no_bursts() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(4);
        for noise in [0.0, 1e-4] {
            let rows = 0..200_u32;
            let time = |k: u32| f64::from(k / 5) * 6.0 + f64::from(k % 5) * 0.01;
            let times: Vec<f64> = rows.clone().map(time).collect();
            let position = |k: u32| 0.7 * f64::from(k / 5).sin();
            let mut at = |k: u32| position(k) + noise * rng.random::<f64>();
            let places: Vec<f64> = rows.map(&mut at).collect();
            let moved: Vec<f64> = places
                .windows(2)
                .map(|two| (two[1] - two[0]).abs())
                .collect();
            assert_eq!(bursts(&times, &moved), None);
            assert!(
                bursts(&times, &[]).is_some(),
                "by their stamps they look alike"
            );
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
            assert_eq!(bursts(&times, &[]), None);
        }
    }
}
