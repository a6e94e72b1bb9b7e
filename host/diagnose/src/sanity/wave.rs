//! The loudest wave of a torque over the turn of its motor: cogging, ripple, an eccentric gear.
//!
//! Leaves out: waves that the rows do not show, of which half or more passes between two of them at the speed that half of the rows
//! exceed; waves of less than a motor turn, or two in the whole motion, which gravity and springs are alike to.

use std::f64::consts::{PI, TAU};

use super::super::orders::{median, spectrum};

/// Waves in the whole range of the motion, at least.
const LEAST: f64 = 2.0;
/// Orders that are tried for each that the range tells from the next.
const FINER: f64 = 4.0;
/// Orders that are tried at most.
const MOST: usize = 4000;

/// The order of the loudest wave over the motor's `angle`, rad, in what is left of a torque, waves in a turn; none where the
/// rows can show none.
pub(super) fn loudest(angle: &[f64], residual: &[f64]) -> Option<f64> {
    let steps = angle.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let step = median(steps.collect())?;
    let ends = |[low, high]: [f64; 2], angle: &f64| [low.min(*angle), high.max(*angle)];
    let [low, high] = angle.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends);
    let turns = (high - low) / TAU;
    let least = f64::max(1.0, LEAST / turns);
    let each = f64::min(1.0, 1.0 / (FINER * turns));
    let tried = ((PI / step - least) / each).min(MOST as f64) as usize;
    // In units of the distance of two orders.
    let samples: Vec<(f64, f64)> = (angle.iter().zip(residual))
        .map(|(angle, left)| (each * angle, *left))
        .collect();
    let first = (least / each).ceil() as usize;
    let power = spectrum(&samples, first, first + tried);
    let best = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    (tried > 0).then_some(each * (first + best) as f64)
}
