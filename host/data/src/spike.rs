//! Spikes of a torque in a single row, far away from the rows around it: a flipped bit, a loose contact.

/// Rows on either side that a row is compared with.
const BESIDE: usize = 2;
/// Minimum number of rows for the percentiles.
const FEWEST: usize = 200;
/// A spike deviates from its neighbours by this multiple of the 99th percentile of such deviations …
const STANDS_OUT: f64 = 50.0;
/// … and is more than this multiple of its neighbours, and of the 99.9th percentile of the torque.
const LARGER: f64 = 2.0;
/// Maximum share of rows that may be spikes: more are not an accident.
const A_FEW: f64 = 1e-3;

/// The largest spike of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spike {
    /// Row of the spike.
    pub row: usize,
    /// Value in this row.
    pub value: f64,
    /// Number of spikes.
    pub count: usize,
    /// 99.9th percentile of the absolute torque.
    pub usual: f64,
}

/// Returns the largest spike, if any. An impact or a disturbance lasts several rows and is not a spike.
pub(super) fn spike(tau: &[f64]) -> Option<Spike> {
    if tau.len() < FEWEST {
        return None;
    }
    let apart: Vec<f64> = (tau.windows(2 * BESIDE + 1))
        .map(|w| {
            let mut around = [w[0], w[1], w[3], w[4]];
            around.sort_by(f64::total_cmp);
            (w[BESIDE] - 0.5 * (around[1] + around[2])).abs()
        })
        .collect();
    let all_but = |values: Vec<f64>, share: usize| {
        let mut sizes = values;
        let place = sizes.len() - 1 - sizes.len() / share;
        *sizes.select_nth_unstable_by(place, f64::total_cmp).1
    };
    let common = all_but(apart.clone(), 100);
    let usual = all_but(tau.iter().map(|t| t.abs()).collect(), 1000);
    let out = |k: usize| {
        let around = (tau[k..=k + 2 * BESIDE].iter().enumerate()).filter(|(at, _)| *at != BESIDE);
        let largest = around.fold(usual, |most, (_, t)| most.max(t.abs()));
        apart[k] > STANDS_OUT * common && tau[k + BESIDE].abs() > LARGER * largest
    };
    let spikes: Vec<usize> = (0..apart.len()).filter(|k| out(*k)).collect();
    let count = spikes.len();
    let row = *(spikes.iter()).max_by(|a, b| apart[**a].total_cmp(&apart[**b]))? + BESIDE;
    (count as f64 <= A_FEW * tau.len() as f64).then(|| Spike {
        row,
        value: tau[row],
        count,
        usual,
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
        assert_eq!(spike(&quiet), None);
        let noisy: Vec<f64> = (quiet.iter())
            .map(|t| t + 0.1 * (rng.random::<f64>() - 0.5))
            .collect();
        assert_eq!(spike(&noisy), None);
        let wild: Vec<f64> = (quiet.iter())
            .map(|t| t + 0.1 * heavy.sample(&mut rng))
            .collect();
        assert_eq!(spike(&wild), None);
        // Five rows of an impact.
        let mut hit = noisy.clone();
        for (k, t) in hit[30_000..30_005].iter_mut().enumerate() {
            *t += 40.0 * (0.6 * (k as f64 + 0.5)).sin();
        }
        assert_eq!(spike(&hit), None);
        for clean in [quiet, noisy, wild] {
            let mut one = clean;
            one[12_345] = 300.0;
            one[54_321] = -100.0;
            let found = spike(&one).unwrap();
            assert_eq!((found.row, found.value, found.count), (12_345, 300.0, 2));
            assert!((3.5..8.0).contains(&found.usual), "{found:?}");
        }
    }
}
