//! What is done to the recordings, decided once and written down.

use serde::Serialize;

use super::PrepareError;
use super::filter::{LowPass, decimator_edge};
use super::rate::{parallel_pass, same_rate, trimmed_rows};
use super::spectrum::{NOISE_SHARE, PositionSpectrum};
use super::survey::Survey;

/// A setting that the data choose or that is given.
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
    /// Every how many rows one is kept after the parallel low-pass.
    pub decimation: Choice<usize>,
    /// Speed below which a row is masked, rad/s or m/s, the same for all joints; 0 masks nothing.
    pub speed_threshold: Choice<f64>,
    /// Velocity and acceleration from the recording's own columns where the position would be differentiated.
    pub measured_derivatives: bool,
    /// How much later the torque recorded at an instant acts, s: half a sample for a command that is held until
    /// the next one, plus dead time. The motion is taken that much later. Left at zero, such a lead L shifts
    /// viscous friction by about −J·L·ω² for a motion of angular frequency ω.
    pub torque_lead: f64,
    /// Rows that are processed together; memory grows with it, results do not depend on it.
    pub piece_rows: usize,
    /// Threads; 0 for as many as the machine has. Results do not depend on it, to the last bit.
    pub threads: usize,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self {
            cutoff: Choice::Auto,
            order: 4,
            decimation: Choice::Auto,
            speed_threshold: Choice::Auto,
            measured_derivatives: false,
            torque_lead: 0.0,
            piece_rows: 1 << 16,
            threads: 0,
        }
    }
}

/// Rows left out, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Masked {
    /// Number of the joint, from 1; 0 where it concerns all.
    pub joint: usize,
    /// Rows (after decimation), or windows of the integral model.
    pub rows: u64,
    /// Why.
    pub why: String,
}

/// What is done to every recording of an identification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Treatment {
    /// Hz
    pub sample_rate: f64,
    /// Cut-off of the position filter, Hz.
    pub cutoff: f64,
    /// Why this cut-off, a sentence.
    pub cutoff_reason: String,
    /// Order of the Butterworth filter, forward and backward.
    pub order: usize,
    /// Every how many rows one is kept.
    pub decimation: usize,
    /// Why this decimation, a sentence.
    pub decimation_reason: String,
    /// Pass band of the parallel low-pass over torque and regressor, Hz.
    pub parallel_edge: f64,
    /// What the parallel low-pass is, a sentence.
    pub parallel_filter: String,
    /// How velocity and acceleration were got, a sentence.
    pub derivatives: String,
    /// Whether the recording's own velocity and acceleration are used.
    pub measured_derivatives: bool,
    /// How much later the torque recorded at an instant is taken to act, s.
    pub torque_lead: f64,
    /// Per joint, speed below which rows are masked, rad/s or m/s.
    pub speed_threshold: Vec<f64>,
    /// Why these thresholds, a sentence.
    pub speed_reason: String,
    /// Per joint, torques beyond which rows count as saturated (lowest, highest).
    pub saturation: Vec<[Option<f64>; 2]>,
    /// Rows left out at both ends of every stretch, before decimation.
    pub trimmed: usize,
    /// Per joint, the spectrum of the position that the cut-off was read from.
    pub spectra: Vec<PositionSpectrum>,
    /// Highest frequency of the motion over all joints, Hz (99 % of the power of the velocity).
    pub motion_frequency: f64,
    /// Rows that one piece holds.
    #[serde(skip)]
    pub piece_rows: usize,
    /// Threads; 0 for as many as the machine has.
    #[serde(skip)]
    pub threads: usize,
}

/// Lowest cut-off as a multiple of the highest frequency of the motion; below it the filter would bend the
/// motion itself.
const LEAST_HEADROOM: f64 = 5.0;

/// Pass band of the parallel low-pass as a multiple of the highest frequency of the motion: reversals of
/// friction have harmonics well above the motion itself, and the residual is to show them.
const PARALLEL_HEADROOM: f64 = 10.0;

/// Highest cut-off as a share of the Nyquist frequency.
pub(super) const HIGHEST: f64 = 0.8;

/// Above what rounding leaves of the velocity of a joint that stands still, below what any encoder shows, rad/s or m/s.
const STILL: f64 = 1e-6;

impl Treatment {
    /// Decides from the surveys of all training recordings and the robot's torque limits.
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
        // The longest recording speaks for the spectrum, for that of a joint the longest in which it moves.
        let speaker = surveys.iter().max_by_key(|s| s.rows).unwrap_or(first);
        let spectra: Vec<PositionSpectrum> = (0..speaker.joints.len())
            .map(|j| {
                let moving = surveys.iter().filter(|s| !s.joints[j].still());
                let own = moving.max_by_key(|s| s.rows).unwrap_or(speaker);
                own.joints[j].spectrum.clone()
            })
            .collect();
        let motion = spectra.iter().map(|s| s.motion).fold(0.0, f64::max);
        let nyquist = rate / 2.0;
        let (cutoff, cutoff_reason) = match options.cutoff {
            Choice::Fixed(hz) => (hz, format!("{hz} Hz, as given.")),
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
        let most = (shortest / FEWEST_KEPT).max(1);
        let (decimation, decimation_reason) = match options.decimation {
            Choice::Fixed(n) => (n, format!("Every {n}th row, as given.")),
            Choice::Auto => {
                // Torque and regressor pass the same filter, so this band costs no bias; it drops noise.
                let band = (PARALLEL_HEADROOM * motion).min(cutoff);
                let n = ((0.4 * rate / band).floor() as u64).clamp(1, most) as usize;
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
        };
        if decimation == 0 || (decimation as u64) > most {
            return Err(PrepareError::Decimation {
                factor: decimation,
                rows: shortest,
                most,
            });
        }
        let (speed_threshold, speed_reason) = match options.speed_threshold {
            Choice::Fixed(speed) => (vec![speed; spectra.len()], format!("{speed}, as given.")),
            Choice::Auto => {
                let thresholds = spectra
                    .iter()
                    .map(|s| {
                        let rms = s.velocity_rms();
                        (5.0 * s.velocity_noise(cutoff)).max(0.01 * rms)
                    })
                    .collect();
                (
                    thresholds,
                    "Five standard deviations of the velocity's noise behind the filter, at least 1 % of its RMS: below it the sign of the velocity, and with it Coulomb friction, is not known.".into(),
                )
            }
        };
        // At rest friction, or a brake, carries any part of the torque: no row of such a joint tells anything.
        let speed_threshold = speed_threshold
            .into_iter()
            .enumerate()
            .map(|(j, speed): (usize, f64)| {
                let still = surveys.iter().all(|s| s.joints[j].still());
                if still { speed.max(STILL) } else { speed }
            })
            .collect();
        let (parallel_edge, parallel_filter) =
            parallel_pass(options.order, cutoff, decimation, rate);
        let saturation = speaker
            .joints
            .iter()
            .enumerate()
            .map(|(j, _)| {
                let limit = torque_limits.get(j).copied().flatten();
                let seen = |side: usize| surveys.iter().find_map(|s| s.joints[j].clipped[side]);
                [
                    limit
                        .map(|l| -l)
                        .into_iter()
                        .chain(seen(0))
                        .reduce(f64::max),
                    limit.into_iter().chain(seen(1)).reduce(f64::min),
                ]
            })
            .collect();
        let trimmed = trimmed_rows(cutoff, decimation, rate);
        let needed = FEWEST_KEPT * decimation as u64 + 2 * trimmed as u64;
        for survey in surveys {
            if survey.longest < needed {
                let label = survey.label.clone();
                return Err(if survey.longest < survey.rows {
                    PrepareError::Broken {
                        label,
                        longest: survey.longest,
                        rows: survey.rows,
                        needed,
                    }
                } else {
                    PrepareError::TooShort {
                        label,
                        rows: survey.rows,
                        needed,
                    }
                });
            }
        }
        Ok(Self {
            sample_rate: rate,
            cutoff,
            cutoff_reason,
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
            speed_threshold,
            speed_reason,
            saturation,
            trimmed,
            spectra,
            motion_frequency: motion,
            piece_rows: options.piece_rows,
            threads: options.threads,
        })
    }

    /// The same with fewer rows: the low-pass before decimation passes only what the model explains, up to `band` in Hz,
    /// as long as `rows` of the shortest recording are left; unchanged where that keeps as many rows, or where the
    /// decimation was given.
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
        let most = (shortest / rows.max(FEWEST_KEPT)).max(1);
        let n = ((0.4 * self.sample_rate / band).floor() as u64).clamp(1, most) as usize;
        if options.decimation != Choice::Auto || n <= self.decimation {
            return Ok(self.clone());
        }
        let fixed = PrepareOptions {
            decimation: Choice::Fixed(n),
            ..options.clone()
        };
        let mut narrow = Self::decide(surveys, &fixed, torque_limits)?;
        narrow.decimation_reason = format!(
            "One row in {n}: the low-pass before it passes up to {:.3} Hz; beyond {band:.3} Hz more than half of the power of every joint's torque is nothing that the model explains.",
            narrow.parallel_edge
        );
        Ok(narrow)
    }

    /// s
    pub fn dt(&self) -> f64 {
        1.0 / self.sample_rate
    }

    /// Filter over the position.
    pub fn position_filter(&self) -> Option<LowPass> {
        LowPass::butterworth(self.order, self.cutoff, self.sample_rate)
    }

    /// Filter over torque and regressor.
    pub fn parallel_low_pass(&self) -> Option<LowPass> {
        if self.decimation > 1 {
            LowPass::decimator(self.decimation, self.sample_rate)
        } else {
            self.position_filter()
        }
    }

    /// Rows per second after decimation.
    pub fn kept_rate(&self) -> f64 {
        self.sample_rate / self.decimation as f64
    }
}

/// Rows that must be left after decimation.
const FEWEST_KEPT: u64 = 50;

/// The lowest frequency at which some joint's signal sinks into its noise, or less where that still leaves
/// too much noise in the acceleration.
fn choose_cutoff(spectra: &[PositionSpectrum], motion: f64, nyquist: f64) -> (f64, String) {
    let crossing = spectra
        .iter()
        .map(|s| s.crossing)
        .fold(f64::INFINITY, f64::min);
    let clean = spectra
        .iter()
        .map(|s| s.clean)
        .fold(f64::INFINITY, f64::min);
    let most = HIGHEST * nyquist;
    let least = (LEAST_HEADROOM * motion).min(most);
    let wish = crossing.min(clean);
    let cutoff = wish.clamp(least, most);
    let reason = if wish < least {
        format!(
            "{cutoff:.3} Hz, five times the highest frequency of the motion ({motion:.3} Hz), although noise outweighs the signal from {crossing:.3} Hz on: a lower cut-off would bend the motion itself."
        )
    } else if wish > most {
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
