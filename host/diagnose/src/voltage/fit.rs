//! Fits of a voltage-driven joint to its simulated motion: Levenberg–Marquardt within bounds.
//!
//! Slopes are differences, because sticking and slipping change with the parameters.
//! Fits start with short windows (Bock 1983), each from the recorded state, so that no motion diverges. Whole
//! recordings follow.

use rig_shared::effects::Kind;

use crate::voltage::halt::Halt;
use crate::voltage::log::{Log, Segment};
use crate::voltage::plant::Plant;
use rig_numerics::optimise::levenberg_marquardt::{LeastSquares, Settings};
use rig_numerics::statistics;

/// Length of the windows that a fit begins with, s.
pub(crate) const WINDOW: f64 = 1.0;
/// Settings of a fit. The differences are far above rounding and smaller than the width of any law.
const SETTINGS: Settings = Settings {
    difference: 1.0e-3,
    steps: 40,
    first_steps: 6,
    settled: 1.0e-4,
    stiffest: 1.0e8,
};

/// Inputs of a fit.
pub(crate) struct Problem<'a> {
    pub plant: &'a Plant,
    pub logs: &'a [Log],
    /// Index of a log, and its rows.
    pub segments: Vec<(usize, Segment)>,
    pub effects: &'a [Kind],
    /// Fitted parameters.
    pub free: &'a [usize],
    /// Bounds of all parameters.
    pub bounds: &'a [[f64; 2]],
}

/// Returns the segments of the logs in `which`, in windows of `length` seconds.
pub(crate) fn segments(
    logs: &[Log],
    which: impl Fn(usize) -> bool,
    length: f64,
) -> Vec<(usize, Segment)> {
    (0..logs.len())
        .filter(|k| which(*k))
        .flat_map(|k| logs[k].windows(length).into_iter().map(move |s| (k, s)))
        .collect()
}

impl Problem<'_> {
    /// Returns simulated minus recorded position, row by row.
    ///
    /// # Errors
    /// [`Halt`] if the simulation is not possible.
    pub(crate) fn residual(&self, theta: &[f64]) -> Result<Vec<f64>, Halt> {
        let rows = self.segments.iter().map(|(_, s)| s.to - s.from).sum();
        let mut out = Vec::with_capacity(rows);
        for (k, segment) in &self.segments {
            let log = &self.logs[*k];
            let start = out.len();
            (self.plant).simulate(self.effects, theta, log, segment, &mut out)?;
            for (simulated, recorded) in out[start..].iter_mut().zip(&log.q[segment.from..]) {
                *simulated -= recorded;
            }
        }
        Ok(out)
    }

    /// Returns the RMS of [`Self::residual`]; infinite if it fails.
    pub(crate) fn rms(&self, theta: &[f64]) -> f64 {
        self.residual(theta)
            .map_or(f64::INFINITY, |r| statistics::rms(&r))
    }

    fn least_squares(&self) -> LeastSquares<'_, impl Fn(&[f64]) -> Option<Vec<f64>>> {
        LeastSquares {
            residual: |theta: &[f64]| self.residual(theta).ok(),
            free: self.free,
            bounds: self.bounds,
            settings: SETTINGS,
        }
    }

    /// Returns the parameters of least squares near the best of `starts`; that start itself if nothing is better.
    pub(crate) fn fit(&self, starts: &[&[f64]]) -> Vec<f64> {
        self.least_squares().fit(starts)
    }

    /// Returns the free parameters' standard deviations, with segments as independent blocks (sandwich, White 1982).
    pub(crate) fn deviations(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let rows = self.segments.iter().map(|(_, s)| s.to - s.from);
        self.least_squares().deviations(theta, rows)
    }
}
