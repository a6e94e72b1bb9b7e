//! Reference motions of the rig, drawn at random: sums of sines, slow ramps with reversals, and chirps.

use std::f64::consts::{PI, TAU};

use super::dice::Dice;

/// Reference samples and control steps per second.
pub(super) const RATE: f64 = 1000.0;
/// Largest angle from the hanging position, rad.
const REACH: f64 = 1.5;
/// Largest speed, rad/s, and acceleration, rad/s².
const SPEED: f64 = 5.0;
const ACCELERATION: f64 = 18.0;
/// Acceleration between two speeds of a ramp, rad/s².
const RAMP_ACCELERATION: f64 = 4.0;
/// Time of the return from any position to rest at the middle, s.
const RETURN: f64 = 1.5;

/// Kind of excitation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Excitation {
    /// 50 % of the time sums of sines, 30 % ramps at 0.02 to 1 rad/s, 20 % chirps from 0.3 to 3 Hz.
    #[default]
    Full,
    /// One slow sine of a third of a radian: no slow ramps, no high speed, little change of load.
    Poor,
}

/// Returns the reference position, sampled at [`RATE`], which starts and ends at rest at 0.
pub(super) fn reference(excitation: Excitation, seconds: f64, seed: u64, purpose: u64) -> Vec<f64> {
    let mut dice = Dice::new(seed, purpose);
    let samples = (seconds * RATE).round() as usize;
    let mut q = Vec::with_capacity(samples + 2000);
    match excitation {
        Excitation::Poor => {
            let rate = dice.uniform(0.4, 0.6) * TAU;
            let part = tapered(seconds, |t| 0.33 * (rate * t).sin());
            q.extend(part);
        }
        Excitation::Full => {
            // Two parts of each longer kind, in random order, so that all kinds occur both cold and warm.
            let mut parts = [0, 0, 1, 1, 2];
            for k in (1..parts.len()).rev() {
                parts.swap(k, dice.index(k + 1));
            }
            for part in parts {
                match part {
                    0 => q.extend(multisine(&mut dice, 0.25 * seconds)),
                    1 => q.extend(ramps(&mut dice, 0.15 * seconds)),
                    _ => q.extend(chirp(&mut dice, 0.2 * seconds)),
                }
            }
        }
    }
    q.resize(samples, 0.0);
    q
}

/// Samples `law` over `seconds` and fades it in and out within one second.
fn tapered(seconds: f64, law: impl Fn(f64) -> f64) -> Vec<f64> {
    let samples = (seconds * RATE).round() as usize;
    (0..samples)
        .map(|k| {
            let t = k as f64 / RATE;
            let edge = t.min(seconds - t).clamp(0.0, 1.0);
            (0.5 * PI * edge).sin().powi(2) * law(t)
        })
        .collect()
}

/// Scales a curve to the limits of reach, speed and acceleration.
fn within(mut q: Vec<f64>, reach: f64) -> Vec<f64> {
    let peak = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |m: f64, x| m.max(x.abs()));
    let position = peak(&mut q.iter().copied());
    let speed = peak(&mut q.windows(2).map(|w| (w[1] - w[0]) * RATE));
    let acceleration = peak(
        &mut q
            .windows(3)
            .map(|w| (w[2] - 2.0 * w[1] + w[0]) * RATE * RATE),
    );
    if position > 0.0 {
        let scale = (reach / position)
            .min(SPEED / speed)
            .min(ACCELERATION / acceleration);
        q.iter_mut().for_each(|x| *x *= scale);
    }
    q
}

fn multisine(dice: &mut Dice, seconds: f64) -> Vec<f64> {
    let sines: Vec<[f64; 3]> = (0..7)
        .map(|_| {
            let frequency = dice.log_uniform([0.08, 2.0]);
            let amplitude = dice.uniform(0.3, 1.0) / (0.3 + frequency);
            [amplitude, TAU * frequency, dice.phase()]
        })
        .collect();
    let reach = dice.uniform(0.6, 1.0) * REACH;
    let sum = |t: f64| {
        let parts = sines.iter().map(|[a, w, phase]| a * (w * t + phase).sin());
        parts.sum()
    };
    within(tapered(seconds, sum), reach)
}

/// Constant speeds in both directions, then a return to the middle.
fn ramps(dice: &mut Dice, seconds: f64) -> Vec<f64> {
    let samples = ((seconds - RETURN) * RATE).round().max(0.0) as usize;
    let mut q = Vec::with_capacity(samples + (RETURN * RATE) as usize);
    let (mut position, mut speed) = (0.0_f64, 0.0_f64);
    let (mut target, mut left) = (0.0_f64, 0_usize);
    let mut direction = dice.sign();
    for _ in 0..samples {
        if left == 0 {
            direction = -direction;
            target = direction * dice.log_uniform([0.02, 1.0]);
            left = (dice.uniform(0.5, 2.5) * RATE) as usize;
        }
        // Reverse before the end of the range.
        let stopping = 0.5 * speed * speed / RAMP_ACCELERATION;
        if (position + stopping * speed.signum()).abs() > REACH - 0.1 && position * target > 0.0 {
            direction = -direction;
            target = -target;
        }
        let step = RAMP_ACCELERATION / RATE;
        speed += (target - speed).clamp(-step, step);
        position += speed / RATE;
        left -= 1;
        q.push(position);
    }
    // Quintic polynomial from the present position and speed to rest at the middle.
    let [p, v] = [position, speed * RETURN];
    for k in 1..=(RETURN * RATE) as usize {
        let s = k as f64 / (RETURN * RATE);
        let c3 = -10.0 * p - 6.0 * v;
        let c4 = 15.0 * p + 8.0 * v;
        let c5 = -6.0 * p - 3.0 * v;
        q.push(p + s * v + s.powi(3) * (c3 + s * (c4 + s * c5)));
    }
    q
}

/// Exponential sweep about a random angle; the acceleration limit bounds its amplitude.
fn chirp(dice: &mut Dice, seconds: f64) -> Vec<f64> {
    let (low, high) = (0.3_f64, 3.0_f64);
    let growth = (high / low).ln() / seconds;
    let amplitude = dice.uniform(0.3, 0.8);
    let middle = dice.sign() * dice.uniform(0.0, 0.6);
    let sweep = |t: f64| {
        let frequency = low * (growth * t).exp();
        let widest = 0.8 * ACCELERATION / (TAU * frequency).powi(2);
        let phase = TAU * (frequency - low) / growth;
        middle + amplitude.min(widest) * phase.sin()
    };
    within(tapered(seconds, sweep), REACH)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_stay_within_their_limits_and_differ_with_the_seed() {
        for seed in 0..20 {
            let q = reference(Excitation::Full, 90.0, seed, 2);
            assert_eq!(q.len(), 90_000);
            let speed: Vec<f64> = q.windows(2).map(|w| (w[1] - w[0]) * RATE).collect();
            let highest = speed.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let jump = speed
                .windows(2)
                .map(|w| (w[1] - w[0]).abs() * RATE)
                .fold(0.0, f64::max);
            assert!(q.iter().all(|x| x.abs() <= REACH + 1e-9), "seed {seed}");
            assert!(
                highest <= SPEED && jump < 2.0 * ACCELERATION,
                "{highest} {jump}"
            );
            assert!(q[0].abs() < 1e-4 && q[q.len() - 1].abs() < 1e-4);
            // The motion must contain slow constant speeds and reversals.
            let slow = speed.iter().filter(|v| (0.02..0.3).contains(&v.abs()));
            assert!(slow.count() > 5_000, "seed {seed}");
            let turns = speed.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
            assert!(turns > 40, "seed {seed}: {turns}");
        }
        let [a, b] = [1, 2].map(|seed| reference(Excitation::Full, 30.0, seed, 2));
        assert_ne!(a, b);
    }
}
