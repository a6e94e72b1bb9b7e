//! A proposed motion on the rig of a scenario.

use rig_shared::effects::Kind;

use super::record::{Manner, drive_off};
use super::reference::RATE;
use super::{Effect, Made, Scenario, drive_of, rig};
use crate::ScenarioError;
use rig_data::prepare::InMemory;
use rig_excite::{COASTING, JointTrajectory, TrajectoryFile};

/// Time to come from rest where the link hangs to where the motion begins, and back, s.
const APPROACH: f64 = 2.0;
/// Number of the run; the scenario's own come before it.
const RUN: u64 = 3;
/// … and of the log with the drive off, which lasts so long, s.
const OFF: (u64, f64) = (4, 2.0);

/// The one joint of a proposed motion.
fn joint_of(file: &TrajectoryFile) -> Result<&JointTrajectory, ScenarioError> {
    (file.joints.first()).ok_or_else(|| ScenarioError("the proposed motion has no joint".into()))
}

/// Its references from `start` on, for so long (s).
fn sampled(own: &JointTrajectory, start: f64, duration: f64) -> impl Iterator<Item = f64> {
    let samples = (duration * RATE).ceil() as usize;
    (0..samples).map(move |k| start + own.trajectory.at(k as f64 / RATE).position)
}

impl Scenario {
    /// Records a motion on the rig that `made` was recorded on, from rest where it hangs and back; of one in which the drive is
    /// switched off until it has come to rest.
    ///
    /// # Errors
    /// [`ScenarioError`] where the file has no joint.
    pub fn proposed(&self, made: &Made, file: &TrajectoryFile) -> Result<InMemory, ScenarioError> {
        let own = joint_of(file)?;
        let approach = (APPROACH * RATE) as usize;
        let there: Vec<f64> = (0..approach)
            .map(|k| {
                let s = k as f64 / approach as f64;
                own.start * s.powi(3) * (10.0 + s * (6.0 * s - 15.0))
            })
            .collect();
        let mut reference = there.clone();
        let Some(off) = file.drive_off else {
            reference.extend(sampled(own, own.start, own.trajectory.duration()));
            reference.extend(there.iter().rev());
            return self.recorded(made, &reference, Manner::Driven);
        };
        let from = approach + (off * RATE).ceil() as usize;
        reference.extend(sampled(own, own.start, off + COASTING));
        self.recorded(made, &reference, Manner::CoastingFrom(from))
    }

    /// Records a motion with the motor's shaft clamped where the link hangs.
    ///
    /// # Errors
    /// Those of [`proposed`](Self::proposed).
    pub fn clamped(&self, made: &Made, file: &TrajectoryFile) -> Result<InMemory, ScenarioError> {
        let own = joint_of(file)?;
        let reference: Vec<f64> = sampled(own, 0.0, own.trajectory.duration()).collect();
        self.recorded(made, &reference, Manner::Clamped)
    }

    fn recorded(
        &self,
        made: &Made,
        reference: &[f64],
        manner: Manner,
    ) -> Result<InMemory, ScenarioError> {
        let healthy = rig::healthy(self.seed, &self.noise);
        Ok(InMemory {
            label: "proposed".into(),
            blocks: vec![self.run(&healthy, &made.robot, reference, RUN, manner)?],
        })
    }

    /// The same rig with everything taken off that pulls on it from outside.
    pub fn unburdened(&self) -> Self {
        let outside =
            |effect: &Effect| Kind::named(effect.name(), None).is_some_and(Kind::is_external);
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
    /// [`ScenarioError`] where the description has no drive.
    pub fn drive_off(&self, made: &Made) -> Result<InMemory, ScenarioError> {
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
