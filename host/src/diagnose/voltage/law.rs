//! The controller behind a voltage, read off the recording.
//!
//! A servo whose voltage follows its position error simulates as it moved: in the closed loop, where the model meets the
//! same reference. What the recorded voltage alone lets drift, the controller holds.
//!
//! Leaves out: integral action and feed-forward; such a controller is not recognised, and the recorded voltage drives.

use nalgebra::{Matrix2, Vector2};

use super::log::Log;

/// Share of the voltage's power that a law has to explain.
const EXPLAINED: f64 = 0.995;
/// Rows at least that it is judged by.
const FEWEST: usize = 100;
/// Share of the largest share of the supply from which on the bridge counts as at its limit.
const LIMIT: f64 = 0.995;
/// Rows at the limit from which on there is one.
const AT_LIMIT: usize = 10;

/// Share of the supply = proportional·(reference − q) − derivative·q̇, within ± `most`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Law {
    /// 1/rad or 1/m; V/rad or V/m where the supply was not recorded.
    pub proportional: f64,
    /// 1/(rad/s) or 1/(m/s), likewise.
    pub derivative: f64,
    /// Largest share.
    pub most: f64,
    /// The supply: at no load, V, and what it changes by up to a share of one.
    pub supply: [f64; 2],
}

impl Law {
    /// What the rows of a recording with the drive on and off its limit follow; none where they follow no such law.
    pub(super) fn of(log: &Log) -> Option<Self> {
        let rows = log.t.len();
        if log.reference.len() != rows || log.u.len() != rows {
            return None;
        }
        let share: Vec<f64> = (log.u.iter().zip(&log.supply))
            .map(|(u, supply)| u / supply)
            .collect();
        let on = || (0..rows).filter(|k| log.on[*k] && share[*k].is_finite());
        let largest = on().fold(0.0_f64, |m, k| m.max(share[k].abs()));
        let limited = |k: &usize| share[*k].abs() >= LIMIT * largest;
        let used: Vec<usize> = on().filter(|k| !limited(k)).collect();
        if used.len() < FEWEST {
            return None;
        }
        let mut normal = Matrix2::zeros();
        let mut right = Vector2::zeros();
        let mut power = 0.0;
        for &k in &used {
            let row = Vector2::new(log.reference[k] - log.q[k], -log.slope(k)[0]);
            normal += row * row.transpose();
            right += row * share[k];
            power += share[k] * share[k];
        }
        // Without velocity first: a proportional law has none.
        let alone = right[0] / normal[(0, 0)];
        let mut gains = Vector2::new(alone, 0.0);
        let explained = |g: &Vector2<f64>| (2.0 * g.dot(&right) - g.dot(&(normal * g))) / power;
        if !(explained(&gains) >= EXPLAINED) {
            gains = normal.lu().solve(&right)?;
        }
        if !(explained(&gains) >= EXPLAINED && gains[0] > 0.0 && gains[1] >= 0.0) {
            return None;
        }
        // A switching bridge makes the reading jump with the phase that it is caught at: what depends on the load is a line.
        let (mut sums, mut readings) = (Matrix2::zeros(), Vector2::zeros());
        for k in on() {
            let row = Vector2::new(1.0, share[k].abs());
            sums += row * row.transpose();
            readings += row * log.supply[k];
        }
        let line = sums.lu().solve(&readings);
        let supply = line.map_or([readings[0] / sums[(0, 0)], 0.0], |line| [line[0], line[1]]);
        let whole = log.supply.iter().any(|supply| *supply != 1.0);
        let most = if on().filter(limited).count() >= AT_LIMIT {
            largest
        } else if whole {
            largest.max(1.0)
        } else {
            f64::INFINITY
        };
        Some(Self {
            proportional: gains[0],
            derivative: gains[1],
            most,
            supply,
        })
    }

    /// Voltage at a reference and a state, V.
    pub(super) fn voltage(&self, reference: f64, q: f64, v: f64) -> f64 {
        let wish = self.proportional * (reference - q) - self.derivative * v;
        let share = wish.clamp(-self.most, self.most);
        share * (self.supply[0] + self.supply[1] * share.abs())
    }
}
