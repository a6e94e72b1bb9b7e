//! Spikes of a measured velocity that the position does not show: a counter overflow, a lost sample in the drive.

/// Rows on either side for the difference quotient of the position.
const BESIDE: usize = 2;
/// A spike is this multiple of the 99th percentile of the difference between the two velocities …
const STANDS_OUT: f64 = 50.0;
/// … and at least this share of the highest speed.
const FAST: f64 = 0.5;

/// The row in which velocity and position differ most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RateSpike {
    /// Row of the spike.
    pub row: usize,
    /// Measured velocity in this row.
    pub value: f64,
    /// Velocity from the position in this row.
    pub speed: f64,
    /// Number of spikes.
    pub count: usize,
}

/// Returns the largest spike of `qd` compared with `q`, if any. A velocity that is late, filtered or in another unit
/// differs everywhere, so it has no spikes.
pub(super) fn rate_spike(t: &[f64], q: &[f64], qd: &[f64]) -> Option<RateSpike> {
    let speed = |k: usize| (q[k + BESIDE] - q[k - BESIDE]) / (t[k + BESIDE] - t[k - BESIDE]);
    let rows = BESIDE..q.len().min(qd.len()).checked_sub(BESIDE)?;
    let off: Vec<f64> = rows.clone().map(|k| (qd[k] - speed(k)).abs()).collect();
    let last = off.len().checked_sub(1)?;
    let mut sorted = off.clone();
    let common = *sorted
        .select_nth_unstable_by(last - last / 100, f64::total_cmp)
        .1;
    // The velocity of a coarse encoder has steps of one count per row.
    let steps = q.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let count = steps.filter(|by| *by > 0.0).fold(f64::INFINITY, f64::min);
    let step = count / (t[t.len() - 1] - t[0]) * (t.len() - 1) as f64;
    let fastest = rows.map(|k| speed(k).abs()).fold(0.0, f64::max);
    let least = (STANDS_OUT * common).max(FAST * fastest).max(step);
    let spikes = off.iter().filter(|by| **by > least).count();
    let worst = (0..off.len()).max_by(|a, b| off[*a].total_cmp(&off[*b]))? + BESIDE;
    (spikes > 0).then(|| RateSpike {
        row: worst,
        value: qd[worst],
        speed: speed(worst),
        count: spikes,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    type Columns = (Vec<f64>, Vec<f64>, Vec<f64>);

    /// A motion whose velocity is that of the encoder's counts, every `over` rows.
    fn motion(count: f64, over: usize) -> Columns {
        let t: Vec<f64> = (0..8000).map(|k| f64::from(k) * 1e-3).collect();
        let q: Vec<f64> = (t.iter())
            .map(|t| ((0.8 * (2.3 * t).sin() + 0.1 * (31.0 * t).sin()) / count).round() * count)
            .collect();
        let qd = (0..t.len())
            .map(|k| (q[k] - q[k.saturating_sub(over)]) / (over as f64 * 1e-3))
            .collect();
        (t, q, qd)
    }

    #[test]
    fn spikes_are_found_beside_coarse_late_and_filtered_velocities() {
        for count in [1e-7, 1e-4, 1e-3] {
            for over in [1, 4, 10] {
                let (t, q, mut qd) = motion(count, over);
                assert_eq!(rate_spike(&t, &q, &qd), None, "{count} {over}");
                // At each passing of zero, as where a counter wraps, and a single one amid the motion.
                let mut at_zero = qd.clone();
                for k in 1..q.len() {
                    if (q[k] < 0.0) != (q[k - 1] < 0.0) {
                        at_zero[k] = -1200.0;
                    }
                }
                let found = rate_spike(&t, &q, &at_zero).unwrap();
                assert!(found.count >= 4 && found.value == -1200.0, "{found:?}");
                qd[4321] += 300.0;
                let found = rate_spike(&t, &q, &qd).unwrap();
                assert_eq!((found.row, found.count), (4321, 1));
            }
        }
    }

    #[test]
    fn zeros_and_other_units_have_no_spikes() {
        let (t, q, qd) = motion(1e-4, 4);
        let rpm: Vec<f64> = qd.iter().map(|v| 9.55 * v).collect();
        assert_eq!(rate_spike(&t, &q, &vec![0.0; q.len()]), None);
        assert_eq!(rate_spike(&t, &q, &rpm), None);
    }
}
