//! Place of a finding in a recording.

use std::fmt;
use std::path::Path;

use super::block::Block;

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

/// A row of a recording by its time, and by its place where that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowAt {
    /// s
    pub t: f64,
    /// Its place in the file; `None` for rows that come from no file.
    pub place: Option<Place>,
}

impl RowAt {
    /// Returns a row of a block. Its place is that of a text file; [`Self::placed`] gives that of another one.
    pub(super) fn of(block: &Block, row: usize) -> Self {
        Self {
            t: block.t.get(row).copied().unwrap_or(f64::NAN),
            place: (block.first_line > 0).then(|| Place::Line(block.line(row))),
        }
    }

    /// Returns the row with the place that `place` gives for its number.
    pub(super) fn placed(self, place: &dyn Fn(u64) -> Place) -> Self {
        let number = |own: Place| match own {
            Place::Line(number) | Place::Message(number) | Place::Row(number) => number,
        };
        Self {
            place: self.place.map(|own| place(number(own))),
            ..self
        }
    }
}

impl fmt::Display for RowAt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "t = {} s", rig_output::format_time(self.t))?;
        self.place.map_or(Ok(()), |place| write!(f, " ({place})"))
    }
}
