//! A bias that changes smoothly but not linearly, as that of a sensor that warms up: jumps and a linear drift approximate it.
//!
//! Three descriptions of the mean residuals by segment are compared by the information criterion of Schwarz (1978): jumps with
//! a linear drift, as they were selected; a quadratic; and an exponential, whose time constant is searched and common to
//! all channels.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use crate::settle::settled;
use crate::system::{Fit, Nuisance, Sensed};

/// Smallest and largest time constant over the length of the recording: a shorter one is over within two segments, a longer one
/// is a parabola.
const CONSTANTS: [f64; 2] = [0.1, 2.0];
/// Number of time constants tried, in equal ratios.
const STEPS: usize = 25;

/// A smooth course of the bias.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Curve {
    /// Time constant of the exponential, s; `None` if a parabola explains the bias as well.
    pub time_constant: Option<f64>,
    /// Change of each channel over the recording: fx fy fz (N) mx my mz (N·m), as read.
    pub change: [f64; 6],
}

/// Returns the smooth course of the bias of a recording if it explains the readings better than the jumps of the fit, with its
/// drift; `None` otherwise.
pub(crate) fn curve(sensed: &Sensed, fit: &Fit, recording: usize) -> Option<Curve> {
    let recorded = &sensed.recordings[recording];
    let own = |jump: &&crate::system::Jump| jump.recording == recording;
    let jumps: Vec<usize> = (fit.unknowns.jumps.iter().filter(own))
        .map(|jump| jump.segment)
        .collect();
    if recorded.poses || jumps.is_empty() {
        return None;
    }
    let mut unknowns = fit.unknowns.without(Nuisance::Drift);
    unknowns.jumps.retain(|jump| jump.recording != recording);
    let plain = settled(sensed, &fit.mounting, &unknowns);
    let stretches = sensed.mean_residuals(&plain);
    let (_, means) = stretches.iter().find(|(r, _)| *r == recording)?;
    // The fit with jumps leaves the segments beside them out: both descriptions are compared by the others.
    let kept: Vec<&(usize, [f64; 6])> = (means.iter())
        .filter(|(segment, _)| jumps.iter().all(|j| segment + 1 != *j && segment != j))
        .collect();
    let count = recorded.segments.len() as f64;
    let time: Vec<f64> = kept
        .iter()
        .map(|(s, _)| (*s as f64 + 0.5) / count)
        .collect();
    let readings: [DVector<f64>; 6] =
        std::array::from_fn(|c| DVector::from_iterator(kept.len(), kept.iter().map(|m| m.1[c])));
    let line = |t: f64| vec![1.0, t];
    let score = |row: &dyn Fn(usize) -> Vec<f64>, more: f64| score(&readings, row, more);
    let steps = score(
        &|i| {
            let after = jumps.iter().map(|j| f64::from(u8::from(kept[i].0 >= *j)));
            line(time[i]).into_iter().chain(after).collect()
        },
        jumps.len() as f64,
    )?;
    let parabola = score(&|i| vec![1.0, time[i], time[i] * time[i]], 0.0)?;
    let [low, high] = CONSTANTS;
    let exponential = (0..STEPS)
        .map(|k| low * (high / low).powf(k as f64 / (STEPS - 1) as f64))
        .filter_map(|constant| {
            let bend = |t: f64| (-t / constant).exp();
            Some((score(&|i| vec![1.0, bend(time[i])], 1.0)?, constant))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    if steps <= parabola.min(exponential.0) {
        return None;
    }
    let is_exponential = exponential.0 < parabola;
    let shape = |t: f64| match is_exponential {
        true => vec![1.0, (-t / exponential.1).exp()],
        false => vec![1.0, t, t * t],
    };
    let change: [f64; 6] = std::array::from_fn(|channel| {
        let x = matrix(kept.len(), &|i| shape(time[i]));
        let found = fitted(&x, &readings[channel]);
        let at = |t: f64| -> f64 { shape(t).iter().zip(found.iter()).map(|(a, b)| a * b).sum() };
        at(1.0) - at(0.0)
    });
    Some(Curve {
        time_constant: is_exponential.then_some(exponential.1 * recorded.length),
        change: sensed.as_read(fit, &change),
    })
}

fn matrix(rows: usize, row: &dyn Fn(usize) -> Vec<f64>) -> DMatrix<f64> {
    let all: Vec<Vec<f64>> = (0..rows).map(row).collect();
    let columns = all.first().map_or(0, Vec::len);
    DMatrix::from_fn(rows, columns, |r, c| all[r][c])
}

fn fitted(x: &DMatrix<f64>, y: &DVector<f64>) -> DVector<f64> {
    Svd::of(x.clone()).solve(y, 1e-10)
}

/// Returns the criterion of a description of all channels with these columns and `more` unknowns that all channels share; `None`
/// for too few segments.
fn score(readings: &[DVector<f64>; 6], row: &dyn Fn(usize) -> Vec<f64>, more: f64) -> Option<f64> {
    let rows = readings[0].len();
    let x = matrix(rows, row);
    if rows <= x.ncols() {
        return None;
    }
    let (count, mut sum) = (rows as f64, 0.0);
    for y in readings {
        let left = (y - &x * fitted(&x, y)).norm_squared();
        sum += count * (left / count).max(f64::MIN_POSITIVE).ln();
    }
    Some(sum + (6.0 * x.ncols() as f64 + more) * (6.0 * count).ln())
}
