//! A column that keeps each value for several rows: a slow topic in a fast recording.
//!
//! The signal is then a staircase. Its derivative is zero except in single rows, and it is late by half a stair on
//! average.
//!
//! A repeated value alone is no evidence: a slow joint stays on one encoder count, a torque on one converter count.
//! Evidence is a repeated value between two changes that are each larger than two sensor steps.
//!
//! Not detected: a rate above two thirds of the recording's rate, where most values fill one row.

/// Minimum size of the changes on both sides of a repeated value, in sensor steps (the smallest change of the column).
const MIN_CHANGE_STEPS: f64 = 2.5;
/// Minimum number of values between clear changes.
const MIN_CHANGES: usize = 20;

/// Returns the median number of rows in which `values` keep one value between two clear changes. Returns `None` if that
/// is one row, or if there are too few clear changes.
pub(super) fn repeated_rows(values: &[f64]) -> Option<usize> {
    let changes: Vec<(usize, f64)> = (values.windows(2).enumerate())
        .map(|(row, pair)| (row, (pair[1] - pair[0]).abs()))
        .filter(|(_, by)| *by > 0.0)
        .collect();
    let step = changes
        .iter()
        .map(|(_, by)| *by)
        .fold(f64::INFINITY, f64::min);
    let is_clear = |(_, by): &(usize, f64)| *by > MIN_CHANGE_STEPS * step;
    let mut rows: Vec<usize> = changes
        .windows(2)
        .filter(|pair| pair.iter().all(is_clear))
        .map(|pair| pair[1].0 - pair[0].0)
        .collect();
    if rows.len() < MIN_CHANGES {
        return None;
    }
    let middle = rows.len() / 2;
    let median = *rows.select_nth_unstable(middle).1;
    (median > 1).then_some(median)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn motion(rows: usize, count: f64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        (0..rows)
            .map(|k| {
                let t = k as f64 * 1e-3;
                let q = 0.8 * (2.3 * t).sin() + 0.1 * (31.0 * t).sin();
                let noise = 2e-5 * (rng.random::<f64>() - 0.5);
                ((q + noise) / count).round() * count
            })
            .collect()
    }

    #[test]
    fn repeated_samples_are_found_whatever_their_number() {
        for count in [1e-12, 1e-5, 2e-4] {
            let clean = motion(12_000, count);
            assert_eq!(repeated_rows(&clean), None, "{count}");
            for n in [2, 3, 4, 5, 10, 20] {
                let stairs: Vec<f64> = (0..clean.len()).map(|k| clean[k - k % n]).collect();
                assert_eq!(repeated_rows(&stairs), Some(n), "{count} {n}");
            }
        }
    }

    /// A log at 1000 Hz of a topic whose rows come irregularly, on average every fourth.
    #[test]
    fn irregular_stairs_are_found() {
        let clean = motion(12_000, 1e-12);
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(6);
        let (mut stairs, mut last) = (Vec::new(), clean[0]);
        for value in clean {
            if rng.random::<f64>() < 0.25 {
                last = value;
            }
            stairs.push(last);
        }
        assert!(
            matches!(repeated_rows(&stairs), Some(2..=4)),
            "{:?}",
            repeated_rows(&stairs)
        );
    }

    #[test]
    fn coarse_encoders_rests_and_coarse_converters_are_no_stairs() {
        // An encoder count of 5 mrad at 1 kHz: one value fills many rows, and each change is one count.
        assert_eq!(repeated_rows(&motion(12_000, 5e-3)), None);
        // Steps and dwells of a staircase motion, with noise of three counts.
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let rests: Vec<f64> = (0..12_000)
            .map(|k| {
                let place = 0.1 * f64::from(k / 1000);
                place + (3e-4 * (rng.random::<f64>() - 0.5) / 1e-4).round() * 1e-4
            })
            .collect();
        assert_eq!(repeated_rows(&rests), None);
        // A torque in converter counts, with noise of two counts.
        let torque: Vec<f64> = (0..12_000)
            .map(|k| {
                let t = f64::from(k) * 1e-3;
                ((2.0 * (3.0 * t).sin() + 0.08 * (rng.random::<f64>() - 0.5)) / 0.02).round() * 0.02
            })
            .collect();
        assert_eq!(repeated_rows(&torque), None);
    }
}
