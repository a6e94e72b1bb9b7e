//! First pass over a recording: rate, ranges and spectrum.

use serde::Serialize;

use super::PrepareError;
use super::pieces::Recording;
use super::spectrum::{PositionSpectrum, Welch};

/// Allowed deviation of the time from the even grid over [`STEPS_TOGETHER`] rows, as a share of a step. Accepts stamps
/// of single precision, a clock with jitter and single stamps off the grid. A lost or doubled row exceeds it.
const STEP_TOLERANCE: f64 = 0.4;

/// Number of rows over which the deviation from the grid is measured.
const STEPS_TOGETHER: usize = 8;

/// Relative difference below which steps count as equal: the first of them is reported.
const ROUNDING: f64 = 1e-9;

/// Minimum number of rows for a spectrum.
const FEWEST_ROWS: u64 = 256;

/// Survey of one joint over a whole recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointSurvey {
    /// Lowest and highest position, rad or m.
    pub position: [f64; 2],
    /// Highest speed between neighbouring rows, rad/s or m/s: an upper bound that includes noise.
    pub peak_speed: f64,
    /// RMS of the torque, N·m or N.
    pub torque_rms: f64,
    /// Lowest and highest torque.
    pub torque: [f64; 2],
    /// Torque limits at which the recording was clipped: its extreme value repeats for at least `CLIPPED_RUN` rows.
    pub clipped: [Option<f64>; 2],
    /// Spectrum of the position.
    pub spectrum: PositionSpectrum,
}

/// Number of consecutive rows at the extreme torque that counts as clipping. Noise never repeats a value that often,
/// but a command held at a limit does.
pub(super) const CLIPPED_RUN: usize = 5;

/// Survey of a whole recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Survey {
    /// Name of the recording.
    pub label: String,
    /// Rows.
    pub rows: u64,
    /// Rows of the longest stretch without a gap.
    pub longest: u64,
    /// Hz
    pub sample_rate: f64,
    /// One entry per joint.
    pub joints: Vec<JointSurvey>,
    /// Changes to its time stamps, as a sentence; `None` if there were none.
    pub note: Option<String>,
}

struct Extreme {
    value: f64,
    run: usize,
    longest: usize,
}

impl Extreme {
    fn new() -> Self {
        Self {
            value: f64::NEG_INFINITY,
            run: 0,
            longest: 0,
        }
    }
    fn push(&mut self, x: f64) {
        if x > self.value {
            (self.value, self.run, self.longest) = (x, 1, 1);
        } else if x == self.value {
            self.run += 1;
            self.longest = self.longest.max(self.run);
        } else {
            self.run = 0;
        }
    }
    fn clipped(&self) -> Option<f64> {
        (self.longest >= CLIPPED_RUN).then_some(self.value)
    }
}

struct Running {
    position: [f64; 2],
    last: f64,
    step: f64,
    square: f64,
    high: Extreme,
    low: Extreme,
    welch: Delayed,
}

/// Number of rows of the longest spectrum segments up to 1 kHz; there they resolve 0.25 Hz.
const LONGEST_SEGMENT: usize = 4096;
/// Rate up to which the segments have [`LONGEST_SEGMENT`] rows, Hz. At higher rates they keep the duration they have at
/// this rate. A segment shorter than the period of the motion underestimates the RMS speed (to a quarter at 5 kHz).
const SEGMENT_RATE: f64 = 1000.0;

/// Returns the number of rows of the longest segments at a rate in Hz, a power of two.
fn longest_segment(rate: f64) -> usize {
    // The rate comes from stamps with jitter, which must not decide between two powers.
    let times = (0.99 * rate / SEGMENT_RATE).ceil();
    let most = f64::from(1 << 8);
    LONGEST_SEGMENT * (if times > 1.0 { times.min(most) } else { 1.0 } as usize).next_power_of_two()
}

/// A spectrum with segments as long as the recording and its stretches without a gap allow. A recording without gaps
/// has at least seven segments, half overlapping. Rows wait until the recording is known to fill the longest segments.
#[derive(Default)]
struct Delayed {
    /// Value, and whether it follows the one before without a gap.
    waiting: Vec<(f64, bool)>,
    welch: Option<Welch>,
}

impl Delayed {
    /// Takes a value of a recording of `rate` Hz, as far as the rate is known.
    fn push(&mut self, x: f64, follows: bool, rate: f64) {
        if let Some(welch) = &mut self.welch {
            if !follows {
                welch.interrupt();
            }
            welch.push(x);
            return;
        }
        self.waiting.push((x, follows));
        if self.waiting.len() >= 4 * longest_segment(rate) {
            self.start(rate);
        }
    }

    fn start(&mut self, rate: f64) {
        let stretches = self.waiting.chunk_by(|_, (_, follows)| *follows);
        let longest = stretches.map(<[_]>::len).max().unwrap_or(0);
        let most = (self.waiting.len() / 4).min(longest).max(1);
        let segment = (1usize << most.ilog2()).clamp(64, longest_segment(rate));
        self.welch = Some(Welch::new(segment));
        for (x, follows) in std::mem::take(&mut self.waiting) {
            self.push(x, follows, rate);
        }
    }

    fn finish(mut self, rate: f64) -> Welch {
        if self.welch.is_none() {
            self.start(rate);
        }
        self.welch.unwrap_or_else(|| Welch::new(LONGEST_SEGMENT))
    }
}

impl JointSurvey {
    /// Returns true if the joint stands still throughout.
    pub fn still(&self) -> bool {
        self.position[0] == self.position[1]
    }

    /// Returns true if the position range is explained by white noise at the spectrum's noise floor, sampled at
    /// `sample_rate` Hz. The range may be six standard deviations to both sides; one row in 10⁹ exceeds this.
    pub fn only_noise(&self, sample_rate: f64) -> bool {
        let noise = (0.5 * self.spectrum.floor * sample_rate).sqrt();
        self.position[1] - self.position[0] <= 12.0 * noise
    }
}

impl Survey {
    /// Returns the survey with the signal of each joint ending at its frequency in `ends` at the latest, Hz; see
    /// [`PositionSpectrum::ending_at`].
    pub fn ending_at(&self, ends: &[f64]) -> Self {
        let mut survey = self.clone();
        for (joint, end) in survey.joints.iter_mut().zip(ends) {
            joint.spectrum = joint.spectrum.ending_at(*end);
        }
        survey
    }

    /// Reads `recording` once. `joints` is the number of joints of the robot.
    ///
    /// # Errors
    /// [`PrepareError`]: too short, unevenly sampled, no joint moving, wrong number of joints.
    pub fn take(recording: &dyn Recording, joints: usize) -> Result<Self, PrepareError> {
        let mut running: Vec<Running> = (0..joints)
            .map(|_| Running {
                position: [f64::INFINITY, f64::NEG_INFINITY],
                last: 0.0,
                step: 0.0,
                square: 0.0,
                high: Extreme::new(),
                low: Extreme::new(),
                welch: Delayed::default(),
            })
            .collect();
        let (mut rows, mut longest, mut run) = (0u64, 0u64, 0u64);
        let (mut span, mut steps, mut longest_step) = (0.0, 0u64, 0.0f64);
        let mut last_time = 0.0;
        let mut recent = [0.0; STEPS_TOGETHER];
        let (mut shortest, mut widest) = ((f64::INFINITY, 0u64), (0.0f64, 0u64));
        recording.each_block(1 << 16, &mut |block| {
            if block.joints.len() != joints {
                return Err(PrepareError::JointCount {
                    label: recording.label(),
                    found: block.joints.len(),
                    expected: joints,
                });
            }
            for k in 0..block.len() {
                let follows = rows > 0 && (k > 0 || block.continues);
                let t = block.t[k];
                if follows {
                    let step = t - last_time;
                    span += step;
                    longest_step = longest_step.max(step);
                    steps += 1;
                    let line = block.first_line + k as u64;
                    if run >= STEPS_TOGETHER as u64 {
                        let together = t - recent[rows as usize % STEPS_TOGETHER];
                        if together < shortest.0 * (1.0 - ROUNDING) {
                            shortest = (together, line);
                        }
                        if together > widest.0 * (1.0 + ROUNDING) {
                            widest = (together, line);
                        }
                    }
                    run += 1;
                } else {
                    run = 1;
                }
                longest = longest.max(run);
                recent[rows as usize % STEPS_TOGETHER] = t;
                last_time = t;
                rows += 1;
                for (r, column) in running.iter_mut().zip(&block.joints) {
                    let (q, tau) = (column.q[k], column.tau[k]);
                    r.position = [r.position[0].min(q), r.position[1].max(q)];
                    if follows {
                        r.step = r.step.max((q - r.last).abs());
                    }
                    r.last = q;
                    r.square += tau * tau;
                    r.high.push(tau);
                    r.low.push(-tau);
                    r.welch.push(q, follows, steps as f64 / span);
                }
            }
            Ok(())
        })?;
        if rows < FEWEST_ROWS {
            return Err(PrepareError::TooShort {
                label: recording.label(),
                rows,
                needed: FEWEST_ROWS,
            });
        }
        let mean = span / steps.max(1) as f64;
        for (together, line) in [shortest, widest] {
            // Skipped if no stretch was long enough.
            if !together.is_finite() || line == 0 {
                continue;
            }
            // The step if a single row caused the whole deviation.
            let step = together - (STEPS_TOGETHER - 1) as f64 * mean;
            let deviation = (step / mean - 1.0).abs();
            if deviation > STEP_TOLERANCE || deviation.is_nan() {
                return Err(PrepareError::Irregular {
                    label: recording.label(),
                    line,
                    mean,
                    longest: longest_step,
                });
            }
        }
        let sample_rate = 1.0 / mean;
        let still = |r: &Running| r.position[0] == r.position[1];
        if let (Some(first), true) = (running.first(), running.iter().all(still)) {
            return Err(PrepareError::NotMoving {
                label: recording.label(),
                joint: 1,
                position: first.position[0],
            });
        }
        let joints = running
            .into_iter()
            .map(|r| {
                let (frequency, density) = (r.welch.finish(sample_rate).density(sample_rate))
                    .ok_or_else(|| PrepareError::Broken {
                        label: recording.label(),
                        longest,
                        rows,
                        needed: FEWEST_ROWS,
                    })?;
                Ok(JointSurvey {
                    position: r.position,
                    peak_speed: r.step * sample_rate,
                    torque_rms: (r.square / rows as f64).sqrt(),
                    torque: [-r.low.value, r.high.value],
                    clipped: [r.low.clipped().map(|v| -v), r.high.clipped()],
                    spectrum: if r.position[0] == r.position[1] {
                        PositionSpectrum::still(frequency)
                    } else {
                        PositionSpectrum::judge(frequency, density)
                    },
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            label: recording.label(),
            rows,
            longest,
            sample_rate,
            joints,
            note: None,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::prepare::InMemory;
    use crate::{Block, JointColumns};

    /// Lost rows split a recording into stretches shorter than the longest spectrum segments: shorter ones are used.
    #[test]
    fn a_recording_in_many_stretches_is_surveyed() {
        let stretch = |first: usize| {
            let t: Vec<f64> = (first..first + 1000).map(|k| k as f64 * 1e-3).collect();
            let joint = JointColumns {
                q: t.iter().map(|t| (3.0 * t).sin()).collect(),
                tau: t.iter().map(|t| (3.0 * t).cos()).collect(),
                ..Default::default()
            };
            Block {
                t,
                joints: vec![joint],
                first_line: first as u64 + 2,
                ..Default::default()
            }
        };
        let recording = InMemory {
            label: "made".into(),
            blocks: (0..40).map(|k| stretch(1001 * k)).collect(),
        };
        let survey = Survey::take(&recording, 1).unwrap();
        assert_eq!((survey.rows, survey.longest), (40_000, 1000));
        assert!((survey.sample_rate - 1000.0).abs() < 1e-6);
        assert!(!survey.joints[0].only_noise(survey.sample_rate));
    }
}
