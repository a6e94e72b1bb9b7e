//! A proposed motion on the rig of a scenario.

use rig_shared::effects::Kind;

use super::record::drive_off;
use super::reference::RATE;
use super::{Effect, Made, Scenario, drive_of, rig};
use crate::diagnose::DiagnoseError;
use crate::diagnose::pull::is_outside;
use crate::excite::TrajectoryFile;
use crate::prepare::InMemory;

/// Time to come from rest where the link hangs to where the motion begins, and back, s.
const APPROACH: f64 = 2.0;
/// Number of the run; the scenario's own come before it.
const RUN: u64 = 3;
/// … and of the log with the drive off, which lasts so long, s.
const OFF: (u64, f64) = (4, 2.0);

impl Scenario {
    /// Records a motion on the rig that `made` was recorded on, from rest where it hangs and back.
    ///
    /// # Errors
    /// [`DiagnoseError::Scenario`] where the file has no joint.
    pub fn proposed(&self, made: &Made, file: &TrajectoryFile) -> Result<InMemory, DiagnoseError> {
        let own = (file.joints.first())
            .ok_or_else(|| DiagnoseError::Scenario("the proposed motion has no joint".into()))?;
        let approach = (APPROACH * RATE) as usize;
        let there: Vec<f64> = (0..approach)
            .map(|k| {
                let s = k as f64 / approach as f64;
                own.start * s.powi(3) * (10.0 + s * (6.0 * s - 15.0))
            })
            .collect();
        let samples = (own.trajectory.duration() * RATE).ceil() as usize;
        let motion = (0..samples).map(|k| own.start + own.trajectory.at(k as f64 / RATE).position);
        let reference: Vec<f64> = (there.iter().copied())
            .chain(motion)
            .chain(there.iter().rev().copied())
            .collect();
        let healthy = rig::healthy(self.seed, &self.noise);
        Ok(InMemory {
            label: "proposed".into(),
            blocks: vec![self.run(&healthy, &made.robot, &reference, RUN)?],
        })
    }

    /// The same rig with everything taken off that pulls on it from outside.
    pub fn unburdened(&self) -> Self {
        let outside = |effect: &Effect| Kind::named(effect.name(), None).is_some_and(is_outside);
        Self {
            hidden: (self.hidden.iter().copied())
                .filter(|hidden| !outside(&hidden.effect))
                .collect(),
            ..self.clone()
        }
    }

    /// Records the rig that `made` was recorded on with its drive off.
    ///
    /// # Errors
    /// [`DiagnoseError::Scenario`] where the description has no drive.
    pub fn drive_off(&self, made: &Made) -> Result<InMemory, DiagnoseError> {
        let (run, seconds) = OFF;
        let config = self.hiding(&rig::healthy(self.seed, &self.noise));
        let samples = (seconds * RATE) as usize;
        Ok(InMemory {
            label: "drive off".into(),
            blocks: vec![drive_off(
                config,
                drive_of(&made.robot)?,
                samples,
                self.seed_of(run),
            )],
        })
    }
}
