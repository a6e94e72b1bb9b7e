//! Trajectories in files: their parameters as TOML, their samples as CSV.

mod read;
mod samples;
mod write;

use std::path::Path;

use rig_shared::trajectory::Trajectory;

use super::{Criterion, ExciteError};
use rig_model::robot::Robot;
use rig_output::write_whole;

pub use samples::{SampledReference, load_reference};

/// Size limit of a trajectory file; a thousand joints would fit.
const MAX_BYTES: u64 = 1 << 20;

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

    /// Reads a `.toml` trajectory.
    ///
    /// # Errors
    /// [`ExciteError`] with line and column of the error.
    pub fn load(path: &Path) -> Result<Self, ExciteError> {
        let failed = |source| ExciteError::Read {
            path: path.into(),
            source,
        };
        if std::fs::metadata(path).map_err(failed)?.len() > MAX_BYTES {
            return Err(ExciteError::TooLarge { path: path.into() });
        }
        let text = std::fs::read_to_string(path).map_err(failed)?;
        Self::from_toml(&text, path)
    }

    /// Writes `.toml` (parameters) or `.csv` (samples at `rate`, Hz): columns t, and per joint q, qd, qdd and the same
    /// positions again as ref, so that it can be read as a recording. The file is written completely or not at all.
    ///
    /// # Errors
    /// [`ExciteError`]: another file extension, or an error of the operating system.
    pub fn save(&self, path: &Path, robot: &Robot, rate: f64) -> Result<(), ExciteError> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("toml") => Ok(write_whole(path, self.to_toml(robot).as_bytes())?),
            Some("csv") => self.save_samples(path, robot, rate),
            _ => Err(ExciteError::UnknownFormat { path: path.into() }),
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
