//! What became of the free runs of a model.

use serde::Serialize;

use super::halt::Cause;
use super::log::Log;

/// What became of the free runs of a model over recordings, each from the recorded start without a look at the measured motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum FreeRun {
    /// No simulated position was further from the recorded one than the joint travels in the recordings.
    Followed {
        /// RMS of simulated less recorded position, rad or m.
        rms: f64,
        /// Mean of its absolute value, rad or m.
        mean_absolute: f64,
        /// Largest absolute value, rad or m.
        max: f64,
    },
    /// A free run left the recorded motion or could not go on; its errors say nothing of the model.
    Diverged {
        /// The recording.
        recording: String,
        /// From which time of the recording, s.
        time: f64,
        /// Why, a clause.
        why: String,
    },
}

impl FreeRun {
    /// Of simulated less recorded positions.
    pub(super) fn followed(errors: &[f64]) -> Self {
        let rows = errors.len().max(1) as f64;
        Self::Followed {
            rms: (errors.iter().map(|e| e * e).sum::<f64>() / rows).sqrt(),
            mean_absolute: errors.iter().map(|e| e.abs()).sum::<f64>() / rows,
            max: errors.iter().fold(0.0, |m, e| m.max(e.abs())),
        }
    }

    /// Of a run over `recording` that ends at `time`, s.
    pub(super) fn diverged(recording: &str, time: f64, cause: Cause) -> Self {
        Self::Diverged {
            recording: recording.to_owned(),
            time,
            why: cause.clause().to_owned(),
        }
    }

    /// RMS of the position error, rad or m; none where a run diverged.
    pub fn rms(&self) -> Option<f64> {
        match self {
            Self::Followed { rms, .. } => Some(*rms),
            Self::Diverged { .. } => None,
        }
    }

    /// The same as a number for a table, which has no place for words: NaN where a run diverged.
    pub(super) fn number(&self) -> f64 {
        self.rms().unwrap_or(f64::NAN)
    }

    /// Returns true if the error is at most 1 + `share` times that of `other`; a run that diverged is worse than any other.
    pub(super) fn is_within(&self, share: f64, other: &Self) -> bool {
        match (self.rms(), other.rms()) {
            (Some(own), Some(other)) => own <= (1.0 + share) * other,
            (None, Some(_)) => false,
            (_, None) => true,
        }
    }
}

/// Largest distance between two positions of one recording, rad or m.
pub(super) fn travel(logs: &[Log]) -> f64 {
    let of = |log: &Log| {
        let fold = |pick: fn(f64, f64) -> f64, from| log.q.iter().copied().fold(from, pick);
        fold(f64::max, f64::NEG_INFINITY) - fold(f64::min, f64::INFINITY)
    };
    logs.iter().map(of).fold(0.0, f64::max)
}
