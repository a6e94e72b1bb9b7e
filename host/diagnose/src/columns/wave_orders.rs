//! Wave orders beyond those that are searched one by one, from the torque spectrum over the position.
//!
//! A motor behind a gear of unknown ratio makes hundreds or thousands of waves per joint turn. The spectrum is taken
//! over position, not time: at varying speed a wave has no fixed frequency.
//!
//! Leaves out: waves that advance by more than half between two samples at the median speed; amplitudes, which a later
//! joint fit gives.

use std::f64::consts::{LN_2, PI, TAU};

use rig_data::runs::Run;
use rig_numerics::statistics;

/// Most samples in the spectrum; it then takes a tenth of a second.
const MOST_SAMPLES: usize = 20_000;
/// Highest order, waves per turn.
const HIGHEST: usize = 4000;
/// Most orders that are returned, largest first.
const MOST_ORDERS: usize = 12;
/// Share of the median speed below which a sample is at rest and shows no wave.
const AT_REST: f64 = 0.1;
/// Negative natural logarithm of the probability that white noise causes the largest of all orders.
const BEYOND_CHANCE: f64 = 7.0;

/// Significant orders of a joint.
#[derive(Clone, Debug, Default)]
pub(crate) struct Orders {
    /// Waves per motor turn, whole numbers, largest first.
    pub(crate) loud: Vec<f64>,
    /// Number of tested orders.
    pub(crate) scanned: usize,
}

/// A sample of a moving joint: angle in rad and torque minus its slow part.
type Sample = (f64, f64);

impl Orders {
    /// Finds orders above `beyond`; the joint's motor turns `ratio` times as far as the joint.
    pub(crate) fn of(runs: &[Run], joint: usize, ratio: f64, beyond: usize) -> Self {
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
            // The length of the longest wave.
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
            // Over part of a turn neighbouring orders are similar.
            loud: peaks(&power, (2.0 * TAU / (high - low)).ceil().max(1.0) as usize)
                .into_iter()
                .map(|k| (beyond + 1 + k) as f64)
                .collect(),
            scanned: power.len(),
        }
    }
}

/// Returns the median speed of a joint; `None` if it stands.
fn median_speed(runs: &[Run], joint: usize) -> Option<f64> {
    let speeds = (runs.iter()).flat_map(|run| run.joints[joint].qd.iter().map(|v| v.abs()));
    positive_median(speeds.collect())
}

/// Returns the median; `None` if it is not positive, and for fewer than two values.
pub(crate) fn positive_median(values: Vec<f64>) -> Option<f64> {
    let several = (values.len() > 1).then_some(values)?;
    statistics::median(several).filter(|value| *value > 0.0)
}

/// Returns samples of a run above a speed, with the torque minus its mean over a window.
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

/// Returns the power of the orders from `first` to `last` in samples.
pub(crate) fn spectrum(samples: &[Sample], first: usize, last: usize) -> Vec<f64> {
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

/// Returns the places of maxima above white noise, largest first, at least `apart` from each other.
fn peaks(power: &[f64], apart: usize) -> Vec<usize> {
    // Powers of white noise are exponentially distributed.
    let mean = statistics::median(power.to_vec()).map_or(0.0, |m| m / LN_2);
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
