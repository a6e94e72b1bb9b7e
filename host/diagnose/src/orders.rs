//! Orders of waves beyond those that are looked for one by one: read from the spectrum of the torque along the position.
//!
//! A motor behind a gear whose ratio nobody states makes hundreds or thousands of waves in a turn of the joint. The spectrum is taken
//! over the position, not over time: at a speed that varies a wave of the position has no frequency.
//!
//! Leaves out: waves of which more than half passes between two samples at the speed that half of the rows exceed; amplitudes,
//! which the fit beside all else gives.

use std::f64::consts::{LN_2, PI, TAU};

use rig_data::runs::Run;

/// Most samples of the recordings that the spectrum is taken of: it then costs a tenth of a second.
const MOST_SAMPLES: usize = 20_000;
/// Highest order that is looked for, waves in a turn of the angle.
const HIGHEST: usize = 4000;
/// Most orders that are given, the loudest first.
const MOST_ORDERS: usize = 12;
/// Share of the median speed below which a sample tells nothing of a wave: it is at rest.
const AT_REST: f64 = 0.1;
/// Natural logarithm of one over the probability that the loudest of all orders is as loud by chance, in white noise.
const BEYOND_CHANCE: f64 = 7.0;

/// Orders of a joint that stand out.
#[derive(Clone, Debug, Default)]
pub(super) struct Orders {
    /// Waves in a turn of the motor, whole numbers, loudest first.
    pub(super) loud: Vec<f64>,
    /// How many were looked at.
    pub(super) scanned: usize,
}

/// A sample of a joint that moves: the angle in rad and the torque less what is slow.
type Sample = (f64, f64);

impl Orders {
    /// Those above `beyond` of a joint whose motor turns `ratio` times as far as it does.
    pub(super) fn of(runs: &[Run], joint: usize, ratio: f64, beyond: usize) -> Self {
        let Some(speed) = median_speed(runs, joint) else {
            return Self::default();
        };
        let per_sample = |run: &Run| ratio.abs() * speed / run.rate;
        let fastest = runs.iter().map(per_sample).fold(0.0, f64::max);
        let most = ((PI / fastest) as usize).min(HIGHEST);
        if most <= beyond {
            return Self::default();
        }
        let mut samples: Vec<Sample> = Vec::new();
        for run in runs {
            // As long as the longest of the waves.
            let window = (TAU / (per_sample(run) * beyond as f64)).ceil() as usize;
            samples.extend(moving(run, joint, ratio, AT_REST * speed, window));
        }
        samples.truncate(MOST_SAMPLES);
        let angles = samples.iter().map(|(angle, _)| *angle);
        let [low, high] = angles.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], angle| {
            [low.min(angle), high.max(angle)]
        });
        let power = spectrum(&samples, beyond + 1, most);
        Self {
            // Over a part of a turn neighbouring orders are alike.
            loud: peaks(&power, (2.0 * TAU / (high - low)).ceil().max(1.0) as usize)
                .into_iter()
                .map(|k| (beyond + 1 + k) as f64)
                .collect(),
            scanned: power.len(),
        }
    }
}

/// The speed that half of the samples of a joint exceed; none where it stands.
fn median_speed(runs: &[Run], joint: usize) -> Option<f64> {
    let speeds = (runs.iter()).flat_map(|run| run.joints[joint].qd.iter().map(|v| v.abs()));
    median(speeds.collect())
}

/// What half of the values exceed; none where that is nothing.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (values.len() > 1)
        .then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
        .filter(|value| *value > 0.0)
}

/// Samples of a run at more than a speed, the torque less its mean over a window.
fn moving(run: &Run, joint: usize, ratio: f64, least: f64, window: usize) -> Vec<Sample> {
    let own = &run.joints[joint];
    let torque = own.recorded();
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for x in torque.iter() {
        sum += x;
        sums.push(sum);
    }
    let half = window / 2 + 1;
    (0..torque.len())
        .filter(|k| own.qd[*k].abs() > least)
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(torque.len()));
            let mean = (sums[to] - sums[from]) / (to - from) as f64;
            (ratio * own.q_raw[k], torque[k] - mean)
        })
        .collect()
}

/// Power of the orders from `first` to `last` in samples.
pub(super) fn spectrum(samples: &[Sample], first: usize, last: usize) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; last + 1 - first];
    for (angle, torque) in samples {
        let (sine, cosine) = angle.sin_cos();
        let (mut b, mut a) = (first as f64 * angle).sin_cos();
        for sum in &mut sums {
            sum[0] += torque * a;
            sum[1] += torque * b;
            (a, b) = (a * cosine - b * sine, a * sine + b * cosine);
        }
    }
    sums.iter().map(|[a, b]| a * a + b * b).collect()
}

/// Places of the maxima that no noise makes, loudest first, at least `apart` from each other.
fn peaks(power: &[f64], apart: usize) -> Vec<usize> {
    let mut sorted = power.to_vec();
    sorted.sort_by(f64::total_cmp);
    // Powers of white noise are exponentially distributed.
    let mean = sorted.get(sorted.len() / 2).map_or(0.0, |m| m / LN_2);
    let least = mean * ((power.len() as f64).ln() + BEYOND_CHANCE);
    let mut order: Vec<usize> = (0..power.len()).filter(|k| power[*k] > least).collect();
    order.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    let mut found: Vec<usize> = Vec::new();
    for k in order {
        if found.len() < MOST_ORDERS && found.iter().all(|f| f.abs_diff(k) >= apart) {
            found.push(k);
        }
    }
    found
}

#[cfg(test)]
mod tests;
