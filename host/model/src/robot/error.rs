//! Faults of a robot description.

use std::fmt;
use std::path::PathBuf;

/// Largest robot description that is read. The largest published URDF files have a hundredth of this size.
pub const MAX_BYTES: u64 = 16 << 20;

/// A place in a text file, 1-based.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
}

impl Place {
    /// Returns the place of a byte offset in `text`.
    pub fn of(text: &str, offset: usize) -> Self {
        let mut end = offset.min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &text[..end];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        Self {
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// Why a robot description could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// The file cannot be opened or read.
    #[error("cannot read the robot description {}: {source}; give the path of a .toml, .urdf or .xml (MJCF) file", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Message of the operating system.
        source: std::io::Error,
    },
    /// The file of a load cannot be opened or read.
    #[error("cannot read the load {}: {source}; give a TOML file with mass, first_moment and inertia", path.display())]
    ReadLoad {
        /// The file.
        path: PathBuf,
        /// Message of the operating system.
        source: std::io::Error,
    },
    /// The path is a directory.
    #[error("{} is a directory, but a robot description is one file: .toml, .urdf or .xml (MJCF)", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
    },
    /// By its name the file is a recording.
    #[error("{} is a recording by its name, but a robot description (.toml, .urdf or .xml) is wanted here; are two files exchanged?", path.display())]
    Recording {
        /// The file.
        path: PathBuf,
    },
    /// The file is larger than any description.
    #[error("{} is larger than {} MiB, but a robot description is a short text (.toml, .urdf or .xml); is this a recording?", path.display(), MAX_BYTES >> 20)]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// The file is not text.
    #[error("{}:{line}: this line is not text (byte {offset} of the file is neither UTF-8 nor printable, nor of the encoding that the file declares), but a robot description is TOML or URDF text; save it as UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Offset of the first byte that is not text, from 0.
        offset: usize,
        /// Line, from 1.
        line: usize,
    },
    /// The file has no content.
    #[error("{} is empty, but a robot description needs at least one joint; `rig init one-link` writes one to start from", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// TOML that does not parse or does not have the keys and types of a robot description.
    #[error("{}:{place}: {message}", path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// One sentence: the text found and the correction.
        message: String,
    },
    /// A value that parses but cannot be right.
    #[error("{}:{place}: {what} is {found}, but {advice}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// The quantity.
        what: String,
        /// The value found.
        found: String,
        /// The correction.
        advice: String,
    },
    /// XML or URDF that does not describe a serial robot.
    #[error("{}:{place}: {message}", path.display())]
    Urdf {
        /// The file.
        path: PathBuf,
        /// Where.
        place: Place,
        /// One sentence: the text found and the correction.
        message: String,
    },
    /// The chain that was chosen in a URDF file does not exist.
    #[error("{}: {message}", path.display())]
    Chain {
        /// The file.
        path: PathBuf,
        /// One sentence: the choice and the correction.
        message: String,
    },
    /// The description holds an effect that could not be read back.
    #[error("robot `{robot}` cannot be written: {message}")]
    Write {
        /// The robot.
        robot: String,
        /// The effect, its fault, and the correction.
        message: String,
    },
    /// The description cannot be put into URDF.
    #[error("joint `{joint}` {why}; the robot cannot be written as URDF")]
    NotUrdf {
        /// The joint.
        joint: String,
        /// The missing item, as the rest of a sentence about the joint.
        why: String,
    },
    /// The work does not cover an axis that follows a joint.
    #[error(
        "{what} does not cover robots in which one drive turns several axes, and here `{follower}` follows joint `{joint}` (<mimic> of a URDF, [[follower]] of a TOML); end the chain before it, or hold both with --lock"
    )]
    Followers {
        /// The work, as the subject of a sentence.
        what: String,
        /// The follower.
        follower: String,
        /// The joint that it follows.
        joint: String,
    },
}
