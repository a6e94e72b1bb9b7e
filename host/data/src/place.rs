//! Place of a finding in a recording.

use std::fmt;
use std::path::Path;

/// A row of a recording, as its user finds it in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text file, from 1.
    Line(u64),
    /// Message of its topic in an MCAP file, from 1.
    Message(u64),
    /// Row of arrays, from 1.
    Row(u64),
}

impl Place {
    /// Returns the place with its file in front: `a.csv:3` or `a.mcap, message 3`.
    pub fn in_file(self, path: &Path) -> String {
        match self {
            Self::Line(line) => format!("{}:{line}", path.display()),
            Self::Message(number) => format!("{}, message {number}", path.display()),
            Self::Row(row) => format!("{}, row {row}", path.display()),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Message(number) => write!(f, "message {number}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}
