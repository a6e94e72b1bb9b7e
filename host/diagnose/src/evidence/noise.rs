//! Noise of one joint: autoregressive in time, with gaps.
//!
//! Ljung 1999, System Identification, ch. 7: least squares on prewhitened rows maximises the likelihood. Runs that
//! repeat one motion are averaged: their differences are noise that no model made, and what repeats is either an
//! effect or a discrepancy.

use rig_numerics::autoregression::Predictors;
use rig_numerics::statistics::mean_square;

use crate::recordings::noise_floor;
use crate::rows::regression::Rows;
use rig_data::runs::Run;

/// Highest order of the autoregression.
const ORDER: usize = 10;
/// Share of white noise assumed in the variance. At the band edge of the filters the torque has hardly any noise left,
/// and their errors are larger than it.
const WHITE_SHARE: f64 = 0.2;

/// Rows that are averaged, because their runs repeat one motion.
pub(crate) struct Averaging {
    /// For each averaged row, the rows of the runs.
    sources: Vec<Vec<usize>>,
    /// First averaged row of each group of runs, and the number of them at the end.
    pub(crate) starts: Vec<usize>,
}

impl Averaging {
    /// Groups the runs that repeat each other.
    pub(crate) fn of(rows: &Rows, runs: &[Run]) -> Self {
        let pairs = noise_floor::repeats(runs);
        let mut group: Vec<usize> = (0..runs.len()).collect();
        for (a, b) in pairs {
            let [into, from] = [group[a].min(group[b]), group[a].max(group[b])];
            group
                .iter_mut()
                .filter(|g| **g == from)
                .for_each(|g| *g = into);
        }
        let mut own = Self {
            sources: Vec::new(),
            starts: vec![0],
        };
        for first in 0..runs.len() {
            let members: Vec<usize> = (0..runs.len()).filter(|r| group[*r] == first).collect();
            let length = |r: &usize| rows.starts[r + 1] - rows.starts[*r];
            let Some(length) = members.iter().map(length).min() else {
                continue;
            };
            own.sources
                .extend((0..length).map(|k| members.iter().map(|r| rows.starts[*r] + k).collect()));
            own.starts.push(own.sources.len());
        }
        own
    }

    /// Returns true if a motion was recorded more than once.
    pub(crate) fn repeats(&self) -> bool {
        self.sources.iter().any(|rows| rows.len() > 1)
    }

    /// Returns the averaged rows of a column.
    pub(crate) fn averaged(&self, column: &[f64]) -> Vec<f64> {
        (self.sources.iter())
            .map(|rows| rows.iter().map(|r| column[*r]).sum::<f64>() / rows.len() as f64)
            .collect()
    }

    /// Returns true for averaged rows of which all runs are kept.
    pub(crate) fn kept(&self, keep: &[bool]) -> Vec<bool> {
        (self.sources.iter())
            .map(|rows| rows.iter().all(|r| keep[*r]))
            .collect()
    }

    /// Returns the largest number of runs of one motion.
    fn most(&self) -> usize {
        self.sources.iter().map(Vec::len).max().unwrap_or(0)
    }

    /// Returns the deviation of one run of each motion from the mean of its runs, scaled to the noise of the mean; None
    /// on rows without such a run or without a repeated one.
    fn deviation(&self, member: usize, residual: &[f64]) -> Vec<Option<f64>> {
        (self.sources.iter())
            .map(|rows| {
                let row = rows.get(member).filter(|_| rows.len() > 1)?;
                let count = rows.len() as f64;
                let mean = rows.iter().map(|r| residual[*r]).sum::<f64>() / count;
                Some((residual[*row] - mean) / (count - 1.0).sqrt())
            })
            .collect()
    }
}

/// Noise model of the averaged rows of one joint.
pub(crate) struct Noise {
    /// Number of preceding kept rows without a gap, up to the order; None for a row that is not used.
    preceding: Vec<Option<usize>>,
    /// Weight of each row: the mean of fewer runs is noisier.
    weights: Vec<f64>,
    predictors: Predictors,
    /// Standard deviation of a row of weight 1.
    pub(crate) deviation: f64,
    /// Mean square of the whitened differences of repeated runs; None without a repeated run.
    floor: Option<f64>,
    /// True for used rows of a motion that was recorded more than once.
    repeated: Vec<bool>,
}

/// Autocovariance of series on the `keep` rows in the parts between `starts`, up to [`ORDER`], and the number of products
/// at lag 0.
fn autocovariance(
    series: &[Vec<Option<f64>>],
    keep: &[bool],
    starts: &[usize],
) -> ([f64; ORDER + 1], u64) {
    let mut sums = [0.0; ORDER + 1];
    let mut counts = [0u64; ORDER + 1];
    for own in series {
        let at = |k: usize| own[k].filter(|_| keep[k]);
        for part in starts.windows(2) {
            for lag in 0..=ORDER {
                for k in part[0] + lag..part[1] {
                    if let Some((a, b)) = at(k).zip(at(k - lag)) {
                        sums[lag] += a * b;
                        counts[lag] += 1;
                    }
                }
            }
        }
    }
    for (c, (count, lag)) in sums.iter_mut().zip(counts.iter().zip(0..)) {
        // A taper keeps the sequence positive definite in spite of the gaps.
        let taper = 1.0 - f64::from(lag) / (10.0 * ORDER as f64);
        *c *= taper / (*count).max(1) as f64;
    }
    (sums, counts[0])
}

impl Noise {
    /// Estimates the noise from the differences of repeated runs in a residual on all rows; without a repeated run, from
    /// the averaged residual `left` of a model.
    pub(crate) fn of(averaging: &Averaging, residual: &[f64], keep: &[bool], left: &[f64]) -> Self {
        let keep = averaging.kept(keep);
        let most = averaging.most();
        let weights: Vec<f64> = (averaging.sources.iter())
            .map(|rows| (rows.len() as f64 / most as f64).sqrt())
            .collect();
        let weighed = |series: Vec<Option<f64>>| -> Vec<Option<f64>> {
            let pairs = series.into_iter().zip(&weights);
            pairs.map(|(x, weight)| Some(weight * x?)).collect()
        };
        let series: Vec<Vec<Option<f64>>> = match averaging.repeats() {
            true => (0..most)
                .map(|member| weighed(averaging.deviation(member, residual)))
                .collect(),
            false => vec![left.iter().copied().map(Some).collect()],
        };
        let (mut covariance, count) = autocovariance(&series, &keep, &averaging.starts);
        covariance[0] *= 1.0 + WHITE_SHARE;
        let predictors = Predictors::of(&covariance, count);
        let mut preceding = vec![None; keep.len()];
        for part in averaging.starts.windows(2) {
            let mut run = 0;
            for k in part[0]..part[1] {
                preceding[k] = keep[k].then_some(run);
                run = if keep[k] {
                    (run + 1).min(predictors.order())
                } else {
                    0
                };
            }
        }
        let repeated = (averaging.sources.iter().zip(&keep))
            .filter(|(_, keep)| **keep)
            .map(|(rows, _)| rows.len() > 1)
            .collect();
        let mut own = Self {
            preceding,
            weights,
            deviation: covariance[0].sqrt(),
            predictors,
            floor: None,
            repeated,
        };
        if averaging.repeats() {
            let squares: Vec<f64> = series.iter().flat_map(|s| own.innovations_of(s)).collect();
            own.floor = Some(mean_square(&squares));
        }
        own
    }

    /// Returns the innovations of a weighted series on the used rows that have a value.
    fn innovations_of(&self, series: &[Option<f64>]) -> Vec<f64> {
        let rows: Vec<f64> = series.iter().map(|x| x.unwrap_or(0.0)).collect();
        let used = (series.iter().zip(&self.preceding)).filter(|(_, order)| order.is_some());
        (self.innovations(&rows).iter().zip(used))
            .filter_map(|(innovation, (value, _))| value.map(|_| *innovation))
            .collect()
    }

    /// Returns the mean square of whitened rows of motions that were recorded more than once.
    fn squares_of_repeats(&self, whitened: &[f64]) -> f64 {
        let own: Vec<f64> = (whitened.iter().zip(&self.repeated))
            .filter_map(|(x, repeated)| repeated.then_some(*x))
            .collect();
        mean_square(&own)
    }

    /// Returns the mean square of whitened innovations beyond that of the differences of repeated runs; None without a
    /// repeated run.
    pub(crate) fn beyond_repeats(&self, innovations: &[f64]) -> Option<f64> {
        Some(self.squares_of_repeats(innovations) - self.floor?)
    }

    /// Returns the averaged rows of which these are the whitened used ones; zero on the others.
    pub(crate) fn coloured(&self, whitened: &[f64]) -> Vec<f64> {
        let mut rows = vec![0.0; self.preceding.len()];
        let mut next = whitened.iter();
        for (k, order) in self.preceding.iter().enumerate() {
            if let (Some(order), Some(innovation)) =
                (*order, order.is_some().then(|| next.next()).flatten())
            {
                let past = self.predictors.coefficients(order).iter();
                let predicted: f64 = past.enumerate().map(|(l, a)| a * rows[k - 1 - l]).sum();
                rows[k] = predicted + innovation * self.predictors.sigma(order);
            }
        }
        rows.iter_mut()
            .zip(&self.weights)
            .for_each(|(x, weight)| *x /= weight);
        rows
    }

    /// Returns the used rows of an averaged column, whitened: noise has the standard deviation 1.
    pub(crate) fn whitened(&self, column: &[f64]) -> Vec<f64> {
        let rows: Vec<f64> = (column.iter().zip(&self.weights))
            .map(|(x, w)| w * x)
            .collect();
        self.innovations(&rows)
    }

    /// Returns the used ones of weighted rows, less their prediction, over the standard deviation of the innovation.
    fn innovations(&self, rows: &[f64]) -> Vec<f64> {
        (self.preceding.iter().enumerate())
            .filter_map(|(k, order)| {
                let order = (*order)?;
                let past = self.predictors.coefficients(order).iter();
                let predicted: f64 = past.enumerate().map(|(l, a)| a * rows[k - 1 - l]).sum();
                Some((rows[k] - predicted) / self.predictors.sigma(order))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White noise from a congruential generator, uniform with variance 1.
    fn white(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                ((state >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * 12.0_f64.sqrt()
            })
            .collect()
    }

    /// An autoregression of order 2 with a resonance.
    fn coloured(count: usize, seed: u64) -> Vec<f64> {
        let mut own = white(count, seed);
        for k in 2..count {
            own[k] += 1.2 * own[k - 1] - 0.6 * own[k - 2];
        }
        own
    }

    fn apart(count: usize, runs: usize) -> Averaging {
        let length = count / runs;
        Averaging {
            sources: (0..length)
                .map(|k| (0..runs).map(|r| r * length + k).collect())
                .collect(),
            starts: vec![0, length],
        }
    }

    fn correlation(values: &[f64], lag: usize) -> f64 {
        let products = values.iter().zip(&values[lag..]).map(|(a, b)| a * b);
        products.sum::<f64>() / (values.len() - lag) as f64
    }

    #[test]
    fn noise_with_the_assumed_white_share_is_whitened_across_gaps() {
        let count = 20_000;
        let noise = coloured(count, 1);
        // Gaps of three rows, as near reversals.
        let keep: Vec<bool> = (0..count).map(|k| k % 37 > 2).collect();
        let own = Noise::of(&apart(count, 1), &noise, &keep, &noise);
        let share = (WHITE_SHARE * correlation(&noise, 0)).sqrt();
        let both: Vec<f64> = (noise.iter().zip(white(count, 3)))
            .map(|(n, w)| n + share * w)
            .collect();
        let innovations = own.whitened(&both);
        assert_eq!(innovations.len(), keep.iter().filter(|k| **k).count());
        let variance = correlation(&innovations, 0);
        assert!((variance - 1.0).abs() < 0.05, "{variance}");
        for lag in 1..6 {
            let left = correlation(&innovations, lag);
            assert!(left.abs() < 0.05, "lag {lag}: {left}");
        }
        let again = own.coloured(&innovations);
        let kept = again.iter().zip(&both).zip(&keep).filter(|(_, k)| **k);
        assert!(kept.map(|((a, b), _)| (a - b).abs()).fold(0.0, f64::max) < 1e-9);
    }

    #[test]
    fn what_repeats_in_two_runs_is_no_noise() {
        let count = 8000;
        let repeated: Vec<f64> = (0..count / 2)
            .map(|k| 30.0 * (0.05 * k as f64).sin())
            .collect();
        let noise = coloured(count, 2);
        let residual: Vec<f64> = (0..count)
            .map(|k| repeated[k % (count / 2)] + noise[k])
            .collect();
        let averaging = apart(count, 2);
        let keep = vec![true; count];
        let own = Noise::of(&averaging, &residual, &keep, &[]);
        let averaged = averaging.averaged(&noise);
        let truth = (1.0 + WHITE_SHARE) * correlation(&averaged, 0);
        assert!(
            (own.deviation.powi(2) / truth - 1.0).abs() < 0.1,
            "{}",
            own.deviation
        );
    }

    /// Two runs of one motion and one of another: the noise of the single run is √2 times that of the mean of the two.
    #[test]
    fn a_motion_that_was_recorded_once_weighs_less_than_the_mean_of_two_runs() {
        let (length, count) = (6000, 3 * 6000);
        let noise = coloured(count, 4);
        let averaging = Averaging {
            sources: (0..length)
                .map(|k| vec![k, length + k])
                .chain((0..length).map(|k| vec![2 * length + k]))
                .collect(),
            starts: vec![0, length, 2 * length],
        };
        let own = Noise::of(&averaging, &noise, &vec![true; count], &[]);
        let innovations = own.whitened(&averaging.averaged(&noise));
        let [mean, single] = [&innovations[..length], &innovations[length..]].map(mean_square);
        assert!((single / mean - 1.0).abs() < 0.1, "{single} {mean}");
        // Noise alone is not beyond the differences of the runs.
        let beyond = own.beyond_repeats(&innovations).unwrap_or(f64::NAN);
        assert!(beyond.abs() < 0.1 * mean, "{beyond} of {mean}");
    }
}
