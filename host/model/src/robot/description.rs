//! Descriptions read from files, and written.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use nalgebra::Vector3;

use super::encoding::{Decoded, decoded};
use super::error::{MAX_BYTES, RobotError};
use super::serial_robot::Robot;
use super::urdf::{self, Audit, ChainChoice, Original};
use super::{dh, mjcf, text, written};

impl Robot {
    /// Reads a description. The extension selects TOML or URDF; for other extensions the first character does.
    pub fn load(path: &Path) -> Result<Self, RobotError> {
        Ok(Description::load(path)?.robot)
    }

    /// Reads TOML text; `path` only names the source in messages. [`Description::load`] also returns the remarks.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, RobotError> {
        Ok(text::read(text, path)?.0)
    }

    /// Reads URDF text (serial chain; fixed joints are merged) and converts it to modified
    /// Denavit–Hartenberg frames; `path` only names the source in messages.
    ///
    /// Every joint keeps the URDF's zero and positive sense: z of its frame is the URDF axis.
    pub fn from_urdf(text: &str, path: &Path) -> Result<Self, RobotError> {
        let chain = urdf::read(text, path, &ChainChoice::default())?;
        let robot = dh::convert(&chain).robot;
        urdf::check_units(&chain, &robot, path)?;
        Ok(robot)
    }

    /// Returns the description as TOML with units in comments. [`Robot::from_toml`] reads back an equal description.
    pub fn to_toml(&self) -> Result<String, RobotError> {
        written::write(self)
    }
}

/// Endings of recordings.
const RECORDINGS: [&str; 6] = ["csv", "mcap", "npz", "mat", "db3", "bag"];

/// A file that describes a robot.
#[derive(Debug)]
pub struct Description {
    /// The robot.
    pub robot: Robot,
    /// The file itself, if it is URDF.
    pub urdf: Option<Original>,
    /// Remarks for the user, one sentence each.
    pub remarks: Vec<String>,
    /// Those of the remarks that need no action.
    pub notes: Vec<String>,
}

impl Description {
    /// Reads a description. The extension selects TOML or URDF; for other extensions the first character does. XML whose
    /// outermost element is `<mujoco>` is MJCF.
    ///
    /// # Errors
    /// [`RobotError`] with the fault of the file and its line.
    pub fn load(path: &Path) -> Result<Self, RobotError> {
        Self::load_chain(path, &ChainChoice::default())
    }

    /// As [`Self::load`], for the chain that `choice` selects in the tree of a URDF file.
    ///
    /// # Errors
    /// [`RobotError`] with the fault of the file and its line, or of the choice.
    pub fn load_chain(path: &Path, choice: &ChainChoice) -> Result<Self, RobotError> {
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase);
        if extension
            .as_deref()
            .is_some_and(|own| RECORDINGS.contains(&own))
            && path.is_file()
        {
            return Err(RobotError::Recording { path: path.into() });
        }
        let (text, from) = read_text(path)?;
        let urdf = match extension.as_deref() {
            Some("toml") => false,
            Some("urdf") => true,
            _ => text.trim_start().starts_with('<'),
        };
        if !urdf && *choice != ChainChoice::default() {
            return Err(RobotError::Chain {
                path: path.into(),
                message: "--base, --tip and --lock choose a chain of a URDF file, but this file is TOML; leave them out".into(),
            });
        }
        if !urdf {
            let (robot, mut remarks) = text::read(&text, path)?;
            remarks.extend(robot.implausible_bodies(None));
            remarks.extend(robot.limits_in_degrees());
            remarks.extend(robot.velocities_out_of_reach());
            remarks.extend(robot.unlikely_values());
            return Ok(Self {
                remarks,
                robot,
                urdf: None,
                notes: Vec::new(),
            });
        }
        if mjcf::is_mjcf(&text) {
            return Self::of_mjcf(&text, path, choice);
        }
        let original = Original::read_chain(text, path, choice)?;
        let robot = original.robot().clone();
        let mut remarks = original.remarks().to_vec();
        remarks.extend(from.map(|name| {
            format!(
                "{} was read as {name}; a URDF that is written from it is UTF-8.",
                path.display()
            )
        }));
        remarks.extend(robot.implausible_bodies(Some(&original)));
        let mut notes = original.notes().to_vec();
        notes.extend(robot.massless_bodies(Some(&original)));
        remarks.extend(robot.limits_in_degrees());
        remarks.extend(robot.unlikely_values());
        Ok(Self {
            robot,
            urdf: Some(original),
            remarks,
            notes,
        })
    }
}

impl Description {
    /// Reads the text of an MJCF file.
    fn of_mjcf(text: &str, path: &Path, choice: &ChainChoice) -> Result<Self, RobotError> {
        let mjcf::Read { chain, gravity } = mjcf::read(text, path, choice)?;
        let converted = dh::convert(&chain);
        let mut robot = converted.robot;
        let turned = converted.base.rotation.inverse() * Vector3::from(gravity);
        robot.gravity = turned.into();
        let mut remarks = chain.remarks;
        remarks.extend(converted.remarks);
        remarks.extend(robot.implausible_bodies(None));
        let mut notes = converted.notes;
        notes.extend(robot.massless_bodies(None));
        remarks.extend(robot.unlikely_values());
        Ok(Self {
            robot,
            urdf: None,
            remarks,
            notes,
        })
    }
}

/// Checks the values of a URDF file. `choice` selects the chain whose inertia matrix is checked, at poses drawn with `seed`.
///
/// # Errors
/// [`RobotError`] if the file cannot be read or is no URDF.
pub fn audit_file(path: &Path, choice: &ChainChoice, seed: u64) -> Result<Audit, RobotError> {
    let (text, _) = read_text(path)?;
    urdf::audit(&text, path, choice, seed)
}

/// Reads the whole file as text. Returns its encoding too if that is not UTF-8. Refuses a directory, and a file that is
/// too large, empty or not text.
fn read_text(path: &Path) -> Result<(String, Option<&'static str>), RobotError> {
    let failed = |source| RobotError::Read {
        path: path.into(),
        source,
    };
    if std::fs::metadata(path).map_err(failed)?.is_dir() {
        return Err(RobotError::Directory { path: path.into() });
    }
    let mut bytes = Vec::new();
    // One byte more than allowed: this detects an oversized file even if its length is unknown.
    let mut limited = File::open(path).map_err(failed)?.take(MAX_BYTES + 1);
    limited.read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(RobotError::TooLarge { path: path.into() });
    }
    let Decoded { text, from } = decoded(&bytes).map_err(|wrong| RobotError::NotText {
        path: path.into(),
        offset: wrong.offset,
        line: wrong.line,
    })?;
    if text.trim().is_empty() {
        return Err(RobotError::Empty { path: path.into() });
    }
    Ok((text, from))
}
