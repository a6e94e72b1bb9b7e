//! Readings of the current sensor with the drive off. No current flows, so the reading is the sensor's zero.
//!
//! Leaves out: torque sensors, which read the load on the joint with the drive on or off.

use rig_shared::safety::Mode;

use crate::DiagnoseError;
use crate::error::NotDriveOff;
use rig_data::prepare::Recording;
use rig_numerics::statistics;

/// Shortest recording, s: slow changes need time to appear.
const SHORTEST: f64 = 0.5;
/// Largest motion of a joint whose recording does not say that its drive was off, rad or m.
const SWINGS: f64 = 0.05;
/// Pieces whose means give the uncertainty of the whole mean, for any correlation of noise within one.
const PIECES: usize = 10;
/// Least samples of a piece.
const LEAST: usize = 10;

/// Returns the mean of the recorded effort and its standard deviation, joint by joint, N·m or N.
///
/// # Errors
/// [`DiagnoseError::DriveOff`] if it is too short, was driven or moves without a column `mode`; errors of reading.
pub fn sensor_zeros(recording: &dyn Recording) -> Result<Vec<[f64; 2]>, DiagnoseError> {
    let label = recording.label();
    let wrong = |what: NotDriveOff| DiagnoseError::DriveOff {
        label: label.clone(),
        what,
    };
    let mut efforts: Vec<Vec<f64>> = Vec::new();
    let (mut seconds, mut driven, mut told) = (0.0, None, false);
    let mut ways: Vec<[f64; 2]> = Vec::new();
    recording.each_block(65_536, &mut |block| {
        efforts.resize(block.joints.len(), Vec::new());
        for (all, joint) in efforts.iter_mut().zip(&block.joints) {
            all.extend(&joint.tau);
        }
        ways.resize(block.joints.len(), [f64::INFINITY, f64::NEG_INFINITY]);
        for ([low, high], joint) in ways.iter_mut().zip(&block.joints) {
            (*low, *high) =
                (joint.q.iter()).fold((*low, *high), |(l, h), q| (l.min(*q), h.max(*q)));
        }
        if let (Some(first), Some(last)) = (block.t.first(), block.t.last()) {
            seconds += last - first;
        }
        let modes = (block.extra.iter()).filter(|(name, _)| name == "mode");
        told |= modes.clone().next().is_some();
        let drives = [Mode::Holding, Mode::Running, Mode::Stopping].map(|m| f64::from(m as u8));
        let mut on = modes
            .flat_map(|(_, values)| values)
            .filter(|m| drives.contains(m));
        driven = driven.or(on.next().copied());
        Ok(())
    })?;
    if let Some(mode) = driven {
        return Err(wrong(NotDriveOff::Driven {
            mode,
            disarmed: Mode::Disarmed as u8,
        }));
    }
    let moves = (ways.iter()).position(|[low, high]| high - low > SWINGS);
    if let (Some(joint), false) = (moves, told) {
        let [low, high] = ways[joint];
        return Err(wrong(NotDriveOff::Moves {
            joint: joint + 1,
            low,
            high,
        }));
    }
    let samples = efforts.iter().map(Vec::len).min().unwrap_or(0);
    if seconds < SHORTEST || samples < PIECES * LEAST {
        return Err(wrong(NotDriveOff::TooShort {
            seconds,
            samples,
            least_seconds: SHORTEST,
            least_samples: PIECES * LEAST,
        }));
    }
    Ok(efforts.iter().map(|all| mean_with_std(all)).collect())
}

/// Returns the mean and its standard deviation between pieces of equal length.
fn mean_with_std(all: &[f64]) -> [f64; 2] {
    let means: Vec<f64> = (all.chunks_exact(all.len() / PIECES).take(PIECES))
        .map(statistics::mean)
        .collect();
    let squares = statistics::squares_about(&means, statistics::mean(&means));
    let pieces = PIECES as f64;
    [
        statistics::mean(all),
        (squares / (pieces * (pieces - 1.0))).sqrt(),
    ]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use rig_data::prepare::InMemory;
    use rig_data::{Block, JointColumns};

    fn recorded(seconds: f64, mode: f64, seed: u64) -> InMemory {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let count = (seconds * 1000.0) as usize;
        let mut noise = 0.0;
        let tau = (0..count).map(|_| {
            let white: f64 = StandardNormal.sample(&mut random);
            noise = 0.9 * noise + 0.1 * white;
            0.2 + noise
        });
        InMemory {
            label: "rest.csv".into(),
            blocks: vec![Block {
                t: (0..count).map(|k| k as f64 * 1e-3).collect(),
                joints: vec![JointColumns {
                    q: vec![0.0; count],
                    tau: tau.collect(),
                    ..JointColumns::default()
                }],
                extra: vec![("mode".into(), vec![mode; count])],
                ..Block::default()
            }],
        }
    }

    /// Noise that is correlated over ten samples: its mean is three times less certain than that of white noise.
    #[test]
    fn the_mean_is_as_sure_as_it_says() {
        const RUNS: u64 = 300;
        let mut squares = 0.0;
        for seed in 0..RUNS {
            let zeros = sensor_zeros(&recorded(2.0, f64::from(Mode::Disarmed as u8), seed));
            let [value, std] = zeros.unwrap()[0];
            squares += ((value - 0.2) / std).powi(2) / RUNS as f64;
        }
        // The square of Student's t with nine degrees of freedom has the mean 9/7.
        assert!((0.9..1.8).contains(&squares), "{squares}");
    }

    #[test]
    fn a_joint_that_moves_was_driven_unless_its_mode_says_otherwise() {
        let mut moving = recorded(2.0, f64::from(Mode::Disarmed as u8), 1);
        for (q, t) in (moving.blocks[0].joints[0].q.iter_mut()).zip(0..) {
            *q = 0.3 * (0.01 * f64::from(t)).sin();
        }
        assert!(sensor_zeros(&moving).is_ok());
        moving.blocks[0].extra.clear();
        let text = sensor_zeros(&moving).unwrap_err().to_string();
        assert!(text.contains("joint 1 goes from -0.300 to 0.300"), "{text}");
    }

    #[test]
    fn a_driven_or_a_short_recording_is_refused_by_name() {
        let holding = f64::from(Mode::Holding as u8);
        let error = sensor_zeros(&recorded(2.0, holding, 1)).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("rest.csv") && text.contains("disarmed"),
            "{text}"
        );
        let off = f64::from(Mode::Disarmed as u8);
        let text = sensor_zeros(&recorded(0.3, off, 1))
            .unwrap_err()
            .to_string();
        assert!(text.contains("0.30 s") && text.contains("0.5 s"), "{text}");
    }
}
