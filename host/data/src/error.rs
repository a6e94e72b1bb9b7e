//! Errors and warnings about a recording.

use std::fmt;
use std::path::PathBuf;

use super::foreign::ForeignFormat;
use super::place::Place;
use super::remark::Remark;
use rig_output::{format_short, format_time};

/// Why a recording could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum DataError {
    /// The file cannot be opened or read.
    #[error("cannot read the recording {}: {source}; give the path of a .csv or .mcap file", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The path is a directory.
    #[error("{} is a directory without metadata.yaml, but a recording is one .csv or .mcap file, or a folder that rosbag2 wrote", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
    },
    /// A folder of rosbag2 that cannot be read.
    #[error("{}: {message}", path.display())]
    Bag {
        /// The folder.
        path: PathBuf,
        /// One sentence: what was found and what is correct.
        message: String,
    },
    /// The path is a pipe or a device.
    #[error("{} is a pipe or a device, but a recording is gone through from its start more than once; save it as a .csv or .mcap file and give that", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// No bytes, or only empty lines.
    #[error("{} is empty, but a recording has a header line such as `t,q1,tau1` and one row per sample", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A header without rows.
    #[error("{} has a header but no rows; a recording has one row per sample below the header", path.display())]
    NoRows {
        /// The file.
        path: PathBuf,
    },
    /// Rows were stamped on arrival, several at a time.
    #[error("{}: rows come in bursts of {rows}, as where they are stamped when they arrive ({rate} Hz in the mean, no row missing); stamp them where they are measured, or number them and write t = number / {rate}", path.display())]
    Bursts {
        /// The file.
        path: PathBuf,
        /// Number of rows in a burst.
        rows: usize,
        /// Mean number of rows per second.
        rate: String,
    },
    /// A file of another program.
    #[error("{} is {format}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The format, and how to convert it.
        format: ForeignFormat,
    },
    /// Bytes that are not text.
    #[error("{}:{line}: this line is not text (it holds bytes that are not printable UTF-8), but a recording is CSV text or an MCAP file; save text as UTF-8", path.display())]
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
    /// The header lacks a required column.
    #[error("{}: {message}", place.map_or_else(|| path.display().to_string(), |p| p.in_file(path)))]
    Header {
        /// The file.
        path: PathBuf,
        /// Line of the header; `None` if the file has no lines.
        place: Option<Place>,
        /// One sentence: what was found and what is correct.
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
    /// A quotation mark that is not closed.
    #[error("{}:{line}: a quotation mark in this line is not closed; close it or take it out", path.display())]
    OpenQuote {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
    },
    /// Numbers with a decimal comma beside others with a decimal point.
    #[error("{}:{line}: column `{column}` holds \"{found}\" with a decimal {}, but earlier numbers have a decimal {}; use the same in the whole file", path.display(), if *is_comma { "comma" } else { "point" }, if *is_comma { "point" } else { "comma" })]
    MixedDecimals {
        /// The file.
        path: PathBuf,
        /// Line.
        line: u64,
        /// Name of the column.
        column: String,
        /// Text of the number.
        found: String,
        /// True if this number has the comma.
        is_comma: bool,
    },
    /// A number too large for a measurement.
    #[error("{}: column `{column}` holds {}, but {} is no {quantity}; look for a damaged or misread value", place.in_file(path), format_short(*value), format_short(*value))]
    OutOfRange {
        /// The file.
        path: PathBuf,
        /// Line or message.
        place: Place,
        /// Name of the column.
        column: String,
        /// The value.
        value: f64,
        /// Quantity that the column measures.
        quantity: &'static str,
    },
    /// A field that is not a finite number.
    #[error("{}: column `{column}` holds {found}, but it must be a finite number, in SI units and with a decimal point", place.in_file(path))]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// Line or message.
        place: Place,
        /// Name of the column.
        column: String,
        /// Text of the field.
        found: String,
    },
    /// Time that does not grow.
    #[error("{}: column `t` {}, but time must grow from row to row{hint}{}", place.in_file(path), not_growing(*previous, *now), same_time(*previous, *now))]
    TimeNotGrowing {
        /// The file.
        path: PathBuf,
        /// Line or message.
        place: Place,
        /// Time of the row before, s.
        previous: f64,
        /// Time of this row, s.
        now: f64,
        /// Possible cause, after a semicolon; empty if none is known.
        hint: &'static str,
    },
    /// Motor positions that belong to no joint positions.
    #[error("{}: the motor positions (columns `qm<k>`) of this row belong to no joint position: {message} The description's drives (ratios, screw, zero) or the recording's signs or units are wrong.", place.in_file(path))]
    Motors {
        /// The file.
        path: PathBuf,
        /// Line or message.
        place: Place,
        /// Reason why the conversion fails, one sentence.
        message: String,
    },
    /// A mapping of channels to columns that is wrong, or does not fit the file.
    #[error("{message}")]
    Mapping {
        /// One sentence: what was found and what is correct.
        message: String,
    },
    /// An MCAP file that is damaged or holds something else.
    #[error("{}: {message}", path.display())]
    Mcap {
        /// The file.
        path: PathBuf,
        /// One sentence: what was found and what is correct.
        message: String,
    },
    /// The recording cannot be written.
    #[error("cannot write the recording {}: {source}; give a path in a folder that exists, may be written and has room", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system or the encoder.
        source: std::io::Error,
    },
    /// The file extension names no known format.
    #[error("cannot tell the format of {} from its name; end it in .csv, .mcap or .parquet", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Columns or a row that do not fit the recording being written.
    #[error("cannot write row {row} of {}: {message}", path.display())]
    BadRow {
        /// The file.
        path: PathBuf,
        /// Row, counted from 1.
        row: u64,
        /// What was found and what is correct.
        message: String,
    },
}

impl DataError {
    /// Adds to an error about columns what the remarks say about missing ones.
    pub(super) fn explained<'a>(mut self, remarks: impl IntoIterator<Item = &'a Remark>) -> Self {
        if let Self::Header { message, .. } | Self::Mapping { message } = &mut self {
            let about = |remark: &&Remark| remark.is_about_missing_columns();
            for remark in remarks.into_iter().filter(about) {
                message.push_str(&format!("; {remark}"));
            }
        }
        self
    }
}

/// Describes how time fails to grow.
fn not_growing(previous: f64, now: f64) -> String {
    let (from, to) = (format_time(previous), format_time(now));
    if now == previous {
        format!("stands still at {to} s")
    } else if from == to {
        format!("jumps back by {} s at {to} s", format_short(previous - now))
    } else {
        format!("jumps back from {from} to {to} s")
    }
}

/// Says what to do about two rows of the same time, after a semicolon; empty if the time jumps back.
fn same_time(previous: f64, now: f64) -> &'static str {
    match now == previous {
        true => {
            "; its values are not those of the row before, so it is no copy of it: give each row the time of its measurement, or keep one row of each time"
        }
        false => "",
    }
}

/// A remark about a recording that does not stop the work.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Samples are missing; a new block starts.
    Gap {
        /// The first row after the gap.
        place: Place,
        /// Time of the last row before it, s.
        from: f64,
        /// Time missing beyond one sample period, s.
        lost: f64,
    },
    /// An interval of a regular recording is too short or too long to filter its neighbours together; a new block
    /// starts.
    Uneven {
        /// The row after the interval.
        place: Place,
        /// The interval, s.
        step: f64,
        /// The usual interval, s.
        period: f64,
    },
    /// One time stamp is off the even grid between rows on it; the row counts as evenly sampled.
    Misplaced {
        /// The row.
        place: Place,
        /// Time by which the stamp is later than the grid, s.
        off: f64,
    },
    /// A column without a meaning for the model holds a value that is not a number; it is NaN in
    /// [`super::Block::extra`].
    ExtraNotANumber {
        /// First row with such a value.
        place: Place,
        /// The column.
        column: String,
    },
    /// `duty<k>` without `supply`, so there is no voltage.
    DutyWithoutSupply {
        /// The column.
        column: String,
    },
    /// How an ambiguous file was read.
    Reading {
        /// The assumption or omission.
        remark: Remark,
    },
}

impl Warning {
    /// Returns true if the times of the rows are uneven.
    pub fn is_of_time(&self) -> bool {
        matches!(
            self,
            Self::Gap { .. } | Self::Uneven { .. } | Self::Misplaced { .. }
        )
    }

    /// Returns the rank of its kind (the most serious first) and its severity within that kind.
    pub fn rank(&self) -> (usize, f64) {
        match self {
            Self::Gap { lost, .. } => (0, *lost),
            Self::Uneven { step, period, .. } => (1, (step / period).ln().abs()),
            Self::Misplaced { off, .. } => (2, off.abs()),
            Self::ExtraNotANumber { .. } => (3, 0.0),
            Self::DutyWithoutSupply { .. } => (4, 0.0),
            Self::Reading { remark } => (5 + remark.kind(), 0.0),
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gap { place, from, lost } => {
                write!(
                    f,
                    "{place}: {lost:.6} s are missing after t = {} s; the rows before and after are treated apart",
                    format_time(*from)
                )
            }
            Self::Uneven {
                place,
                step,
                period,
            } => {
                write!(
                    f,
                    "{place}: the time advances by {step:.6} s where {period:.6} s is usual; the rows before and after are treated apart"
                )
            }
            Self::Misplaced { place, off } => {
                write!(
                    f,
                    "{place}: its time stamp lies {off:.6} s off the even grid that the rows around it keep; it is taken as evenly sampled"
                )
            }
            Self::ExtraNotANumber { place, column } => {
                write!(
                    f,
                    "{place}: column `{column}` holds something that is no number; it has no meaning to the model and is kept as \"not a number\""
                )
            }
            Self::DutyWithoutSupply { column } => {
                write!(
                    f,
                    "column `{column}` gives a duty cycle but there is no column `supply`, so the motor voltage is not known"
                )
            }
            Self::Reading { remark } => write!(f, "{remark}"),
        }
    }
}
