//! Preprocessing plan of the recordings, decided once and recorded.

use rig_model::robot::IdentifiedBand;
use serde::Serialize;

use super::error::PrepareError;
use super::filter::{LowPass, decimator_edge};
use super::rate::{parallel_pass, same_rate, trimmed_rows};
use super::spectrum::{NOISE_SHARE, PositionSpectrum};
use super::survey::Survey;
use rig_output::format_short;

/// A setting that is chosen from the data or given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Choice<T> {
    /// Chosen from the data.
    #[default]
    Auto,
    /// Given.
    Fixed(T),
}

/// How recordings are to be prepared.
#[derive(Clone, Debug, PartialEq)]
pub struct PrepareOptions {
    /// Cut-off of the low-pass on the position, Hz (half power after one of its two passes).
    pub cutoff: Choice<f64>,
    /// Order of the Butterworth filter, run forward and backward.
    pub order: usize,
    /// Decimation after the parallel low-pass: one row in this number is kept.
    pub decimation: Choice<usize>,
    /// Speed below which a row is masked, rad/s or m/s, the same for all joints; 0 masks nothing.
    pub speed_threshold: Choice<f64>,
    /// Time before and after each row below the speed threshold in which rows of the differential model are left out, too, s.
    /// A joint that sticks at a reversal has friction between its two signs, and the low-pass spreads this error over its
    /// memory.
    pub reversal_margin: f64,
    /// Uses the recording's own velocity and acceleration instead of differentiating the position.
    pub measured_derivatives: bool,
    /// Torque lead, s: time from the recorded instant of a torque to its action. A command that is held until the next
    /// one has half a sample, plus dead time. The motion is shifted by the same time. At zero, an actual lead L shifts
    /// viscous friction by about −J·L·ω² for a motion of angular frequency ω.
    pub torque_lead: f64,
    /// Rows processed together. Memory grows with it; results do not depend on it.
    pub piece_rows: usize,
    /// Number of threads; 0 uses all processors. Results are identical to the last bit.
    pub threads: usize,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self {
            cutoff: Choice::Auto,
            order: 4,
            decimation: Choice::Auto,
            speed_threshold: Choice::Auto,
            reversal_margin: 0.0,
            measured_derivatives: false,
            torque_lead: 0.0,
            piece_rows: 1 << 16,
            threads: 0,
        }
    }
}

/// Rows left out, and the reason.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Masked {
    /// Number of the joint, from 1; 0 for all joints.
    pub joint: usize,
    /// Number of rows (after decimation), or of windows of the integral model.
    pub rows: u64,
    /// The reason.
    pub why: String,
}

/// Preprocessing of every recording of an identification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PreprocessingPlan {
    /// Hz
    pub sample_rate: f64,
    /// Cut-off of the position filter, Hz.
    pub cutoff: f64,
    /// Reason for this cut-off, a sentence.
    pub cutoff_reason: String,
    /// Cut-offs that were tried on the torque, lowest first; empty if none was tried.
    pub trials: Vec<CutoffTrial>,
    /// Cut-off from the spectrum of the position alone, if the torque led to a different one, Hz.
    pub spectral_cutoff: Option<f64>,
    /// Order of the Butterworth filter, forward and backward.
    pub order: usize,
    /// Decimation: one row in this number is kept.
    pub decimation: usize,
    /// Reason for this decimation, a sentence.
    pub decimation_reason: String,
    /// Pass band of the parallel low-pass over torque and regressor, Hz.
    pub parallel_edge: f64,
    /// Description of the parallel low-pass, a sentence.
    pub parallel_filter: String,
    /// Source of velocity and acceleration, a sentence.
    pub derivatives: String,
    /// True if the recording's own velocity and acceleration are used.
    pub measured_derivatives: bool,
    /// Torque lead, s: assumed time from the recorded instant of a torque to its action.
    pub torque_lead: f64,
    /// Per joint, speed below which rows are masked, rad/s or m/s.
    pub speed_threshold: Vec<f64>,
    /// The same for judging values on recordings that they were not fitted to; never higher. Rows that are left out of
    /// a fit because they bias it still show how good it is.
    pub judged_speed: Vec<f64>,
    /// Time before and after each slower row in which rows of the differential model are left out, too, s.
    #[serde(skip_serializing_if = "is_zero")]
    pub reversal_margin: f64,
    /// Reason for these thresholds, a sentence.
    pub speed_reason: String,
    /// Per joint, torques beyond which rows count as saturated (lowest, highest).
    pub saturation: Vec<[Option<f64>; 2]>,
    /// Rows left out at both ends of every stretch, before decimation.
    pub trimmed: usize,
    /// Per joint, the spectrum of the position from which the cut-off was determined.
    pub spectra: Vec<PositionSpectrum>,
    /// Highest frequency of the motion over all joints, Hz (99 % of the power of the velocity).
    pub motion_frequency: f64,
    /// Number of rows in one piece.
    #[serde(skip)]
    pub piece_rows: usize,
    /// Number of threads; 0 uses all processors.
    #[serde(skip)]
    pub threads: usize,
}

/// Lowest cut-off as a multiple of the highest frequency of the motion. A lower one would distort the motion itself.
const MIN_HEADROOM: f64 = 5.0;

/// Pass band of the parallel low-pass as a multiple of the highest frequency of the motion. Reversals of friction have
/// harmonics well above the motion, and the residual must show them.
const PARALLEL_HEADROOM: f64 = 10.0;

/// Highest cut-off as a share of the Nyquist frequency.
pub const MAX_CUTOFF_SHARE: f64 = 0.8;

/// Speed below which a joint stands still, rad/s or m/s: above the rounding error, below the resolution of any encoder.
const STANDSTILL_SPEED: f64 = 1e-6;

/// A cut-off that was tried, and the torque error with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CutoffTrial {
    /// Hz
    pub cutoff: f64,
    /// Per joint, RMS of the torque residual over RMS of the torque; NaN if no row of the joint was usable.
    pub relative_error: Vec<f64>,
}

impl PreprocessingPlan {
    /// Returns the band for the description, in which the identified values are judged.
    #[must_use]
    pub fn band(&self) -> IdentifiedBand {
        IdentifiedBand {
            cutoff: self.cutoff,
            rate: self.kept_rate(),
            min_speed: self.judged_speed.clone(),
            torque_lead: self.torque_lead,
        }
    }

    /// Decides the treatment from the surveys of all training recordings and the robot's torque limits.
    ///
    /// # Errors
    /// [`PrepareError`]: different rates, impossible cut-off or decimation.
    pub fn decide(
        surveys: &[Survey],
        options: &PrepareOptions,
        torque_limits: &[Option<f64>],
    ) -> Result<Self, PrepareError> {
        let first = surveys
            .first()
            .ok_or_else(|| PrepareError::Stopped("No recording was given.".into()))?;
        let rate = first.sample_rate;
        for survey in surveys {
            same_rate(survey, rate)?;
        }
        let spectra = spectra_of(surveys, first);
        let motion = spectra.iter().map(|s| s.motion).fold(0.0, f64::max);
        let nyquist = rate / 2.0;
        let (cutoff, cutoff_reason) = match options.cutoff {
            Choice::Fixed(hz) => (hz, format!("{} Hz, as given.", format_short(hz))),
            Choice::Auto => choose_cutoff(&spectra, motion, nyquist),
        };
        if LowPass::butterworth(options.order, cutoff, rate).is_none() {
            return Err(PrepareError::Cutoff {
                cutoff,
                rate,
                nyquist,
            });
        }
        let shortest = surveys.iter().map(|s| s.longest).min().unwrap_or(0);
        let max_decimation = most_decimated(shortest, MIN_KEPT_ROWS, cutoff, rate);
        let (decimation, decimation_reason) = match options.decimation {
            Choice::Fixed(n) => (n, format!("Every {n}th row, as given.")),
            Choice::Auto => choose_decimation(motion, cutoff, rate, max_decimation),
        };
        if decimation == 0 || (decimation as u64) > max_decimation {
            return Err(PrepareError::Decimation {
                factor: decimation,
                rows: shortest,
                most: max_decimation,
            });
        }
        let (speed_threshold, speed_reason) =
            choose_speeds(surveys, &spectra, cutoff, options.speed_threshold);
        let (parallel_edge, parallel_filter) =
            parallel_pass(options.order, cutoff, decimation, rate);
        let trimmed = trimmed_rows(cutoff, decimation, rate);
        enough_rows(
            surveys,
            MIN_KEPT_ROWS * decimation as u64 + 2 * trimmed as u64,
        )?;
        Ok(Self {
            sample_rate: rate,
            cutoff,
            cutoff_reason,
            trials: Vec::new(),
            spectral_cutoff: None,
            order: options.order,
            decimation,
            decimation_reason,
            parallel_edge,
            parallel_filter,
            derivatives: if options.measured_derivatives {
                "Velocity and, where recorded, acceleration from the recording, through the position's filter.".into()
            } else {
                "Differences of the filtered position by five points (Abramowitz and Stegun 1964, table 25.2)."
                    .into()
            },
            measured_derivatives: options.measured_derivatives,
            torque_lead: options.torque_lead,
            judged_speed: speed_threshold.clone(),
            speed_threshold,
            reversal_margin: options.reversal_margin,
            speed_reason,
            saturation: saturation(surveys, torque_limits, spectra.len()),
            trimmed,
            spectra,
            motion_frequency: motion,
            piece_rows: options.piece_rows,
            threads: options.threads,
        })
    }

    /// Returns the treatment with a stronger decimation. Its low-pass passes only the band that the model explains, up
    /// to `band` in Hz, as long as `rows` of the shortest recording remain. Returns it unchanged if this does not
    /// reduce the rows, or if the decimation was given.
    ///
    /// # Errors
    /// As [`Self::decide`].
    pub fn narrowed(
        &self,
        band: f64,
        rows: u64,
        surveys: &[Survey],
        options: &PrepareOptions,
        torque_limits: &[Option<f64>],
    ) -> Result<Self, PrepareError> {
        let shortest = surveys.iter().map(|s| s.longest).min().unwrap_or(0);
        let possible = most_decimated(shortest, MIN_KEPT_ROWS, self.cutoff, self.sample_rate);
        let max_decimation = (shortest / rows.max(MIN_KEPT_ROWS)).clamp(1, possible);
        let n = ((0.4 * self.sample_rate / band).floor() as u64).clamp(1, max_decimation) as usize;
        if options.decimation != Choice::Auto || n <= self.decimation {
            return Ok(self.clone());
        }
        let mut narrow = self.decimated(n, surveys, options, torque_limits)?;
        narrow.decimation_reason = format!(
            "One row in {n}: the low-pass before it passes up to {:.3} Hz; beyond {band:.3} Hz more than half of the power of every joint's torque is nothing that the model explains.",
            narrow.parallel_edge
        );
        Ok(narrow)
    }

    /// Returns the treatment with one row in `decimation` kept.
    ///
    /// # Errors
    /// As [`Self::decide`].
    pub fn decimated(
        &self,
        decimation: usize,
        surveys: &[Survey],
        options: &PrepareOptions,
        torque_limits: &[Option<f64>],
    ) -> Result<Self, PrepareError> {
        let fixed = PrepareOptions {
            cutoff: Choice::Fixed(self.cutoff),
            decimation: Choice::Fixed(decimation),
            ..options.clone()
        };
        Ok(Self {
            cutoff_reason: self.cutoff_reason.clone(),
            trials: self.trials.clone(),
            spectral_cutoff: self.spectral_cutoff,
            ..Self::decide(surveys, &fixed, torque_limits)?
        })
    }

    /// Returns the treatment for recordings on which fitted values are judged.
    pub fn judging(&self) -> Self {
        Self {
            speed_threshold: self.judged_speed.clone(),
            ..self.clone()
        }
    }

    /// Sample period, s.
    pub fn dt(&self) -> f64 {
        1.0 / self.sample_rate
    }

    /// Returns the filter of the position.
    pub fn position_filter(&self) -> Option<LowPass> {
        LowPass::butterworth(self.order, self.cutoff, self.sample_rate)
    }

    /// Returns the filter of torque and regressor.
    pub fn parallel_low_pass(&self) -> Option<LowPass> {
        if self.decimation > 1 {
            LowPass::decimator(self.decimation, self.sample_rate)
        } else {
            self.position_filter()
        }
    }

    /// Returns the number of rows per second after decimation.
    pub fn kept_rate(&self) -> f64 {
        self.sample_rate / self.decimation as f64
    }
}

/// Returns true for no margin.
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Minimum number of rows after decimation.
const MIN_KEPT_ROWS: u64 = 50;

/// Returns the spectrum of each joint, from the longest recording in which the joint moves.
fn spectra_of(surveys: &[Survey], first: &Survey) -> Vec<PositionSpectrum> {
    let longest = surveys.iter().max_by_key(|s| s.rows).unwrap_or(first);
    (0..longest.joints.len())
        .map(|j| {
            let moving = surveys.iter().filter(|s| !s.joints[j].still());
            let longest_moving = moving.max_by_key(|s| s.rows).unwrap_or(longest);
            longest_moving.joints[j].spectrum.clone()
        })
        .collect()
}

/// Returns the highest decimation that leaves `kept` rows of a stretch of `rows` rows after trimming both ends.
fn most_decimated(rows: u64, kept: u64, cutoff: f64, rate: f64) -> u64 {
    let is_long_enough =
        |n: u64| kept * n + 2 * trimmed_rows(cutoff, n as usize, rate) as u64 <= rows;
    let mut max_decimation = rows / kept;
    while max_decimation > 1 && !is_long_enough(max_decimation) {
        max_decimation -= 1;
    }
    max_decimation.max(1)
}

/// Chooses the decimation. Torque and regressor pass the same filter, so its band causes no bias and removes noise.
fn choose_decimation(motion: f64, cutoff: f64, rate: f64, max_decimation: u64) -> (usize, String) {
    let band = (PARALLEL_HEADROOM * motion).min(cutoff);
    let n = ((0.4 * rate / band).floor() as u64).clamp(1, max_decimation) as usize;
    (
        n,
        format!(
            "One row in {n}: the low-pass before it passes up to {:.3} Hz, at least ten times the highest frequency of the motion ({motion:.3} Hz) or all that the position filter leaves.",
            if n > 1 {
                decimator_edge(n, rate)
            } else {
                cutoff
            }
        ),
    )
}

/// Chooses, per joint, the speed below which rows are masked; returns the reason too.
fn choose_speeds(
    surveys: &[Survey],
    spectra: &[PositionSpectrum],
    cutoff: f64,
    choice: Choice<f64>,
) -> (Vec<f64>, String) {
    let (mut speeds, reason): (Vec<f64>, String) = match choice {
        Choice::Fixed(speed) => (vec![speed; spectra.len()], format!("{}, as given.", format_short(speed))),
        Choice::Auto => (
            (spectra.iter())
                .map(|s| (5.0 * s.velocity_noise(cutoff)).max(0.01 * s.velocity_rms()))
                .collect(),
            "Five standard deviations of the velocity's noise behind the filter, at least 1 % of its RMS: below it the sign of the velocity, and with it Coulomb friction, is not known.".into(),
        ),
    };
    // At rest, friction or a brake carries any part of the torque, so rows of such a joint contain no information.
    for (j, speed) in speeds.iter_mut().enumerate() {
        if surveys.iter().all(|s| s.joints[j].still()) {
            *speed = speed.max(STANDSTILL_SPEED);
        }
    }
    (speeds, reason)
}

/// Returns, per joint, the torques beyond which rows count as saturated: the described limit or the clipping level.
fn saturation(surveys: &[Survey], limits: &[Option<f64>], joints: usize) -> Vec<[Option<f64>; 2]> {
    let of = |j: usize| {
        let limit = limits.get(j).copied().flatten();
        let seen = |side: usize| surveys.iter().find_map(|s| s.joints[j].clipped[side]);
        [
            (limit.map(|l| -l).into_iter().chain(seen(0))).reduce(f64::max),
            limit.into_iter().chain(seen(1)).reduce(f64::min),
        ]
    };
    (0..joints).map(of).collect()
}

/// Refuses a recording without a stretch of `needed` rows.
fn enough_rows(surveys: &[Survey], needed: u64) -> Result<(), PrepareError> {
    let Some(survey) = surveys.iter().find(|s| s.longest < needed) else {
        return Ok(());
    };
    let (label, rows, longest) = (survey.label.clone(), survey.rows, survey.longest);
    Err(if longest < rows {
        PrepareError::Broken {
            label,
            longest,
            rows,
            needed,
        }
    } else {
        PrepareError::TooShort {
            label,
            rows,
            needed,
        }
    })
}

/// Chooses the lowest frequency at which the signal of a joint falls to its noise floor. Chooses a lower one if the
/// acceleration would still be too noisy.
fn choose_cutoff(spectra: &[PositionSpectrum], motion: f64, nyquist: f64) -> (f64, String) {
    let crossing = spectra
        .iter()
        .map(|s| s.crossing)
        .fold(f64::INFINITY, f64::min);
    let clean = spectra
        .iter()
        .map(|s| s.clean)
        .fold(f64::INFINITY, f64::min);
    let max_cutoff = MAX_CUTOFF_SHARE * nyquist;
    let least = (MIN_HEADROOM * motion).min(max_cutoff);
    let wish = crossing.min(clean);
    let cutoff = wish.clamp(least, max_cutoff);
    let reason = if wish < least {
        format!(
            "{cutoff:.3} Hz, five times the highest frequency of the motion ({motion:.3} Hz), although noise outweighs the signal from {crossing:.3} Hz on: a lower cut-off would bend the motion itself."
        )
    } else if wish > max_cutoff {
        format!(
            "{cutoff:.3} Hz, 80 % of the Nyquist frequency: the position stands above its noise over the whole band."
        )
    } else if clean < crossing {
        format!(
            "{cutoff:.3} Hz: above it noise would be more than {:.1} % of the power of the acceleration; the position itself sinks into its noise at {crossing:.3} Hz.",
            NOISE_SHARE * 100.0
        )
    } else {
        format!("{cutoff:.3} Hz: there the spectrum of the position sinks into its noise floor.")
    };
    (cutoff, reason)
}
