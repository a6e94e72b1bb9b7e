//! The first look at a recording: rate, ranges and spectrum.

use serde::Serialize;

use super::PrepareError;
use super::pieces::Recording;
use super::spectrum::{PositionSpectrum, Welch};

/// Steps may differ from the mean by this share: time stamps written with single precision or by a jittery
/// clock pass, a lost or doubled row does not.
const STEP_TOLERANCE: f64 = 0.2;

/// Rows below which a spectrum says nothing.
const FEWEST_ROWS: u64 = 256;

/// One joint over a whole recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointSurvey {
    /// Lowest and highest position, rad or m.
    pub position: [f64; 2],
    /// Highest speed between neighbouring rows, rad/s or m/s: an upper bound, noise included.
    pub peak_speed: f64,
    /// RMS of the torque, N·m or N.
    pub torque_rms: f64,
    /// Lowest and highest torque.
    pub torque: [f64; 2],
    /// Torques at which the recording rests at its extreme for at least `CLIPPED_RUN` rows: it was clipped there.
    pub clipped: [Option<f64>; 2],
    /// Spectrum of the position.
    pub spectrum: PositionSpectrum,
}

/// Rows in a row at the extreme torque that count as clipping; noise never repeats a value that often, but a
/// command held at a limit does.
pub(super) const CLIPPED_RUN: usize = 5;

/// A recording as a whole.
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
    /// One entry a joint.
    pub joints: Vec<JointSurvey>,
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
    welch: Welch,
}

impl Survey {
    /// Reads `recording` once. `joints` is the number of joints of the robot.
    ///
    /// # Errors
    /// [`PrepareError`]: too short, unevenly sampled, not moving, wrong number of joints.
    pub fn take(recording: &dyn Recording, joints: usize) -> Result<Self, PrepareError> {
        // Segments of 4096 rows resolve 0.25 Hz at 1 kHz; a short recording gets at least seven of them.
        let mut rows_total = 0u64;
        let (mut last_time, mut span, mut steps) = (0.0, 0.0, 0u64);
        recording.each_block(1 << 16, &mut |b| {
            for (k, t) in b.t.iter().enumerate() {
                if rows_total > 0 && (k > 0 || b.continues) {
                    span += t - last_time;
                    steps += 1;
                }
                last_time = *t;
                rows_total += 1;
            }
            Ok(())
        })?;
        let mean: f64 = span / steps.max(1) as f64;
        if rows_total < FEWEST_ROWS {
            return Err(PrepareError::TooShort {
                label: recording.label(),
                rows: rows_total,
                needed: FEWEST_ROWS,
            });
        }
        let segment = (1usize << (rows_total / 4).ilog2()).clamp(64, 4096);
        let mut running: Vec<Running> = (0..joints)
            .map(|_| Running {
                position: [f64::INFINITY, f64::NEG_INFINITY],
                last: 0.0,
                step: 0.0,
                square: 0.0,
                high: Extreme::new(),
                low: Extreme::new(),
                welch: Welch::new(segment),
            })
            .collect();
        let (mut rows, mut longest, mut run) = (0u64, 0u64, 0u64);
        last_time = 0.0;
        // An uneven step waits for the next: a time stamp off the grid makes one too short and one too long.
        let mut uneven: Option<(f64, u64)> = None;
        let mut worst: Option<(f64, u64)> = None;
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
                    let line = block.first_line + k as u64;
                    let deviates = |step: f64, of: f64| {
                        let deviation = (step / of - 1.0).abs();
                        deviation > STEP_TOLERANCE || deviation.is_nan()
                    };
                    let made_up = uneven.take_if(|(before, _)| {
                        (*before + step - 2.0 * mean).abs() <= STEP_TOLERANCE * mean
                    });
                    if made_up.is_none() {
                        worst = worst.or(uneven.take());
                        if deviates(step, mean) {
                            uneven = Some((step, line));
                        }
                    }
                    run += 1;
                } else {
                    worst = worst.or(uneven.take());
                    run = 1;
                }
                longest = longest.max(run);
                last_time = t;
                rows += 1;
                for (r, column) in running.iter_mut().zip(&block.joints) {
                    let (q, tau) = (column.q[k], column.tau[k]);
                    r.position = [r.position[0].min(q), r.position[1].max(q)];
                    if follows {
                        r.step = r.step.max((q - r.last).abs());
                    } else {
                        r.welch.interrupt();
                    }
                    r.last = q;
                    r.square += tau * tau;
                    r.high.push(tau);
                    r.low.push(-tau);
                    r.welch.push(q);
                }
            }
            Ok(())
        })?;
        if let Some((step, line)) = worst.or(uneven) {
            return Err(PrepareError::Irregular {
                label: recording.label(),
                line,
                step,
                mean,
            });
        }
        let sample_rate = 1.0 / mean;
        let joints = running
            .into_iter()
            .enumerate()
            .map(|(j, r)| {
                if r.position[0] == r.position[1] {
                    return Err(PrepareError::NotMoving {
                        label: recording.label(),
                        joint: j + 1,
                        position: r.position[0],
                    });
                }
                let (frequency, density) =
                    r.welch
                        .density(sample_rate)
                        .ok_or_else(|| PrepareError::TooShort {
                            label: recording.label(),
                            rows: longest,
                            needed: FEWEST_ROWS,
                        })?;
                Ok(JointSurvey {
                    position: r.position,
                    peak_speed: r.step * sample_rate,
                    torque_rms: (r.square / rows as f64).sqrt(),
                    torque: [-r.low.value, r.high.value],
                    clipped: [r.low.clipped().map(|v| -v), r.high.clipped()],
                    spectrum: PositionSpectrum::judge(frequency, density),
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            label: recording.label(),
            rows,
            longest,
            sample_rate,
            joints,
        })
    }
}
