//! Results of free runs.

use serde::Serialize;

use crate::voltage::halt::Cause;
use crate::voltage::log::Log;
use rig_numerics::statistics;

/// Result of a model's free runs over recordings, each from the recorded start without using the measured motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum FreeRun {
    /// No position error exceeded the joint's travel in the recordings.
    Followed {
        /// RMS of simulated minus recorded position, rad or m.
        rms: f64,
        /// Mean of its absolute value, rad or m.
        mean_absolute: f64,
        /// Largest absolute value, rad or m.
        max: f64,
    },
    /// A free run left the recorded motion or could not continue; its errors do not judge the model.
    Diverged {
        /// The recording.
        recording: String,
        /// Start of the divergence in the recording, s.
        time: f64,
        /// Reason.
        why: Cause,
    },
}

impl FreeRun {
    /// Builds the result from simulated minus recorded positions.
    pub(crate) fn followed(errors: &[f64]) -> Self {
        let rows = errors.len().max(1) as f64;
        Self::Followed {
            rms: statistics::rms(errors),
            mean_absolute: errors.iter().map(|e| e.abs()).sum::<f64>() / rows,
            max: errors.iter().fold(0.0, |m, e| m.max(e.abs())),
        }
    }

    /// Builds the result of a run over `recording` that ends at `time`, s.
    pub(crate) fn diverged(recording: &str, time: f64, why: Cause) -> Self {
        Self::Diverged {
            recording: recording.to_owned(),
            time,
            why,
        }
    }

    /// Returns the RMS of the position error, rad or m; `None` if a run diverged.
    pub fn rms(&self) -> Option<f64> {
        match self {
            Self::Followed { rms, .. } => Some(*rms),
            Self::Diverged { .. } => None,
        }
    }

    /// Returns the same as a number for a table: NaN if a run diverged.
    pub(crate) fn number(&self) -> f64 {
        self.rms().unwrap_or(f64::NAN)
    }
}

/// Returns the largest travel in one recording, rad or m.
pub(crate) fn travel(logs: &[Log]) -> f64 {
    let of = |log: &Log| {
        let fold = |pick: fn(f64, f64) -> f64, from| log.q.iter().copied().fold(from, pick);
        fold(f64::max, f64::NEG_INFINITY) - fold(f64::min, f64::INFINITY)
    };
    logs.iter().map(of).fold(0.0, f64::max)
}
