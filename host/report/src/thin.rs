//! Reduces the number of points of a curve without a visible change.

/// Returns the indices of at most `limit` samples (at least 8) that look like all samples when drawn.
///
/// The samples are divided into runs of equal length. Of each run the first, the last, and the minimum and maximum of
/// every channel remain, so no spike is lost. One sample of each run with a value that is not finite remains too, so no
/// gap is closed. This is M4 aggregation (Jugel, Jerzak, Hackenbroich and Markl, "M4: A Visualization-Oriented Time
/// Series Data Aggregation", 2014, §4), by sample number, so that curves with reversals can be thinned too.
///
/// `channels` hold the drawn values of each sample: ordinates, band edges, and the abscissae if the curve may reverse.
/// Every channel has `count` values; missing ones count as gaps.
#[must_use]
pub fn thin(count: usize, channels: &[&[f64]], limit: usize) -> Vec<usize> {
    let limit = limit.max(8);
    if count <= limit {
        return (0..count).collect();
    }
    let per_run = 3 + 2 * channels.len();
    let runs = (limit / per_run).max(1);
    let mut kept = Vec::with_capacity(limit);
    let mut chosen = Vec::with_capacity(per_run);
    for run in 0..runs {
        let (start, end) = (run * count / runs, (run + 1) * count / runs);
        if start == end {
            continue;
        }
        chosen.clear();
        chosen.extend([start, end - 1]);
        let mut gap = None;
        for channel in channels {
            let mut least: Option<(f64, usize)> = None;
            let mut greatest: Option<(f64, usize)> = None;
            for i in start..end {
                let v = channel.get(i).copied().unwrap_or(f64::NAN);
                if !v.is_finite() {
                    gap = gap.or(Some(i));
                    continue;
                }
                if least.is_none_or(|(low, _)| v < low) {
                    least = Some((v, i));
                }
                if greatest.is_none_or(|(high, _)| v > high) {
                    greatest = Some((v, i));
                }
            }
            chosen.extend(least.map(|(_, i)| i));
            chosen.extend(greatest.map(|(_, i)| i));
        }
        chosen.extend(gap);
        chosen.sort_unstable();
        chosen.dedup();
        kept.extend_from_slice(&chosen);
    }
    kept
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_survives_and_the_limit_holds() {
        for spike in [0, 1, 7_777, 49_999, 99_999] {
            let mut y: Vec<f64> = (0..100_000).map(|i| (i as f64 * 1e-3).sin()).collect();
            y[spike] = 9.0;
            let kept = thin(y.len(), &[&y], 4000);
            assert!(kept.len() <= 4000 && kept.len() > 1000);
            assert!(kept.contains(&spike) && kept.contains(&0) && kept.contains(&99_999));
            assert!(kept.windows(2).all(|w| w[0] < w[1]));
        }
    }

    #[test]
    fn a_gap_survives() {
        let mut y = vec![1.0; 50_000];
        y[31_234] = f64::NAN;
        assert!(thin(y.len(), &[&y], 1000).contains(&31_234));
    }

    #[test]
    fn the_envelope_of_noise_is_kept_everywhere() {
        let y: Vec<f64> = (0..60_000u64)
            .map(|i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64)
            .collect();
        let kept = thin(y.len(), &[&y], 3000);
        for window in (0..60).map(|k| k * 1000..(k + 1) * 1000) {
            let all = y[window.clone()].iter().copied().fold(0.0, f64::max);
            let drawn = kept.iter().filter(|i| window.contains(i)).map(|i| y[*i]);
            assert!(drawn.fold(0.0, f64::max) >= 0.995 * all);
        }
    }

    #[test]
    fn few_samples_are_left_alone() {
        let y = [1.0, f64::NAN, 2.0];
        assert_eq!(thin(3, &[&y], 4000), [0, 1, 2]);
        assert_eq!(thin(0, &[], 4000), Vec::<usize>::new());
    }
}
