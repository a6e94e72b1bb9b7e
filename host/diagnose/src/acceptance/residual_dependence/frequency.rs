//! Frequencies of the residual that repeats in every run of a motion, from the cross-spectrum of two runs (Welch 1967).
//! They show resonances and repeated slow drifts.
//!
//! Limit: the difference between runs is the noise floor; motions without a repeat have no such spectrum.

use std::f64::consts::PI;

use realfft::RealFftPlanner;

use crate::acceptance::residual_dependence::dependence::{Dependence, Form};
use crate::acceptance::residual_dependence::process::{BINS, Process, narrowest};
use crate::rows::regression::Rows;

/// Name of the coordinate.
const FREQUENCY: &str = "frequency";
/// Window length, s: a resolution of 0.25 Hz.
const WINDOW: f64 = 4.0;
/// Fewest windows.
const FEWEST: usize = 8;
/// Largest frequency as a share of the row rate: the passband of the low-pass before decimation.
const PASSED: f64 = 0.4;

/// Returns the common spectrum of two runs, per band and window. None without a pair, or if runs are too short.
pub(crate) fn frequency(
    rows: &Rows,
    residual: &[f64],
    pairs: &[(usize, usize)],
    joint_name: &str,
) -> Option<(Dependence, Process)> {
    let length = (WINDOW / rows.period).round() as usize;
    let highest = (PASSED * length as f64) as usize;
    if highest < 2 * BINS {
        return None;
    }
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let window: Vec<f64> = (0..length)
        .map(|k| 0.5 - 0.5 * (2.0 * PI * (k as f64 + 0.5) / length as f64).cos())
        .collect();
    let spectrum = |from: usize| {
        let mut input: Vec<f64> = (residual[from..from + length].iter().zip(&window))
            .map(|(r, w)| r * w)
            .collect();
        let mut output = fft.make_output_vec();
        // The lengths are those of the plan; another length is the only error of this call.
        fft.process(&mut input, &mut output).ok().map(|()| output)
    };
    // Bins of equal frequency ratio, from the first line.
    let edge = |b: usize| (highest as f64).powf(b as f64 / BINS as f64);
    let bin = |line: usize| {
        let share = (line as f64).ln() / (highest as f64).ln();
        ((share * BINS as f64) as usize).min(BINS - 1)
    };
    let mut sums = Vec::new();
    for &(a, b) in pairs {
        let both = [a, b].map(|run| rows.starts[run]..rows.starts[run + 1]);
        let shorter = both[0].len().min(both[1].len());
        for at in (0..=shorter.checked_sub(length)?).step_by(length) {
            let [x, y] = [spectrum(both[0].start + at)?, spectrum(both[1].start + at)?];
            let mut own = [0.0; BINS];
            for (line, (x, y)) in x.iter().zip(&y).enumerate().take(highest).skip(1) {
                own[bin(line)] += (x * y.conj()).re;
            }
            sums.push(own);
        }
    }
    if sums.len() < FEWEST {
        return None;
    }
    let common: [f64; BINS] =
        std::array::from_fn(|b| sums.iter().map(|s| s[b]).sum::<f64>().max(0.0));
    let all: f64 = common.iter().sum();
    let (low, high) = narrowest(&common, all);
    let share = common[low..=high].iter().sum::<f64>() / all.max(f64::MIN_POSITIVE);
    let interval = [low, high + 1].map(|b| edge(b) / WINDOW);
    let place = Dependence {
        joint: joint_name.to_owned(),
        coordinate: FREQUENCY.to_owned(),
        interval,
        unit: "Hz".to_owned(),
        share,
        p_value: 1.0,
        form: Form::Repeated,
    };
    let taken = Vec::new();
    Some((place, Process { sums, taken }))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::acceptance::residual_dependence::probabilities;

    /// Two runs of a minute at 100 rows/s, with a resonance at 7 Hz in both and independent noise.
    fn found(size: f64) -> (Dependence, f64) {
        const ROWS: usize = 12_000;
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let mut rows = Rows::of_columns(Vec::new(), ROWS);
        rows.starts = vec![0, ROWS / 2, ROWS];
        rows.period = 0.01;
        let residual: Vec<f64> = (0..ROWS)
            .map(|k| {
                let t = (k % (ROWS / 2)) as f64 * 0.01;
                let swells = 1.0 + (0.9 * t).sin();
                size * swells * (2.0 * PI * 7.0 * t).sin() + rng.random::<f64>() - 0.5
            })
            .collect();
        let (place, process) = frequency(&rows, &residual, &[(0, 1)], "link").unwrap();
        let p = probabilities(&[process], &[], 3)[0];
        (place, p)
    }

    #[test]
    fn a_resonance_in_both_runs_is_found_at_its_frequency() {
        let (place, p) = found(0.1);
        println!("{place:?} p = {p}");
        assert!(p < 0.01 && place.interval[0] < 7.0 && place.interval[1] > 7.0);
        assert!(
            place.interval[1] / place.interval[0] < 1.6,
            "{:?}",
            place.interval
        );
        let (_, chance) = found(0.0);
        assert!(chance > 0.05, "{chance}");
    }
}
