//! Spikes of a torque in a single row, far away from the rows around it: a flipped bit, a loose contact.

/// Rows on either side that a row is compared with.
const NEIGHBOURS: usize = 2;
/// Minimum number of rows for the percentiles.
const MIN_ROWS: usize = 200;
/// A spike deviates from its neighbours by this multiple of the 99th percentile of such deviations …
const MIN_DEVIATION_RATIO: f64 = 50.0;
/// … and is more than this multiple of its neighbours, and of the 99.9th percentile of the torque.
const MIN_VALUE_RATIO: f64 = 2.0;
/// Maximum share of rows that may be spikes: more are not an accident.
const MAX_SPIKE_SHARE: f64 = 1e-3;

/// The largest spike of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TorqueSpike {
    /// Row of the spike.
    pub row: usize,
    /// Value in this row.
    pub value: f64,
    /// Number of spikes.
    pub count: usize,
    /// 99.9th percentile of the absolute torque.
    pub usual_torque: f64,
}

/// Returns the largest spike, if any. An impact or a disturbance lasts several rows and is not a spike.
pub(super) fn largest_torque_spike(tau: &[f64]) -> Option<TorqueSpike> {
    if tau.len() < MIN_ROWS {
        return None;
    }
    let deviations: Vec<f64> = (tau.windows(2 * NEIGHBOURS + 1))
        .map(|w| {
            let mut around = [w[0], w[1], w[3], w[4]];
            around.sort_by(f64::total_cmp);
            (w[NEIGHBOURS] - 0.5 * (around[1] + around[2])).abs()
        })
        .collect();
    let upper_quantile = |values: Vec<f64>, share: usize| {
        let mut sizes = values;
        let place = sizes.len() - 1 - sizes.len() / share;
        *sizes.select_nth_unstable_by(place, f64::total_cmp).1
    };
    let common = upper_quantile(deviations.clone(), 100);
    let usual_torque = upper_quantile(tau.iter().map(|t| t.abs()).collect(), 1000);
    let is_spike = |k: usize| {
        let around =
            (tau[k..=k + 2 * NEIGHBOURS].iter().enumerate()).filter(|(at, _)| *at != NEIGHBOURS);
        let largest = around.fold(usual_torque, |most, (_, t)| most.max(t.abs()));
        deviations[k] > MIN_DEVIATION_RATIO * common
            && tau[k + NEIGHBOURS].abs() > MIN_VALUE_RATIO * largest
    };
    let spikes: Vec<usize> = (0..deviations.len()).filter(|k| is_spike(*k)).collect();
    let count = spikes.len();
    let row =
        *(spikes.iter()).max_by(|a, b| deviations[**a].total_cmp(&deviations[**b]))? + NEIGHBOURS;
    (count as f64 <= MAX_SPIKE_SHARE * tau.len() as f64).then(|| TorqueSpike {
        row,
        value: tau[row],
        count,
        usual_torque,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StudentT};

    use super::*;

    #[test]
    fn a_spike_is_told_from_heavy_tails_steps_and_impacts() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let heavy = StudentT::new(2.0).unwrap();
        let smooth = |k: usize| 3.0 * (0.003 * k as f64).sin() + (0.0007 * k as f64).cos().signum();
        let quiet: Vec<f64> = (0..60_000).map(smooth).collect();
        assert_eq!(largest_torque_spike(&quiet), None);
        let noisy: Vec<f64> = (quiet.iter())
            .map(|t| t + 0.1 * (rng.random::<f64>() - 0.5))
            .collect();
        assert_eq!(largest_torque_spike(&noisy), None);
        let wild: Vec<f64> = (quiet.iter())
            .map(|t| t + 0.1 * heavy.sample(&mut rng))
            .collect();
        assert_eq!(largest_torque_spike(&wild), None);
        // Five rows of an impact.
        let mut hit = noisy.clone();
        for (k, t) in hit[30_000..30_005].iter_mut().enumerate() {
            *t += 40.0 * (0.6 * (k as f64 + 0.5)).sin();
        }
        assert_eq!(largest_torque_spike(&hit), None);
        for clean in [quiet, noisy, wild] {
            let mut one = clean;
            one[12_345] = 300.0;
            one[54_321] = -100.0;
            let found = largest_torque_spike(&one).unwrap();
            assert_eq!((found.row, found.value, found.count), (12_345, 300.0, 2));
            assert!((3.5..8.0).contains(&found.usual_torque), "{found:?}");
        }
    }
}
