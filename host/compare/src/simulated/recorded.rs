//! Simulated recordings with noise and quantisation.

use rand::SeedableRng;
use rand_pcg::Pcg64;
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_excite::{ExciteError, Noise, Options, design, drawn, replay};
use rig_model::robot::Robot;
use rig_numerics::statistics::rms;

use super::options::SimulateOptions;

/// Standard deviation of the torque noise, as a share of the joint's RMS torque.
pub(super) const TORQUE_NOISE: f64 = 0.01;
/// Standard deviation of the noise of the position before it is quantised, rad or m.
pub(super) const POSITION_NOISE: f64 = 1e-5;
/// Encoder step of a joint whose description has none, rad or m.
const ENCODER_STEP: f64 = 1e-5;

/// A designed motion as it was recorded.
pub(super) struct Recorded {
    pub recording: InMemory,
    pub seconds: f64,
    pub condition_number: f64,
    /// RMS speed of the slowest joint, rad/s or m/s.
    pub slowest: f64,
    pub notes: Vec<String>,
}

/// Designs a motion and simulates it; `seed` draws motion and noise.
pub(super) fn recorded(
    robot: &Robot,
    options: &SimulateOptions,
    seed: u64,
    label: &str,
    progress: &mut dyn FnMut(f64),
) -> Result<Recorded, ExciteError> {
    let wanted = Options {
        harmonics: options.harmonics,
        periods: options.periods,
        starts: options.starts,
        seed,
        margin: 0.1,
        speed_share: 0.9,
        ..Options::default()
    };
    let part = |done: u64, total: u64| done as f64 / total.max(1) as f64;
    let motion = design(robot, &wanted, |done, total| {
        progress(0.7 * part(done, total))
    })?;
    let reference = motion.file.sampled(options.rate)?;
    let mut done = replay(robot, &reference, Noise::default(), seed, |done, total| {
        progress(0.7 + 0.3 * part(done, total));
    })?;
    let mut random = Pcg64::seed_from_u64(seed);
    for q in done.motion.q.iter_mut().flatten() {
        *q += drawn(&mut random, POSITION_NOISE);
    }
    for tau in &mut done.motion.tau {
        let deviation = TORQUE_NOISE * rms(tau);
        for tau in tau.iter_mut() {
            *tau += drawn(&mut random, deviation);
        }
    }
    let mut notes = motion.notes;
    notes.append(&mut done.notes);
    notes.extend(done.quantise(robot, Some(ENCODER_STEP)));
    let slowest = (done.motion.qd.iter())
        .map(|qd| rms(qd))
        .fold(f64::INFINITY, f64::min);
    let rows = done.motion.q.first().map_or(0, Vec::len);
    let joints = (done
        .motion
        .q
        .into_iter()
        .zip(done.motion.tau)
        .zip(done.reference))
    .map(|((q, tau), reference)| JointColumns {
        q,
        tau,
        reference: Some(reference.into_iter().take(rows).collect()),
        ..JointColumns::default()
    })
    .collect();
    let block = Block {
        t: (0..rows).map(|k| k as f64 * done.period).collect(),
        joints,
        first_line: 2,
        ..Block::default()
    };
    Ok(Recorded {
        recording: InMemory {
            label: label.to_owned(),
            blocks: vec![block],
        },
        seconds: rows as f64 * done.period,
        condition_number: motion.values.condition_number,
        slowest,
        notes,
    })
}
