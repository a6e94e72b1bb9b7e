//! Recordings of proposed experiments on the rig of a scenario.

use rig_shared::effects::Kind;

use super::error::ScenarioError;
use super::hidden::Effect;
use super::made::Made;
use super::record::{Manner, drive_off};
use super::reference::RATE;
use super::rig;
use super::scenario::{Scenario, drive_of};
use rig_data::prepare::InMemory;
use rig_excite::{COASTING, JointTrajectory, TrajectoryFile};

/// Time of the approach from rest at the hanging position to the start of the motion, and of the return, s.
const APPROACH: f64 = 2.0;
/// Number of the run; 0 to 2 belong to training and hold-out.
const RUN: u64 = 3;
/// Number of the recording with the drive off, and its length, s.
const OFF: (u64, f64) = (4, 2.0);

/// Returns the only joint of a proposed motion.
fn joint_of(file: &TrajectoryFile) -> Result<&JointTrajectory, ScenarioError> {
    (file.joints.first()).ok_or_else(|| ScenarioError("the proposed motion has no joint".into()))
}

/// Samples the references of a joint from the position `start` on for `duration` seconds.
fn sampled(own: &JointTrajectory, start: f64, duration: f64) -> impl Iterator<Item = f64> {
    let samples = (duration * RATE).ceil() as usize;
    (0..samples).map(move |k| start + own.trajectory.at(k as f64 / RATE).position)
}

impl Scenario {
    /// Records a motion on the rig of `made`, with approach from the hanging position and return to it. If the motion
    /// switches the drive off, the recording ends when the rig has come to rest.
    ///
    /// # Errors
    /// [`ScenarioError`] if the file has no joint.
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

    /// Records a motion with the motor shaft clamped at the hanging position.
    ///
    /// # Errors
    /// As [`proposed`](Self::proposed).
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

    /// Returns the same rig without external loads.
    pub fn unburdened(&self) -> Self {
        let outside =
            |effect: &Effect| Kind::from_name(effect.name(), None).is_some_and(Kind::is_external);
        Self {
            hidden: (self.hidden.iter().copied())
                .filter(|hidden| !outside(&hidden.effect))
                .collect(),
            ..self.clone()
        }
    }

    /// Records the rig of `made` with its drive off.
    ///
    /// # Errors
    /// [`ScenarioError`] if the description has no drive.
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
