//! Largest wave of a torque over the motor's turn, by cogging, ripple or an eccentric gear.
//!
//! Leaves out: waves that advance by half or more between two rows at the median speed; waves of less than one per
//! motor turn, or two in the whole motion, which resemble gravity and springs.

use std::f64::consts::{PI, TAU};

use crate::columns::wave_orders::{positive_median, spectrum};

/// Least number of waves in the whole range of the motion.
const LEAST: f64 = 2.0;
/// Tried orders for each order that the range resolves.
const FINER: f64 = 4.0;
/// Most tried orders.
const MOST: usize = 4000;

/// Returns the order of the largest wave over the motor's `angle`, rad, in a torque residual, waves per turn; `None` if
/// the rows can show none.
pub(crate) fn loudest(angle: &[f64], residual: &[f64]) -> Option<f64> {
    let steps = angle.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let step = positive_median(steps.collect())?;
    let ends = |[low, high]: [f64; 2], angle: &f64| [low.min(*angle), high.max(*angle)];
    let [low, high] = angle.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends);
    let turns = (high - low) / TAU;
    let least = f64::max(1.0, LEAST / turns);
    let each = f64::min(1.0, 1.0 / (FINER * turns));
    let tried = ((PI / step - least) / each).min(MOST as f64) as usize;
    // In units of the distance between orders.
    let samples: Vec<(f64, f64)> = (angle.iter().zip(residual))
        .map(|(angle, left)| (each * angle, *left))
        .collect();
    let first = (least / each).ceil() as usize;
    let power = spectrum(&samples, first, first + tried);
    let best = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    (tried > 0).then_some(each * (first + best) as f64)
}
