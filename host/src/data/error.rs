//! What can be wrong with a recording.

use std::fmt;
use std::path::PathBuf;

/// Why a recording could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum DataError {
    /// The file cannot be opened or read.
    #[error("cannot read the recording {}: {source}; give the path of a .csv or .mcap file", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The path is a directory.
    #[error("{} is a directory, but a recording is one .csv or .mcap file", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
    },
    /// The path is a pipe or a device.
    #[error("{} is a pipe or a device, but a recording is gone through from its start more than once; save it as a .csv or .mcap file and give that", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// No byte, or nothing but empty lines.
    #[error("{} is empty, but a recording has a header line such as `t,q1,tau1` and one row per sample", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A header and nothing else.
    #[error("{} has a header but no rows; a recording has one row per sample below the header", path.display())]
    NoRows {
        /// The file.
        path: PathBuf,
    },
    /// Bytes that are no text.
    #[error("{}:{line}: this line is not text (it holds bytes that are not printable UTF-8), but a recording is CSV text or an MCAP file", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
    },
    /// A line without an end.
    #[error("{}:{line}: this line is longer than 1 MiB, but a recording has one sample per line", path.display())]
    LineTooLong {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
    },
    /// The header does not name what is needed.
    #[error("{}:1: {message}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// One sentence: what is there and what would be right.
        message: String,
    },
    /// A row with too few or too many fields.
    #[error("{}:{line}: this row has {found} fields, but the header names {expected} columns ({hint})", path.display())]
    FieldCount {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Fields of the row.
        found: usize,
        /// Columns of the header.
        expected: usize,
        /// The first column without a field, or the first field without a column.
        hint: String,
    },
    /// A field that is no finite number.
    #[error("{}:{line}: column `{column}` holds {found}, but it must be a finite number, in SI units and with a decimal point", path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Name of the column.
        column: String,
        /// What stands there.
        found: String,
    },
    /// Time that does not grow.
    #[error("{}:{line}: column `t` {verb} {previous} to {now} s, but time must grow from row to row", path.display(), verb = if now < previous { "jumps back from" } else { "stands still, from" })]
    TimeNotGrowing {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Time of the row before, s.
        previous: f64,
        /// Time of this row, s.
        now: f64,
    },
    /// Motor positions that no joint positions give.
    #[error("{}:{line}: the motor positions (columns `qm<k>`) of this row belong to no joint position: {message} The description's drives (ratios, screw, zero) or the recording's signs or units are wrong.", path.display())]
    Motors {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
        /// What cannot be turned to the joints, one sentence.
        message: String,
    },
    /// An MCAP file that is damaged or holds something else.
    #[error("{}: {message}", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// One sentence: what is there and what would be right.
        message: String,
    },
    /// The recording cannot be written.
    #[error("cannot write the recording {}: {source}; give a path in a folder that exists, may be written and has room", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system or the encoder said.
        source: std::io::Error,
    },
    /// The file's ending does not say which format.
    #[error("cannot tell the format of {} from its name; end it in .csv or .mcap", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Columns or a row that do not fit the recording to be written.
    #[error("cannot write row {row} of {}: {message}", path.display())]
    BadRow {
        /// The file.
        path: PathBuf,
        /// Row, counted from 1.
        row: u64,
        /// What is there and what would be right.
        message: String,
    },
}

/// Something about a recording that its reader should know and that does not stop the work.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Samples are missing; a new block begins.
    Gap {
        /// Line of the first row after the gap.
        line: u64,
        /// Time of the last row before it, s.
        from: f64,
        /// Time missing beyond one sample period, s.
        lost: f64,
    },
    /// An interval of a regular recording is too short or too long for its neighbours to be filtered together; a
    /// new block begins.
    Uneven {
        /// Line of the row after it.
        line: u64,
        /// The interval, s.
        step: f64,
        /// The usual one, s.
        period: f64,
    },
    /// One time stamp lies off the even grid, the rows before and after on it; the row is taken as evenly sampled.
    Misplaced {
        /// Line of the row.
        line: u64,
        /// How much later than the grid it is stamped, s.
        off: f64,
    },
    /// A column without meaning to the model holds something that is no number; it is NaN in
    /// [`super::Block::extra`].
    ExtraNotANumber {
        /// First line where that is so.
        line: u64,
        /// The column.
        column: String,
    },
    /// `duty<k>` is there but no `supply`, so that there is no voltage.
    DutyWithoutSupply {
        /// The column.
        column: String,
    },
}

impl Warning {
    /// Place of its kind, the gravest first, and how bad it is among that.
    pub fn rank(&self) -> (usize, f64) {
        match self {
            Self::Gap { lost, .. } => (0, *lost),
            Self::Uneven { step, period, .. } => (1, (step / period).ln().abs()),
            Self::Misplaced { off, .. } => (2, off.abs()),
            Self::ExtraNotANumber { .. } => (3, 0.0),
            Self::DutyWithoutSupply { .. } => (4, 0.0),
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gap { line, from, lost } => {
                write!(
                    f,
                    "line {line}: {lost:.6} s are missing after t = {from} s; the rows before and after are treated apart"
                )
            }
            Self::Uneven { line, step, period } => {
                write!(
                    f,
                    "line {line}: the time advances by {step:.6} s where {period:.6} s is usual; the rows before and after are treated apart"
                )
            }
            Self::Misplaced { line, off } => {
                write!(
                    f,
                    "line {line}: its time stamp lies {off:.6} s off the even grid that the rows around it keep; it is taken as evenly sampled"
                )
            }
            Self::ExtraNotANumber { line, column } => {
                write!(
                    f,
                    "line {line}: column `{column}` holds something that is no number; it has no meaning to the model and is kept as \"not a number\""
                )
            }
            Self::DutyWithoutSupply { column } => {
                write!(
                    f,
                    "column `{column}` gives a duty cycle but there is no column `supply`, so the motor voltage is not known"
                )
            }
        }
    }
}
