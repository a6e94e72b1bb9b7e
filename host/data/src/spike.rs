//! A single row of a torque that stands far out of those around it: a lost bit, a loose contact.

/// Rows on either side that a row is compared with.
const BESIDE: usize = 2;
/// Fewest rows that say what is usual.
const FEWEST: usize = 200;
/// A spike stands out by so many times what one row in a hundred does …
const STANDS_OUT: f64 = 50.0;
/// … and is so many times as much as its neighbours, and as the torque ever is but for one row in a thousand.
const LARGER: f64 = 2.0;
/// Share of the rows that may be spikes, at most: more are no accident.
const A_FEW: f64 = 1e-3;

/// The largest spike of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spike {
    /// Its row.
    pub row: usize,
    /// What stands there.
    pub value: f64,
    /// How many there are.
    pub count: usize,
    /// Largest of the other rows, but for one in a thousand.
    pub usual: f64,
}

/// The largest spike; none where there is none. An impact lasts for some rows, and so does a touch.
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
