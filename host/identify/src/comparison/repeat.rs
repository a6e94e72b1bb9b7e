//! Test if a hold-out recording repeats a training motion. Such a hold-out shows how well that motion is predicted
//! again, but not how well another motion is.
//!
//! The path is cut into windows, and each is searched in the training paths at every instant. A window is found if
//! every joint stays near. The recording repeats the motion if most windows are found.

use rig_data::prepare::{PrepareError, Recording};
use rig_numerics::statistics::squares_about_mean;

/// Largest number of windows.
const WINDOWS: usize = 10;
/// Samples per period of the fastest motion: half a sample is a twentieth of a radian of it.
const SAMPLES_A_PERIOD: usize = 60;
/// Distance between compared samples, in samples.
const STRIDE: usize = 6;
/// Smallest number of periods of the fastest motion in a window.
const LEAST_PERIODS: usize = 2;
/// Largest number of samples of a path; the rest is ignored.
const MOST_SAMPLES: usize = 40_000;
/// RMS distance within a window below which a joint is near, as a share of the joint's spread.
const NEAR: f64 = 0.1;
/// Share of the windows that must be found.
const MOSTLY: f64 = 0.8;
/// Share of the widest spread below which a joint stands still (rad and m compared directly).
const STILL: f64 = 1e-3;

/// Joint positions at equally spaced instants.
pub(crate) struct Path {
    joints: Vec<Vec<f64>>,
}

impl Path {
    /// Samples `recording`, whose motion has no frequency above `frequency` (Hz).
    pub(crate) fn of(recording: &dyn Recording, frequency: f64) -> Result<Self, PrepareError> {
        let period = 1.0 / (SAMPLES_A_PERIOD as f64 * frequency.max(f64::MIN_POSITIVE));
        let mut joints: Vec<Vec<f64>> = Vec::new();
        let mut start = None;
        let mut before: Option<(f64, Vec<f64>)> = None;
        recording.each_block(1 << 12, &mut |block| {
            joints.resize(block.joints.len(), Vec::new());
            let start = *start.get_or_insert(block.t.first().copied().unwrap_or(0.0));
            for (i, &t) in block.t.iter().enumerate() {
                loop {
                    let count = joints.first().map_or(MOST_SAMPLES, Vec::len);
                    let next = start + count as f64 * period;
                    if next > t || count >= MOST_SAMPLES {
                        break;
                    }
                    for (j, (path, joint)) in joints.iter_mut().zip(&block.joints).enumerate() {
                        path.push(match &before {
                            Some((t0, q0)) if t > *t0 => {
                                let share = (next - t0) / (t - t0);
                                q0[j] + share * (joint.q[i] - q0[j])
                            }
                            _ => joint.q[i],
                        });
                    }
                }
                before = Some((t, block.joints.iter().map(|joint| joint.q[i]).collect()));
            }
            Ok(())
        })?;
        Ok(Self { joints })
    }

    fn len(&self) -> usize {
        self.joints.first().map_or(0, Vec::len)
    }

    /// Returns the standard deviation of each joint's position.
    fn spread(&self) -> Vec<f64> {
        let of = |path: &Vec<f64>| {
            let count = path.len().max(1) as f64;
            (squares_about_mean(path) / count).sqrt()
        };
        self.joints.iter().map(of).collect()
    }

    /// Returns true if most windows are found in one of `others`, paths of the same joints and sampling.
    pub(crate) fn repeats(&self, others: &[Self]) -> bool {
        let windows = (self.len() / (LEAST_PERIODS * SAMPLES_A_PERIOD)).clamp(1, WINDOWS);
        let length = self.len() / windows;
        let spread = self.spread();
        let widest = spread.iter().copied().fold(0.0, f64::max);
        if length < STRIDE || widest == 0.0 {
            return false;
        }
        let moving: Vec<usize> = (0..spread.len())
            .filter(|&j| spread[j] > STILL * widest)
            .collect();
        let instants = length.div_ceil(STRIDE) as f64;
        let far: Vec<f64> = (spread.iter())
            .map(|spread| instants * (NEAR * spread).powi(2))
            .collect();
        let mut squares = vec![0.0; spread.len()];
        let mut found = |begin: usize| {
            others.iter().any(|other| {
                (0..(other.len() + 1).saturating_sub(length)).any(|lag| {
                    squares.fill(0.0);
                    (0..length).step_by(STRIDE).all(|i| {
                        moving.iter().all(|&j| {
                            let off = self.joints[j][begin + i] - other.joints[j][lag + i];
                            squares[j] += off * off;
                            squares[j] <= far[j]
                        })
                    })
                })
            })
        };
        let all = (0..windows).filter(|w| found(w * length)).count();
        all as f64 >= MOSTLY * windows as f64
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rig_data::prepare::InMemory;
    use rig_data::{Block, JointColumns};

    /// Two joints along sums of sines, `rate` rows per second from `from` to `to`, with noise of `noise` rad.
    fn run(seed: f64, rate: f64, from: f64, to: f64, faster: f64, noise: f64) -> InMemory {
        let t: Vec<f64> = (0..((to - from) * rate) as usize)
            .map(|i| from + i as f64 / rate)
            .collect();
        let q = |joint: f64| -> Vec<f64> {
            let of = |(i, t): (usize, &f64)| {
                let s = faster * t;
                (0.7 * s + seed + joint).sin()
                    + 0.5 * (1.9 * s * (1.0 + 0.1 * joint) + 2.0 * seed).sin()
                    + 0.3 * (4.3 * s + joint * seed).cos()
                    + noise * ((i * 7919 % 1000) as f64 / 500.0 - 1.0)
            };
            t.iter().enumerate().map(of).collect()
        };
        let joints = [0.0, 1.0].map(|joint| JointColumns {
            q: q(joint),
            ..Default::default()
        });
        InMemory {
            label: "run".into(),
            blocks: vec![Block {
                t: t.clone(),
                joints: joints.into(),
                first_line: 2,
                ..Default::default()
            }],
        }
    }

    #[test]
    fn the_same_motion_is_known_and_another_is_not() {
        let path = |recording: InMemory| Path::of(&recording, 0.7).unwrap();
        let learnt = [path(run(0.3, 200.0, 0.0, 60.0, 1.0, 0.0))];
        // Starts later, has another rate and noise.
        assert!(path(run(0.3, 130.0, 17.37, 52.0, 1.0, 0.05)).repeats(&learnt));
        // A tenth longer than the training motion.
        assert!(path(run(0.3, 200.0, 0.0, 66.0, 1.0, 0.0)).repeats(&learnt));
        for (what, other) in [
            ("other phases", run(1.1, 200.0, 0.0, 60.0, 1.0, 0.0)),
            ("another speed", run(0.3, 200.0, 0.0, 40.0, 1.3, 0.0)),
            ("what follows", run(0.3, 200.0, 60.0, 120.0, 1.0, 0.0)),
            ("nothing moves", run(0.3, 200.0, 5.0, 30.0, 0.0, 0.0)),
        ] {
            assert!(!path(other).repeats(&learnt), "{what}");
        }
    }
}
