//! A proposed motion on the rig of a scenario.

use super::reference::RATE;
use super::{Made, Scenario, rig};
use crate::diagnose::DiagnoseError;
use crate::excite::TrajectoryFile;
use crate::prepare::InMemory;

/// Time to come from rest where the link hangs to where the motion begins, and back, s.
const APPROACH: f64 = 2.0;
/// Number of the run; the scenario's own come before it.
const RUN: u64 = 3;

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
}
