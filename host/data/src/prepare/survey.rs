//! First pass over a recording: rate, ranges and spectrum.

use serde::Serialize;

use super::error::PrepareError;
use super::pieces::Recording;
use super::spacing::Spacing;
use super::spectrum::{PositionSpectrum, Welch};
use crate::plateau::{PILE_UP, plateaus, speed_per_row};
use crate::plausibility::JUDGED_ROWS;

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
    /// Torque limits at which the recording was clipped: its extreme value repeats for at least `CLIPPED_RUN` rows, and
    /// more often than the top level of a smooth torque in steps. Or it is noise about a level while the motion goes on:
    /// then the end of this noise towards smaller torques.
    pub clipped: [Option<f64>; 2],
    /// Spectrum of the position.
    pub spectrum: PositionSpectrum,
}

/// Number of consecutive rows at the extreme torque that counts as clipping. Noise never repeats a value that often,
/// but a command held at a limit does.
pub(super) const CLIPPED_RUN: usize = 5;
/// Number of rows in which a noisy plateau of the torque is searched, as many as are checked for other faults of columns.
const SEARCHED: usize = JUDGED_ROWS;

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
    /// Rows at the extreme value.
    rows: usize,
    /// The next value inwards, and its rows.
    next: (f64, usize),
}

impl Extreme {
    fn new() -> Self {
        Self {
            value: f64::NEG_INFINITY,
            run: 0,
            longest: 0,
            rows: 0,
            next: (f64::NEG_INFINITY, 0),
        }
    }
    fn push(&mut self, x: f64) {
        if x > self.value {
            self.next = (self.value, self.rows);
            (self.value, self.run, self.longest, self.rows) = (x, 1, 1, 1);
        } else if x == self.value {
            self.run += 1;
            self.rows += 1;
            self.longest = self.longest.max(self.run);
        } else {
            self.run = 0;
            if x > self.next.0 {
                self.next = (x, 1);
            } else if x == self.next.0 {
                self.next.1 += 1;
            }
        }
    }
    fn clipped(&self) -> Option<f64> {
        let piled_up = self.rows as f64 > PILE_UP * self.next.1 as f64;
        (self.longest >= CLIPPED_RUN && piled_up).then_some(self.value)
    }
}

/// Ranges and spectrum of one joint over the rows so far.
struct Running {
    position: [f64; 2],
    last: f64,
    step: f64,
    square: f64,
    high: Extreme,
    low: Extreme,
    welch: Delayed,
    /// Torque and position of the first rows, stretch by stretch.
    first: Vec<[Vec<f64>; 2]>,
    searched: usize,
}

impl Running {
    fn new() -> Self {
        Self {
            position: [f64::INFINITY, f64::NEG_INFINITY],
            last: 0.0,
            step: 0.0,
            square: 0.0,
            high: Extreme::new(),
            low: Extreme::new(),
            welch: Delayed::default(),
            first: Vec::new(),
            searched: 0,
        }
    }

    /// Takes position and torque of a row of a recording of `rate` Hz, as far as the rate is known.
    fn push(&mut self, q: f64, tau: f64, follows: bool, rate: f64) {
        self.position = [self.position[0].min(q), self.position[1].max(q)];
        if follows {
            self.step = self.step.max((q - self.last).abs());
        }
        self.last = q;
        self.square += tau * tau;
        self.high.push(tau);
        self.low.push(-tau);
        self.welch.push(q, follows, rate);
        if self.searched < SEARCHED {
            self.searched += 1;
            if !follows || self.first.is_empty() {
                self.first.push([Vec::new(), Vec::new()]);
            }
            if let Some([torques, positions]) = self.first.last_mut() {
                torques.push(tau);
                positions.push(q);
            }
        }
    }

    /// Returns the torques beyond which rows are cut: at the lowest and at the highest ones.
    fn clipped(&self) -> [Option<f64>; 2] {
        let speeds: Vec<Vec<f64>> = (self.first.iter()).map(|[_, q]| speed_per_row(q)).collect();
        let stretches: Vec<_> = (self.first.iter().zip(&speeds))
            .map(|([tau, _], speed)| [tau.as_slice(), speed.as_slice()])
            .collect();
        let [low, high] = plateaus(&stretches).map(|own| own.map(|own| own.edge));
        [
            self.low.clipped().map(|v| -v).or(low),
            self.high.clipped().or(high),
        ]
    }

    fn still(&self) -> bool {
        self.position[0] == self.position[1]
    }

    /// Returns the survey of `rows` rows; `None` if no stretch is long enough for a spectrum.
    fn finish(self, rows: u64, sample_rate: f64) -> Option<JointSurvey> {
        let (still, clipped) = (self.still(), self.clipped());
        let (frequency, density) = (self.welch.finish(sample_rate)).density(sample_rate)?;
        Some(JointSurvey {
            position: self.position,
            peak_speed: self.step * sample_rate,
            torque_rms: (self.square / rows as f64).sqrt(),
            torque: [-self.low.value, self.high.value],
            clipped,
            spectrum: if still {
                PositionSpectrum::still(frequency)
            } else {
                PositionSpectrum::judge(frequency, density)
            },
        })
    }
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
        let mut running: Vec<Running> = (0..joints).map(|_| Running::new()).collect();
        let mut spacing = Spacing::new();
        recording.each_block(1 << 16, &mut |block| {
            if block.joints.len() != joints {
                return Err(PrepareError::JointCount {
                    label: recording.label(),
                    found: block.joints.len(),
                    expected: joints,
                });
            }
            for k in 0..block.len() {
                let line = block.line(k);
                let follows = spacing.push(block.t[k], line, k > 0 || block.continues);
                let rate = spacing.rate();
                for (r, column) in running.iter_mut().zip(&block.joints) {
                    r.push(column.q[k], column.tau[k], follows, rate);
                }
            }
            Ok(())
        })?;
        Self::of(running, &spacing, recording.label())
    }

    /// Judges what the pass over the whole recording has found.
    fn of(running: Vec<Running>, spacing: &Spacing, label: String) -> Result<Self, PrepareError> {
        let (rows, longest) = (spacing.rows, spacing.longest);
        if rows < FEWEST_ROWS {
            return Err(PrepareError::TooShort {
                label,
                rows,
                needed: FEWEST_ROWS,
            });
        }
        let mean = spacing.mean();
        if let Some(line) = spacing.uneven_line() {
            return Err(PrepareError::Irregular {
                label,
                line,
                mean,
                longest: spacing.longest_step,
            });
        }
        if let (Some(first), true) = (running.first(), running.iter().all(Running::still)) {
            return Err(PrepareError::NotMoving {
                label,
                joint: 1,
                position: first.position[0],
            });
        }
        let sample_rate = 1.0 / mean;
        let joints: Option<Vec<JointSurvey>> = (running.into_iter())
            .map(|joint| joint.finish(rows, sample_rate))
            .collect();
        let Some(joints) = joints else {
            return Err(PrepareError::Broken {
                label,
                longest,
                rows,
                needed: FEWEST_ROWS,
            });
        };
        Ok(Self {
            label,
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

    /// A torque in steps stays at its highest step at each peak and on each plateau of friction; a limit holds it there
    /// far longer than one step below.
    #[test]
    fn steps_and_plateaus_are_no_limit() {
        let clipped = |torque: &dyn Fn(f64) -> f64| {
            let mut high = Extreme::new();
            (0..10_000).for_each(|k| high.push(torque(0.02 * f64::from(k))));
            high.clipped()
        };
        let steps = |x: f64| 0.1 * (10.0 * x).round();
        assert_eq!(clipped(&|t| steps(1.408 * (0.11 * t).sin())), None);
        let friction = |t: f64| (0.3 * t).sin().signum() + 0.12 * (0.11 * t).sin();
        assert_eq!(clipped(&|t| steps(friction(t))), None);
        let limited = |t: f64| 2.0 * (0.3 * t).sin();
        assert_eq!(clipped(&|t| limited(t).min(1.4)), Some(1.4));
        let found = clipped(&|t| steps(limited(t).min(1.4)));
        assert_eq!(found, Some(steps(1.4)));
    }

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
