//! Recordings of a scenario with their ground truth.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::error::ScenarioError;
use super::hidden::Hidden;
use super::written::write_all;
use rig_data::prepare::{InMemory, Recording, Unburdened};
use rig_model::robot::Robot;

/// Ground truth of a scenario's recordings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// Hidden effects.
    pub hidden: Vec<Hidden>,
    /// Nominal parameters of the rig, SI units, joint side.
    pub nominal: BTreeMap<&'static str, f64>,
    /// Seed of the scenario.
    pub seed: u64,
}

impl Truth {
    /// Names of the hidden effects.
    pub fn names(&self) -> Vec<&'static str> {
        self.hidden.iter().map(|h| h.effect.name()).collect()
    }
}

/// A scenario's recordings.
#[derive(Clone, Debug)]
pub struct Made {
    /// Description that the user has.
    pub robot: Robot,
    /// Training recording.
    pub train: InMemory,
    /// Second recording of the training motion.
    pub repeat: Option<InMemory>,
    /// Further training recordings, made later.
    pub further: Vec<InMemory>,
    /// Training recordings made after all external loads were removed.
    pub unburdened: Vec<InMemory>,
    /// Recording with the drive off; none unless requested.
    pub drive_off: Option<InMemory>,
    /// Recording with the motor's shaft clamped; none unless requested.
    pub clamped: Option<InMemory>,
    /// Hold-out recording of another motion.
    pub holdout: InMemory,
    /// Second recording of the hold-out motion, which gives its noise floor.
    pub held_again: Option<InMemory>,
    /// Ground truth.
    pub truth: Truth,
}

impl Made {
    /// Calls `take` with the training and the hold-out recordings, including repeats and later recordings.
    pub fn with_recordings<T>(
        &self,
        take: impl FnOnce(&[&dyn Recording], &[&dyn Recording]) -> T,
    ) -> T {
        let free: Vec<Unburdened> = self.unburdened.iter().map(|r| Unburdened(r)).collect();
        let training: Vec<&dyn Recording> = core::iter::once(&self.train)
            .chain(&self.repeat)
            .chain(&self.further)
            .map(|recording| recording as &dyn Recording)
            .chain(free.iter().map(|recording| recording as &dyn Recording))
            .collect();
        let held: Vec<&dyn Recording> = core::iter::once(&self.holdout)
            .chain(&self.held_again)
            .map(|recording| recording as &dyn Recording)
            .collect();
        take(&training, &held)
    }

    /// Writes `robot.toml`, `train.csv`, `repeat.csv`, `holdout.csv` and `holdout-again.csv` into a folder that exists.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ScenarioError> {
        let recordings = [
            ("train.csv", Some(&self.train)),
            ("repeat.csv", self.repeat.as_ref()),
            ("holdout.csv", Some(&self.holdout)),
            ("holdout-again.csv", self.held_again.as_ref()),
        ];
        write_all(folder, &self.robot, &recordings)
    }
}
