//! The content of a trajectory file.

use std::path::Path;

use rig_shared::trajectory::Trajectory;

use crate::{Criterion, ExciteError};
use rig_model::robot::Robot;

/// Recorded time after the drive is switched off, s: a geared joint stops within one, a free link swings several times.
pub const COASTING: f64 = 5.0;

/// The motion of all joints of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryFile {
    /// Name of its robot.
    pub robot: String,
    /// The optimisation, if the motion was optimised.
    pub design: Option<DesignRecord>,
    /// Time after the start at which the drive is switched off so that the joint coasts, s.
    pub drive_off: Option<f64>,
    /// One entry per joint, in the robot's order.
    pub joints: Vec<JointTrajectory>,
}

/// Record of a motion's optimisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignRecord {
    /// Optimised criterion.
    pub criterion: Criterion,
    /// The criterion's value.
    pub value: f64,
    /// Condition number of the weighted and scaled regressor, see [`Values`](crate::Values).
    pub condition_number: f64,
    /// Seed of the starts.
    pub seed: u64,
}

/// The motion of one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointTrajectory {
    /// Name of the joint.
    pub name: String,
    /// Position at its start and end, rad or m; the trajectory is relative to it.
    pub start: f64,
    /// The motion.
    pub trajectory: Trajectory<f64>,
}

impl TrajectoryFile {
    /// Returns the duration of the longest joint motion, s.
    pub fn duration(&self) -> f64 {
        self.joints
            .iter()
            .map(|j| j.trajectory.duration())
            .fold(0.0, f64::max)
    }

    /// Returns the motion of the only joint.
    ///
    /// # Errors
    /// [`ExciteError::SeveralJoints`]; `path` names the file in it.
    pub fn only_joint(&self, path: &Path) -> Result<&JointTrajectory, ExciteError> {
        match self.joints.as_slice() {
            [joint] => Ok(joint),
            several => Err(ExciteError::SeveralJoints {
                path: path.into(),
                joints: several.len(),
            }),
        }
    }

    /// Checks that the file's joints are the robot's, by name and in order.
    ///
    /// # Errors
    /// [`ExciteError::OtherRobot`]; `path` names the file in it.
    pub fn fits(&self, robot: &Robot, path: &Path) -> Result<(), ExciteError> {
        let found: Vec<&str> = self.joints.iter().map(|j| j.name.as_str()).collect();
        let expected: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
        if found == expected {
            return Ok(());
        }
        Err(ExciteError::OtherRobot {
            path: path.into(),
            robot: robot.name.clone(),
            found: format!("the joints {}", found.join(", ")),
            expected: expected.join(", "),
        })
    }
}
