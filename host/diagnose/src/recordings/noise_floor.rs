//! The noise floor: the part of the residual that no model of the motion can explain.

use crate::rows::regression::Rows;
use rig_data::prepare::Welch;
use rig_data::runs::{Differences, Run};
use rig_numerics::autocorrelation::correlation_time_to_zero;
use rig_numerics::statistics;

/// Share of the rows' band that the low-pass before decimation passes.
const PASSED: f64 = 0.8;
/// Samples per segment of a torque spectrum.
const SEGMENT: usize = 1024;
/// Parts of the noise band, equal in log frequency.
const BANDS: usize = 6;
/// Upper end of that band as a share of the sample rate: beyond it an anti-aliasing filter acts.
const TOP: f64 = 0.45;
/// Largest ratio of a part's density to the line of first-order noise. A median of some hundred averaged periodograms
/// varies by less than a tenth. A spectral line of a drive, or a tail of the motion, is off by more than half.
const OFF_LINE: f64 = 1.5;
/// Largest difference of the references (else positions) of two repeated runs, as a share of their spread.
const ALIKE: f64 = 0.02;
/// Largest difference of the torques of two runs driven alike, as a share of the torque.
const DRIVEN_ALIKE: f64 = 0.2;
/// Segment length for the comparison of two runs, s.
const STRETCH: f64 = 1.0;
/// Longest lag of a residual's autocorrelation, s.
const LONGEST_MEMORY: f64 = 2.0;

/// Returns pairs of runs that repeat one motion.
pub(crate) fn repeats(runs: &[Run]) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    for a in 0..runs.len() {
        for b in a + 1..runs.len() {
            let (a_run, b_run) = (&runs[a], &runs[b]);
            // An external load on one of them is no noise.
            let comparable =
                a_run.recording != b_run.recording && a_run.unburdened == b_run.unburdened;
            if comparable && alike(a_run, b_run) {
                pairs.push((a, b));
            }
        }
    }
    pairs
}

/// Returns a hold-out run that repeats the motion of a training run, and the latter.
pub(crate) fn repeated<'r>(training: &'r [Run], held: &'r [Run]) -> Option<(&'r Run, &'r Run)> {
    held.iter().find_map(|own| {
        let same = (training.iter()).find(|run| {
            run.unburdened == own.unburdened && alike(run, own) && driven_alike(run, own)
        })?;
        Some((own, same))
    })
}

/// Returns true if the torques of two runs of one motion differ little; an external push makes them differ.
fn driven_alike(a: &Run, b: &Run) -> bool {
    a.joints.iter().zip(&b.joints).all(|(a, b)| {
        let pairs = || a.tau.iter().zip(&b.tau);
        let whole: f64 = pairs().map(|(x, _)| x * x).sum();
        let apart: f64 = pairs().map(|(x, y)| (x - y).powi(2)).sum();
        apart <= DRIVEN_ALIKE * DRIVEN_ALIKE * whole
    })
}

fn alike(a: &Run, b: &Run) -> bool {
    let rows = a.len().min(b.len());
    if rows < 1000.min(a.len().max(b.len())) || a.len().abs_diff(b.len()) > rows / 10 {
        return false;
    }
    a.joints.iter().zip(&b.joints).all(|(a, b)| {
        let (x, y) = match (&a.reference, &b.reference) {
            (Some(x), Some(y)) => (x, y),
            _ => (&a.q, &b.q),
        };
        let spread = statistics::squares_about_mean(&x[..rows]);
        let apart: f64 = x[..rows]
            .iter()
            .zip(&y[..rows])
            .map(|(x, y)| (x - y).powi(2))
            .sum();
        apart <= ALIKE * ALIKE * spread
    })
}

/// Noise and residual of a joint in repeated runs of one motion.
#[derive(Clone, Copy)]
pub(crate) struct Repeated {
    /// RMS of their difference over √2: noise.
    pub(crate) noise: f64,
    /// RMS of the residual in the same rows.
    pub(crate) left: f64,
    /// Number of row pairs.
    pub(crate) rows: f64,
}

/// Returns noise and residual of a joint in repeated runs, with row weights if given. None without a repeat.
pub(crate) fn from_repeats(
    rows: &Rows,
    pairs: &[(usize, usize)],
    residual: &[f64],
    counts: Option<&[f64]>,
    joint: usize,
) -> Option<Repeated> {
    let (mut apart, mut squares, mut used) = (0.0, 0.0, 0.0);
    for &(a, b) in pairs {
        let (start_a, start_b) = (rows.starts[a], rows.starts[b]);
        let length = (rows.starts[a + 1] - start_a).min(rows.starts[b + 1] - start_b);
        for k in 0..length {
            let (i, j) = (start_a + k, start_b + k);
            if rows.keep[joint][i] && rows.keep[joint][j] {
                let counted = counts.map_or(1.0, |counts| counts[i] * counts[j]);
                apart += 0.5 * counted * (residual[i] - residual[j]).powi(2);
                squares += 0.5 * counted * (residual[i].powi(2) + residual[j].powi(2));
                used += counted;
            }
        }
    }
    (used > 0.0).then(|| Repeated {
        noise: (apart / used).sqrt(),
        left: (squares / used).sqrt(),
        rows: used,
    })
}

/// Returns the mean residual of a joint in run b minus that in run a, of one motion, and its standard deviation between
/// segments of 1 s. None with fewer than three segments.
pub(crate) fn between(
    rows: &Rows,
    (a, b): (usize, usize),
    residual: &[f64],
    joint: usize,
) -> Option<[f64; 2]> {
    let starts = [a, b].map(|run| rows.starts[run]);
    let length = (rows.starts[a + 1] - starts[0]).min(rows.starts[b + 1] - starts[1]);
    let stretch = ((STRETCH / rows.period).ceil() as usize).max(1);
    let means: Vec<f64> = (0..length)
        .step_by(stretch)
        .filter_map(|first| {
            let pairs = (first..(first + stretch).min(length)).map(|k| starts.map(|s| s + k));
            let used = pairs.filter(|row| row.iter().all(|k| rows.keep[joint][*k]));
            let (count, sum) = used.fold((0, 0.0), |(n, sum), [x, y]| {
                (n + 1, sum + residual[y] - residual[x])
            });
            (2 * count > stretch).then(|| sum / count as f64)
        })
        .collect();
    let [mean, variance] = statistics::mean_and_variance(&means)?;
    Some([mean, variance.sqrt()])
}

/// Returns the RMS of a joint's sample-to-sample torque noise on rows `period` s apart: a lower limit of the noise.
/// None if the noise is not white, because a filter acted before.
///
/// From third differences, where a smooth torque vanishes. They have 20 times the variance of white noise, second
/// differences 6 times.
pub(crate) fn sensor_noise(runs: &[Run], joint: usize, period: f64) -> Option<f64> {
    let mut all = Differences::default();
    for run in runs {
        let own = run.joints[joint].differences();
        all.second += own.second;
        all.third += own.third;
        all.count += own.count;
    }
    let rate = runs.first()?.rate;
    let passed = (PASSED / (period * rate)).min(1.0);
    all.white().map(|variance| (variance * passed).sqrt())
}

/// Returns the RMS of a torque's noise on rows `period` s apart, from its spectrum beyond the rows' band. None if that
/// band is narrower than an octave, or if its noise is neither white nor first-order low-passed.
///
/// Sensor noise behind such a filter is a first-order autoregression, with the density S₀/(1 + (f/f₁)²). The reciprocal
/// is a line over f², fitted to the medians of [`BANDS`] parts of the band. The corner f₁ must be beyond the rows'
/// band: below it the noise is not distinguishable from dry friction, which also falls with f².
pub(crate) fn beyond_band(runs: &[Run], joint: usize, period: f64) -> Option<f64> {
    let rate = runs.first()?.rate;
    let [low, high] = [0.5 / period, TOP * rate];
    if high < 2.0 * low {
        return None;
    }
    let mut welch = Welch::new(SEGMENT);
    for run in runs {
        welch.interrupt();
        run.joints[joint]
            .recorded()
            .iter()
            .for_each(|tau| welch.push(*tau));
    }
    let (frequency, density) = welch.density(rate)?;
    let edge = |k: usize| low * (high / low).powf(k as f64 / BANDS as f64);
    let bands: Vec<[f64; 2]> = (0..BANDS)
        .filter_map(|k| {
            let inside = |f: f64| edge(k) <= f && f < edge(k + 1);
            let own: Vec<f64> = (frequency.iter().zip(&density))
                .filter(|(f, _)| inside(**f))
                .map(|(_, density)| *density)
                .collect();
            let middle = statistics::median(own)?;
            Some([(edge(k) * edge(k + 1)).sqrt(), middle])
        })
        .collect();
    let [level, corner] = first_order(&bands)?;
    let passed = PASSED * low;
    // The integral of the density over the rows' band.
    let variance = match corner.is_finite() {
        true => level * corner * (passed / corner).atan(),
        false => level * passed,
    };
    (corner > low && variance > 0.0).then(|| variance.sqrt())
}

/// Fits first-order noise to points of frequency and density. Returns low-frequency density and corner, infinite for
/// white noise. None if a point is off by more than a factor [`OFF_LINE`].
fn first_order(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    // Reciprocal density times density is 1: each point has the same weight at any level.
    let mut normal = [[0.0; 2]; 2];
    let mut right = [0.0; 2];
    for [f, density] in points {
        let row = [*density, f * f * density];
        for a in 0..2 {
            right[a] += row[a];
            for b in 0..2 {
                normal[a][b] += row[a] * row[b];
            }
        }
    }
    let determinant = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
    let slope = (normal[0][0] * right[1] - normal[1][0] * right[0]) / determinant;
    let [constant, slope] = if slope > 0.0 {
        [(right[0] - normal[0][1] * slope) / normal[0][0], slope]
    } else {
        [right[0] / normal[0][0], 0.0]
    };
    let on_line = |[f, density]: &[f64; 2]| {
        let ratio = density * (constant + slope * f * f);
        (1.0 / OFF_LINE..OFF_LINE).contains(&ratio)
    };
    (points.len() == BANDS && constant > 0.0 && points.iter().all(on_line))
        .then(|| [1.0 / constant, (constant / slope).sqrt()])
}

/// Returns the standard deviation of a white-noise sample, if its RMS on rows `samples` samples apart is `noise`.
pub(crate) fn of_a_sample(noise: f64, samples: f64) -> f64 {
    noise * (samples / PASSED).max(1.0).sqrt()
}

/// Returns the correlation time of a joint's residual, s: the integral of its autocorrelation up to the first zero. The
/// longest of all joints.
pub(crate) fn memory(rows: &Rows, residuals: &[Vec<f64>]) -> f64 {
    let lags = ((LONGEST_MEMORY / rows.period).ceil() as usize).min(rows.count / 4);
    let of =
        |residual: &Vec<f64>| correlation_time_to_zero(residual, &rows.starts, lags) * rows.period;
    residuals.iter().map(of).fold(rows.period, f64::max)
}

/// Returns the noise floor of a joint's torque from its own reading, in the residual's rows.
pub(crate) fn of_torque(runs: &[Run], joint: usize, period: f64) -> Option<f64> {
    sensor_noise(runs, joint, period).or_else(|| beyond_band(runs, joint, period))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use rig_data::runs::JointRun;

    fn reading(tau: Vec<f64>) -> Option<f64> {
        let joint = JointRun {
            tau,
            ..JointRun::default()
        };
        let run = Run {
            rate: 1000.0,
            joints: vec![joint],
            ..Run::default()
        };
        sensor_noise(&[run], 0, 0.01)
    }

    #[test]
    fn a_reading_says_its_own_noise_unless_it_was_filtered() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(4);
        let smooth = |k: usize| 3.0 * (0.02 * k as f64).sin();
        // Uniform from −1 to 1: the variance is 1/3.
        let white: Vec<f64> = (0..20_000)
            .map(|k| smooth(k) + 2.0 * rng.random::<f64>() - 1.0)
            .collect();
        let expected = (PASSED / 10.0 / 3.0_f64).sqrt();
        let found = reading(white.clone()).unwrap_or(f64::NAN);
        assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
        let filtered = white.windows(4).map(|w| w.iter().sum::<f64>() / 4.0);
        assert_eq!(reading(filtered.collect()), None);
        assert_eq!(reading((0..20_000).map(smooth).collect()), None);
    }

    /// First-order noise beside a motion of 0.5 to 6 Hz with dry friction. Its spectrum beyond the rows' band gives its
    /// part below. With the corner inside the band it is not distinguishable from friction.
    #[test]
    fn noise_behind_a_filter_is_found_beyond_the_band() {
        let [rate, period, std] = [1000.0, 0.01, 0.2];
        let noise = |corner: f64| {
            let pole = (-2.0 * std::f64::consts::PI * corner / rate).exp();
            let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
            let mut state = 0.0;
            let own: Vec<f64> = (0..60_000)
                .map(|_| {
                    let white = std * 12.0_f64.sqrt() * (rng.random::<f64>() - 0.5);
                    state = pole * state + (1.0 - pole) * white;
                    state
                })
                .collect();
            own
        };
        let found = |corner: f64| {
            let tau = noise(corner).into_iter().enumerate().map(|(k, noise)| {
                let t = k as f64 / rate;
                let v = (3.1 * t).sin() + 0.4 * (37.0 * t).sin();
                2.0 * v + 0.1 * (20.0 * v).tanh() + noise
            });
            let joint = JointRun {
                tau: tau.collect(),
                ..JointRun::default()
            };
            let run = Run {
                rate,
                joints: vec![joint],
                ..Run::default()
            };
            beyond_band(&[run], 0, period)
        };
        // One-sided density of the white noise, passed in the rows' band.
        let passed = PASSED * 0.5 / period;
        let expected = |corner: f64| {
            let level = std * std / (0.5 * rate);
            (level * corner * (passed / corner).atan()).sqrt()
        };
        for corner in [80.0, 150.0] {
            let ratio = found(corner).unwrap_or(f64::NAN) / expected(corner);
            println!("{corner} Hz: {ratio}");
            assert!((ratio - 1.0).abs() < 0.15, "{corner}: {ratio}");
        }
        assert_eq!(found(5.0), None);
    }
}
