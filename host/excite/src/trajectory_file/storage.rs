//! Trajectory files on the disk.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::content::TrajectoryFile;
use super::foreign::foreign;
use crate::ExciteError;
use rig_model::robot::Robot;
use rig_output::write_whole;

/// Size limit of a trajectory file; a thousand joints would fit.
const MAX_BYTES: u64 = 1 << 20;
/// Bytes by which the kind of a file is recognised: its first lines.
const BEGINNING: u64 = 4096;

impl TrajectoryFile {
    /// Reads a `.toml` trajectory.
    ///
    /// # Errors
    /// [`ExciteError::NoParameters`] if the file holds something else; [`ExciteError`] with line and column of the error.
    pub fn load(path: &Path) -> Result<Self, ExciteError> {
        let failed = |source| ExciteError::Read {
            path: path.into(),
            source,
        };
        let mut beginning = Vec::new();
        let file = File::open(path).map_err(failed)?;
        (file.take(BEGINNING).read_to_end(&mut beginning)).map_err(failed)?;
        if let Some(found) = foreign(&beginning) {
            return Err(ExciteError::NoParameters {
                path: path.into(),
                found,
            });
        }
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
            Some("csv") => self.sampled(rate)?.save(path, robot),
            _ => Err(ExciteError::UnknownFormat { path: path.into() }),
        }
    }
}
