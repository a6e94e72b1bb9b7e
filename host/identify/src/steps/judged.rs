//! Torque residuals of an estimate on training and hold-out recordings.

use super::planner::each_planned;
use super::recordings::Sets;
use crate::error::IdentifyError;
use crate::rows::plan::Plan;
use crate::rows::planned::Planned;
use crate::uncertainty::residual::ResidualReport;
use crate::uncertainty::torque_residuals::torque_residuals;
use crate::unmodelled::position::PositionTorque;
use rig_data::prepare::Survey;
use rig_model::robot::Robot;

/// The recordings by which an estimate is judged.
pub(crate) struct Judge<'a> {
    /// The robot of the fit.
    pub robot: &'a Robot,
    /// Torques by position that were subtracted before the fit.
    pub torques: &'a [PositionTorque],
    /// Values of all base columns.
    pub full: &'a [f64],
    /// The recordings of the fit.
    pub sets: &'a Sets<'a>,
    /// The recordings with the torque of effects, if it was subtracted.
    pub whole: Option<&'a Sets<'a>>,
}

impl Judge<'_> {
    /// Returns the residuals of the training recordings by joint.
    ///
    /// # Errors
    /// Reading errors.
    pub(crate) fn training(
        &self,
        surveys: &[Survey],
        plan: &Plan,
    ) -> Result<Vec<ResidualReport>, IdentifyError> {
        let whole = self.whole.map(|sets| Planned::all(&sets.training, plan));
        let fitted = Planned::all(&self.sets.training, plan);
        self.residuals(&fitted, surveys, whole.as_deref())
    }

    /// Returns the residuals of the hold-out by joint; none without one. `plans` are those of its recordings.
    ///
    /// # Errors
    /// Reading errors.
    pub(crate) fn holdout(
        &self,
        surveys: &[Survey],
        plans: &[Plan],
    ) -> Result<Option<Vec<ResidualReport>>, IdentifyError> {
        if self.sets.holdout.is_empty() {
            return Ok(None);
        }
        let whole = self.whole.map(|sets| each_planned(&sets.holdout, plans));
        let held = each_planned(&self.sets.holdout, plans);
        Ok(Some(self.residuals(&held, surveys, whole.as_deref())?))
    }

    fn residuals(
        &self,
        recordings: &[Planned],
        surveys: &[Survey],
        whole: Option<&[Planned]>,
    ) -> Result<Vec<ResidualReport>, IdentifyError> {
        let by_position = |j: usize, q: f64| -> f64 {
            let name = &self.robot.joints[j].name;
            let own = self.torques.iter().filter(|t| t.joint == *name);
            own.map(|t| t.torque(q)).sum()
        };
        torque_residuals(recordings, surveys, self.full, &by_position, whole)
    }
}
