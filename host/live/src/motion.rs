//! The motion that the rig is to run.

use std::path::Path;

use rig_excite::{ExciteError, JointTrajectory, TrajectoryFile};
use rig_model::robot::Robot;
use rig_shared::wire::message::RequestBody;

/// A motion of the rig's one joint, read from a trajectory file.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Name of the file.
    pub name: String,
    /// The joint's motion.
    pub joint: JointTrajectory,
    /// Time after the start at which the bridge is switched off, s.
    pub drive_off: Option<f64>,
}

impl Motion {
    /// Takes a file with the motion of one joint.
    ///
    /// # Errors
    /// Several joints, or the joints of another robot.
    pub fn new(
        file: &TrajectoryFile,
        name: &str,
        robot: Option<&Robot>,
    ) -> Result<Self, ExciteError> {
        let path = Path::new(name);
        if let Some(robot) = robot {
            file.fits(robot, path)?;
        }
        let joint = file.only_joint(path)?;
        Ok(Self {
            name: name.to_owned(),
            joint: joint.clone(),
            drive_off: file.drive_off,
        })
    }

    /// Reads the text of a trajectory file.
    ///
    /// # Errors
    /// The error of the reader, with line and column.
    pub(crate) fn read(text: &str, name: &str, robot: Option<&Robot>) -> Result<Self, ExciteError> {
        let file = TrajectoryFile::from_toml(text, Path::new(name))?;
        Self::new(&file, name, robot)
    }

    /// Returns the request that loads it.
    pub(crate) fn request(&self) -> RequestBody {
        RequestBody::SetTrajectory(self.joint.trajectory.to_f32())
    }

    /// Returns how long it takes, s.
    pub(crate) fn duration(&self) -> f64 {
        let whole = self.joint.trajectory.duration();
        self.drive_off.map_or(whole, |off| off.min(whole))
    }
}
