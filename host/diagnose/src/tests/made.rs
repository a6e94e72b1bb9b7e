//! Diagnoses of simulated recordings, for tests.
#![allow(clippy::unwrap_used)]

use rig_model::robot::Robot;
use rig_scenario::Made;

use crate::{Diagnosis, Options, diagnose};

pub(crate) trait Diagnosed {
    /// Diagnosis of these recordings and a description.
    fn diagnosed(&self, robot: &Robot, options: &Options) -> (Diagnosis, Robot);
}

impl Diagnosed for Made {
    fn diagnosed(&self, robot: &Robot, options: &Options) -> (Diagnosis, Robot) {
        self.with_recordings(|training, held| {
            diagnose(robot, training, held, options, &mut |_| ()).unwrap()
        })
    }
}
