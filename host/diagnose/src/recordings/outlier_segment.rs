//! Disturbances: a few short stretches with most of a torque residual, from contact, an impact or damaged data.
//!
//! Unmodelled physics repeats with the motion; a few far larger residuals are not from the rig. With two runs of a
//! motion, their difference is noise. Without a repeat, this test finds disturbances.
//!
//! Leaves out: disturbances that last as long as the motion, or are no larger than the other residual.

use std::ops::Range;

use rig_data::runs::Run;

/// Length of a stretch, s.
const STRETCH: f64 = 0.5;
/// Fewest stretches for a comparison.
const FEWEST: usize = 20;
/// Mean square of a stretch over the median one, above which it is an outlier.
const LOUD: f64 = 25.0;
/// Largest share of the stretches that may be outliers.
const A_FEW: f64 = 0.2;
/// Least share of the squares in outliers.
const MOST: f64 = 0.5;

/// A few stretches with most of the residual.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Burst {
    /// Share of the squares in these stretches beyond the level of the others.
    pub(crate) share: f64,
    /// Number of stretches.
    pub(crate) count: usize,
    /// Recording with the largest one.
    pub(crate) label: String,
    /// Start and end of the largest one, s.
    pub(crate) time: [f64; 2],
    /// RMS of the largest one over the median.
    pub(crate) times: f64,
    /// Rows of each.
    pub(crate) rows: Vec<Range<usize>>,
}

/// Returns the disturbance in a joint's residual, if any. Rows are `period` s apart and begin at each run's entry of
/// `starts`, which ends one past the last. `keep` marks the used rows.
pub(crate) fn burst(
    residual: &[f64],
    keep: &[bool],
    starts: &[usize],
    period: f64,
    runs: &[Run],
) -> Option<Burst> {
    let length = ((STRETCH / period).ceil() as usize).max(1);
    // Mean square, squares, run, first row.
    let mut stretches: Vec<(f64, f64, usize, usize)> = Vec::new();
    for (run, pair) in starts.windows(2).enumerate() {
        for first in (pair[0]..pair[1]).step_by(length) {
            let part = first..(first + length).min(pair[1]);
            let used = part.clone().filter(|k| keep[*k]).count();
            if 2 * used < length {
                continue;
            }
            let squares: f64 = (part.filter(|k| keep[*k]))
                .map(|k| residual[k] * residual[k])
                .sum();
            stretches.push((squares / used as f64, squares, run, first));
        }
    }
    if stretches.len() < FEWEST {
        return None;
    }
    stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
    let middle = stretches[stretches.len() / 2].0;
    let quiet = stretches.partition_point(|s| s.0 <= LOUD * middle);
    let loud = &stretches[quiet..];
    let (mean, _, run, first) = *loud.last()?;
    if loud.len() as f64 > A_FEW * stretches.len() as f64 || middle <= 0.0 {
        return None;
    }
    let all: f64 = stretches.iter().map(|s| s.1).sum();
    let share = (loud.iter())
        .map(|s| s.1 * (1.0 - middle / s.0))
        .sum::<f64>()
        / all;
    let begin = runs[run].t.first()? + (first - starts[run]) as f64 * period;
    (share > MOST).then(|| Burst {
        share,
        count: loud.len(),
        label: runs[run].label.clone(),
        time: [begin, begin + STRETCH],
        times: (mean / middle).sqrt(),
        rows: (loud.iter())
            .map(|&(_, _, run, first)| first..(first + length).min(starts[run + 1]))
            .collect(),
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    const PERIOD: f64 = 0.01;

    /// A minute of a residual that is three times larger in fast motion, with `more` added between 20 and 21 s.
    fn found(more: f64) -> Option<Burst> {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let residual: Vec<f64> = (0..6000)
            .map(|k| {
                let t = k as f64 * PERIOD;
                let loud = if ((t / 7.0) as usize).is_multiple_of(2) {
                    1.0
                } else {
                    3.0
                };
                let added = if (20.0..21.0).contains(&t) { more } else { 0.0 };
                loud * (rng.random::<f64>() - 0.5) + added * (40.0 * t).sin()
            })
            .collect();
        let run = Run {
            label: "a.csv".into(),
            t: vec![5.0],
            ..Run::default()
        };
        burst(&residual, &[true; 6000], &[0, 6000], PERIOD, &[run])
    }

    #[test]
    fn a_knock_is_told_from_a_motion_that_is_louder_at_times() {
        assert_eq!(found(0.0), None);
        let knock = found(20.0).unwrap();
        assert_eq!(knock.label, "a.csv");
        assert!((25.0..26.0).contains(&knock.time[0]), "{knock:?}");
        assert!(
            knock.share > 0.8 && (2..=3).contains(&knock.count),
            "{knock:?}"
        );
    }
}
