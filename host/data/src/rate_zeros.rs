//! A measured velocity that is zero while the position moves: readings that dropped out, or a dead band.

use rig_numerics::statistics::median;

/// Rows on either side for the difference quotient of the position.
const BESIDE: usize = 5;
/// Fewest rows.
const FEWEST: usize = 200;
/// Share of the speed (99th percentile) above which a zero is no velocity.
const FAST: f64 = 0.25;
/// Fewest dropouts.
const DROPOUTS: usize = 3;
/// Largest share of such rows: more are no dropouts.
const MOST: f64 = 0.5;
/// Longest run of dropouts.
const LONGEST: usize = 5;
/// Largest step of the velocity, as a share of its 99th percentile: that of a coarser one is zero in motion, too.
const FINE: f64 = 0.1;
/// Least end of a dead band, as a share of the 99th percentile of the velocity. A smaller one changes little.
const WIDE: f64 = 0.02;
/// Fewest zeros in a dead band while the joint moves at between these shares of its end …
const ZEROS: usize = 20;
const BELOW: [f64; 2] = [0.3, 0.8];
/// … and their least share of the rows there.
const MOST_BELOW: f64 = 0.5;
/// Fewest different values up to twice the end of a dead band: a coarse velocity has one or two.
const VALUES: usize = 8;

/// Why a velocity is zero in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RateZeros {
    /// Single readings are missing.
    Dropouts {
        /// First row.
        row: usize,
        /// Their share of the rows that move as fast.
        share: f64,
    },
    /// Velocities below this are not given.
    DeadBand {
        /// The end of the band, in the unit of the velocity.
        end: f64,
    },
}

/// Returns why a velocity is zero in motion, if it is.
pub(super) fn rate_zeros(t: &[f64], q: &[f64], qd: &[f64]) -> Option<RateZeros> {
    let rows = t.len().min(q.len()).min(qd.len());
    if rows < FEWEST {
        return None;
    }
    let speeds: Vec<(usize, f64)> = (BESIDE..rows - BESIDE)
        .map(|k| {
            let [from, to] = [k - BESIDE, k + BESIDE];
            (k, ((q[to] - q[from]) / (t[to] - t[from])).abs())
        })
        .collect();
    let high = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() * 99 / 100).copied()
    };
    let fastest = high(speeds.iter().map(|(_, speed)| *speed).collect())?;
    let sizes = || qd[..rows].iter().map(|v| v.abs()).filter(|v| *v > 0.0);
    let (least, most) = (sizes().reduce(f64::min)?, high(sizes().collect())?);
    dead_band(&speeds, qd, [least, most])
        .or_else(|| dropouts(&speeds, qd, fastest).filter(|_| least < FINE * most))
}

/// Returns the dead band of a velocity between its least and its highest value.
fn dead_band(speeds: &[(usize, f64)], qd: &[f64], [least, most]: [f64; 2]) -> Option<RateZeros> {
    if least < WIDE * most {
        return None;
    }
    let mut values: Vec<f64> = (qd.iter().map(|v| v.abs()))
        .filter(|v| (least..2.0 * least).contains(v))
        .collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    // The velocity may have another scale than the position.
    let ratios = speeds.iter().filter(|(k, _)| qd[*k].abs() > 2.0 * least);
    let scale = median(ratios.map(|(k, speed)| speed / qd[*k].abs()).collect())?;
    let [low, high] = BELOW.map(|share| share * least * scale);
    let below = || {
        speeds
            .iter()
            .filter(|(_, speed)| (low..high).contains(speed))
    };
    let zeros = below().filter(|(k, _)| qd[*k] == 0.0).count();
    let is_band = values.len() >= VALUES
        && zeros >= ZEROS
        && zeros as f64 > MOST_BELOW * below().count() as f64;
    is_band.then_some(RateZeros::DeadBand { end: least })
}

/// Returns the single readings of zero in fast motion.
fn dropouts(speeds: &[(usize, f64)], qd: &[f64], fastest: f64) -> Option<RateZeros> {
    let fast = || speeds.iter().filter(|(_, speed)| *speed > FAST * fastest);
    let rows: Vec<usize> = fast().map(|(k, _)| *k).filter(|k| qd[*k] == 0.0).collect();
    let mut longest = 0;
    for run in rows.chunk_by(|a, b| a + 1 == *b) {
        longest = longest.max(run.len());
    }
    let share = rows.len() as f64 / fast().count().max(1) as f64;
    let are_single = rows.len() >= DROPOUTS && share < MOST && longest <= LONGEST;
    are_single.then(|| RateZeros::Dropouts {
        row: rows[0],
        share,
    })
}

#[cfg(test)]
#[allow(clippy::panic)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// A motion with an encoder of this count, its velocity with some noise.
    fn motion(rate: f64, count: f64, seed: u64) -> [Vec<f64>; 3] {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let t: Vec<f64> = (0..(20.0 * rate) as usize)
            .map(|k| k as f64 / rate)
            .collect();
        let phase = seed as f64;
        let q = t.iter().map(|t| {
            let q = 0.8 * (2.0 * t + phase).sin() + 0.2 * (7.0 * t).cos();
            (q / count).round() * count
        });
        let q = q.collect();
        let qd = t.iter().map(|t| {
            let noise = 2e-3 * (rng.random::<f64>() - 0.5);
            1.6 * (2.0 * t + phase).cos() - 1.4 * (7.0 * t).sin() + noise
        });
        let qd = qd.collect();
        [t, q, qd]
    }

    const KINDS: [(f64, f64); 3] = [(200.0, 1e-5), (500.0, 1e-4), (1000.0, 1e-6)];

    #[test]
    fn dropouts_are_told_with_their_share() {
        for (rate, count) in KINDS {
            for (seed, share) in [(1, 0.003), (2, 0.05), (3, 0.2)] {
                let [t, q, mut qd] = motion(rate, count, seed);
                assert_eq!(rate_zeros(&t, &q, &qd), None);
                let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
                for v in &mut qd {
                    if rng.random::<f64>() < share {
                        *v = 0.0;
                    }
                }
                let Some(RateZeros::Dropouts { share: found, .. }) = rate_zeros(&t, &q, &qd) else {
                    panic!("{rate} {share}");
                };
                assert!((0.5..2.0).contains(&(found / share)), "{found} for {share}");
            }
        }
    }

    #[test]
    fn a_dead_band_is_told_with_its_end() {
        for (rate, count) in KINDS {
            for (seed, end) in [(1, 0.08), (2, 0.3), (3, 0.9)] {
                for scale in [1.0, 9.55, -1.0] {
                    let [t, q, qd] = motion(rate, count, seed);
                    let cut = |v: &f64| if v.abs() < end { 0.0 } else { scale * v };
                    let qd: Vec<f64> = qd.iter().map(cut).collect();
                    let Some(RateZeros::DeadBand { end: found }) = rate_zeros(&t, &q, &qd) else {
                        panic!("{rate} {end} {scale}");
                    };
                    let off = found / (end * scale.abs()) - 1.0;
                    assert!(off.abs() < 0.05, "{rate} {found} for {end}");
                }
            }
        }
    }

    #[test]
    fn rests_coarse_velocities_and_zeros_throughout_are_neither() {
        for (rate, count) in KINDS {
            for seed in 0..3 {
                let [t, mut q, mut qd] = motion(rate, count, seed);
                assert_eq!(rate_zeros(&t, &q, &vec![0.0; q.len()]), None);
                for step in [0.02, 0.1, 0.4] {
                    let coarse: Vec<f64> = qd.iter().map(|v| (v / step).round() * step).collect();
                    assert_eq!(rate_zeros(&t, &q, &coarse), None, "{rate} {step}");
                }
                // The velocity of the encoder's counts, row by row.
                let counted = (0..q.len()).map(|k| (q[k] - q[k.saturating_sub(1)]) * rate);
                assert_eq!(
                    rate_zeros(&t, &q, &counted.collect::<Vec<_>>()),
                    None,
                    "{rate}"
                );
                // A rest of a second.
                let from = (8.0 * rate) as usize;
                let rest = from..from + rate as usize;
                let value = q[from];
                q[rest.clone()].fill(value);
                let by = q[rest.end] - value;
                q[rest.end..].iter_mut().for_each(|q| *q -= by);
                qd[rest].fill(0.0);
                assert_eq!(rate_zeros(&t, &q, &qd), None, "{rate}");
            }
        }
    }
}
