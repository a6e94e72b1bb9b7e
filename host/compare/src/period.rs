//! The time after which a set's motion repeats.
//!
//! `rig excite` repeats its motion several times, and a set may hold one motion in several recordings. The recordings of a
//! set are put one behind the other, and the positions are compared with themselves at every lag.
//!
//! Leaves out: repetitions of different length, and a motion that repeats fewer than two times.

use rig_data::prepare::{PrepareError, Recording, Survey};

/// Samples of all recordings that are compared, if they have no gaps.
const SAMPLES: usize = 4096;
/// Least correlation of each moving joint with itself from which a motion repeats. 0.85: of 40 motions of three joints
/// with a ramp at both ends each had 0.91 or more at its period; of 40 sums of three sines of any frequencies a joint each had
/// 0.76 or less at every lag (29 November 2026).
const REPEATS: f64 = 0.85;
/// Correlations below the largest one by this count as equal: of such lags the shortest is the period.
const EQUAL: f64 = 0.02;
/// Correlation below which the lag has left the main lobe: neighbours in time are alike in any motion.
const LOBE: f64 = 0.5;
/// Share of the widest range below which a joint stands still (rad and m compared directly).
const STILL: f64 = 1e-3;

/// A motion that repeats.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Repeating {
    /// Time after which it repeats, s.
    pub period: f64,
    /// By recording, its beginning, s since that of the first one if each followed the one before at once.
    pub begins: Vec<f64>,
    /// Length of all recordings, s.
    pub length: f64,
}

/// Returns how the motion of `recordings` repeats; `None` if it does not.
///
/// # Errors
/// Recordings that cannot be read.
pub(crate) fn repeating(
    recordings: &[&dyn Recording],
    surveys: &[Survey],
) -> Result<Option<Repeating>, PrepareError> {
    let length = |survey: &Survey| survey.rows as f64 / survey.sample_rate;
    let step = surveys.iter().map(length).sum::<f64>() / SAMPLES as f64;
    let mut positions: Vec<Vec<f64>> = Vec::new();
    let (mut begins, mut end) = (Vec::with_capacity(recordings.len()), 0.0);
    for recording in recordings {
        let (begin, mut first) = (end, None);
        recording.each_block(1 << 12, &mut |block| {
            let start = *first.get_or_insert(block.t.first().copied().unwrap_or(0.0));
            positions.resize(block.joints.len(), Vec::new());
            for (k, t) in block.t.iter().enumerate() {
                end = begin + t - start;
                for (list, joint) in positions.iter_mut().zip(&block.joints) {
                    // Gaps are bridged; a recording that is mostly gaps does not fill the memory.
                    while list.len() < 2 * SAMPLES && list.len() as f64 * step <= end {
                        list.push(joint.q[k]);
                    }
                }
            }
            Ok(())
        })?;
        begins.push(begin);
    }
    let found = strongest(positions).filter(|(_, correlation)| *correlation >= REPEATS);
    Ok(found.map(|(lag, _)| Repeating {
        period: lag as f64 * step,
        begins,
        length: end,
    }))
}

/// Returns the lag in samples after which the positions are most alike beyond the main lobe, and their correlation.
fn strongest(mut positions: Vec<Vec<f64>>) -> Option<(usize, f64)> {
    let count = positions.iter().map(Vec::len).min()?;
    for list in &mut positions {
        list.truncate(count);
        let mean = list.iter().sum::<f64>() / count.max(1) as f64;
        list.iter_mut().for_each(|q| *q -= mean);
    }
    let size = |list: &[f64]| list.iter().fold(0.0f64, |most, q| most.max(q.abs()));
    let widest = positions.iter().map(|list| size(list)).fold(0.0, f64::max);
    positions.retain(|list| size(list) > STILL * widest);
    // Two repetitions, and the ends of a recording beside them.
    let all: Vec<f64> = (0..count / 2 + count / 8)
        .map(|lag| correlation(&positions, lag))
        .collect();
    let first = all.iter().position(|c| *c < LOBE)?;
    let most = all[first..].iter().copied().fold(0.0, f64::max);
    let is_peak = |k: usize| {
        let beside = |k: usize| all.get(k).copied().unwrap_or(0.0);
        all[k] >= most - EQUAL && all[k] >= beside(k - 1) && all[k] >= beside(k + 1)
    };
    let lag = (first.max(1)..all.len()).find(|&k| is_peak(k))?;
    Some((lag, most))
}

/// Returns the least correlation of a joint with itself after `lag` samples.
fn correlation(positions: &[Vec<f64>], lag: usize) -> f64 {
    let of = |list: &Vec<f64>| {
        let (before, after) = (&list[..list.len() - lag], &list[lag..]);
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let size = (sum(before, before) * sum(after, after)).sqrt();
        sum(before, after) / size.max(f64::MIN_POSITIVE)
    };
    positions.iter().map(of).fold(1.0, f64::min)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Sums of three sines a joint over 60 s: harmonics of 10 s between ramps, or any frequencies.
    fn motion(seed: u64, joints: usize, repeats: bool) -> Vec<Vec<f64>> {
        let mut random = Pcg64::seed_from_u64(seed);
        let joint = |random: &mut Pcg64| {
            let sines: Vec<[f64; 3]> = (1..4)
                .map(|k| {
                    let any = 0.1 * f64::from(k) * (0.8 + 0.4 * random.random::<f64>());
                    let f = if repeats { 0.1 * f64::from(k) } else { any };
                    let size = 0.3 + random.random::<f64>();
                    [size, f, random.random::<f64>()]
                })
                .collect();
            (0..SAMPLES)
                .map(|k| {
                    let t = 60.0 * k as f64 / SAMPLES as f64;
                    let ramp = if repeats {
                        (t.min(60.0 - t) / 10.0).min(1.0)
                    } else {
                        1.0
                    };
                    let of = |[a, f, phase]: &[f64; 3]| {
                        a * (std::f64::consts::TAU * (f * t + phase)).sin()
                    };
                    ramp * sines.iter().map(of).sum::<f64>()
                })
                .collect()
        };
        (0..joints).map(|_| joint(&mut random)).collect()
    }

    #[test]
    fn a_motion_that_repeats_is_told_from_one_that_does_not() {
        let mut least = 1.0f64;
        let mut others = Vec::new();
        for seed in 0..40 {
            let (found, correlation) = strongest(motion(seed, 3, true)).unwrap();
            let period = found as f64 * 60.0 / SAMPLES as f64;
            assert!((period - 10.0).abs() < 0.05, "{seed}: {period}");
            least = least.min(correlation);
            others.extend(strongest(motion(seed, 3, false)).map(|(_, correlation)| correlation));
        }
        let most = others.iter().copied().fold(0.0, f64::max);
        println!("correlation at the period {least} or more, of other motions {most} or less");
        assert!(least > REPEATS && most < REPEATS, "{least} {most}");
    }

    #[test]
    fn a_joint_at_rest_does_not_count_and_a_sweep_does_not_repeat() {
        let mut list = motion(1, 2, true);
        list.push(vec![0.3; SAMPLES]);
        assert!(strongest(list).unwrap().1 > REPEATS);
        let sweep = |k: usize| (1e-5 * (k * k) as f64).sin();
        let sweep = strongest(vec![(0..SAMPLES).map(sweep).collect()]);
        assert!(sweep.is_none_or(|(_, correlation)| correlation < REPEATS));
        assert_eq!(strongest(vec![vec![0.3; SAMPLES]]), None);
        assert_eq!(strongest(Vec::new()), None);
    }
}
