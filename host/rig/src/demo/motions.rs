//! The motions of the demonstration.

use rig_shared::trajectory::{SlowReversals, Trajectory};

use super::error::DemoError;
use rig_model::robot::Robot;
use rig_plant::emulated::friction_sweep;

/// Speed of the slow reversals that test the precompensation, rad/s.
const SLOW: f64 = 0.05;

/// The motions of the demonstration, each relative to the link's first position.
pub(super) struct Motions {
    /// Excitation whose recording is identified.
    pub(super) training: Trajectory<f64>,
    /// Another excitation, for the hold-out.
    pub(super) holdout: Trajectory<f64>,
    /// Constant speeds, for the friction map.
    pub(super) sweep: Trajectory<f64>,
    /// Slow reversals, for the precompensation.
    pub(super) reversals: Trajectory<f64>,
}

impl Motions {
    /// Designs the motions for a robot that starts at `home`, rad.
    ///
    /// # Errors
    /// A motion cannot be designed.
    pub(super) fn new(robot: &Robot, seed: u64, home: f64) -> Result<Self, DemoError> {
        Ok(Self {
            training: excitation(robot, seed, home)?,
            holdout: excitation(robot, seed + 1, home)?,
            sweep: sweep()?,
            reversals: reversals()?,
        })
    }
}

/// The optimal excitation from `home`, rad.
fn excitation(robot: &Robot, seed: u64, home: f64) -> Result<Trajectory<f64>, DemoError> {
    let options = rig_excite::Options {
        start: Some(vec![home]),
        seed,
        ..rig_excite::Options::default()
    };
    let design = rig_excite::design(robot, &options, |_, _| ())?;
    Ok(design.file.joints[0].trajectory.clone())
}

fn sweep() -> Result<Trajectory<f64>, DemoError> {
    friction_sweep()
        .map(Trajectory::FrictionSweep)
        .ok_or_else(|| {
            DemoError::Sentence("The friction sweep cannot be built from its speeds.".into())
        })
}

fn reversals() -> Result<Trajectory<f64>, DemoError> {
    SlowReversals::new(SLOW, 0.1, &[0.1, 0.05], 3)
        .map(Trajectory::SlowReversals)
        .ok_or_else(|| {
            DemoError::Sentence("The slow reversals cannot be built from their speed.".into())
        })
}
