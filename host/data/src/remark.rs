//! How an ambiguous file was read.

use super::place::Place;

/// An assumption or omission during reading; one sentence each.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Remark {
    /// A CSV file with a separator other than the comma.
    #[error("columns are separated by {separator}; a comma in a number is a decimal comma")]
    Separator {
        /// Name of the separator.
        separator: &'static str,
    },
    /// Quoted numbers with a decimal comma in a comma-separated file.
    #[error("line {line}: a comma in a quoted number is a decimal comma")]
    QuotedDecimalComma {
        /// First line with one.
        line: u64,
    },
    /// Lines before the header.
    #[error(
        "the header stands in line {}; what precedes it is empty or a comment and is passed over",
        before + 1
    )]
    Preamble {
        /// Last line before the header.
        before: u64,
    },
    /// The header follows a comment sign.
    #[error("line {line} begins with `{sign}` and names the columns: it is read as the header")]
    CommentedHeader {
        /// Its line.
        line: u64,
        /// `#` or `%`.
        sign: char,
    },
    /// Stamps that were rounded more coarsely than the clock of the rows.
    #[error(
        "the stamps are rounded to {} s, which is coarse beside the step of the rows: each row gets the time of an even clock within half of that",
        rig_output::format_short(*resolution)
    )]
    RoundedStamps {
        /// Resolution of the stamps, s.
        resolution: f64,
    },
    /// An MCAP file whose end is missing.
    #[error(
        "{} breaks off at byte {at}, as after a power loss or a recorder that was killed: {messages} messages are read, the last at t = {until} s; {lost}",
        file.as_deref().unwrap_or("the file"),
        until = rig_output::format_time(*until)
    )]
    CutOff {
        /// Name of the file, for a recording of several.
        file: Option<String>,
        /// Byte after the last complete record.
        at: u64,
        /// Messages that were read.
        messages: u64,
        /// Time of the last message, s.
        until: f64,
        /// Description of the loss.
        lost: &'static str,
    },
    /// A ROS topic with an unusual name.
    #[error("the joint states are read from topic {topic}")]
    Topic {
        /// The topic.
        topic: String,
    },
    /// Time of ROS messages.
    #[error("t is the header stamp of a message, counted from that of message 1 ({origin} s)")]
    Stamp {
        /// Stamp of the first message, seconds and nanoseconds.
        origin: String,
    },
    /// ROS messages without a stamp.
    #[error(
        "the header stamp of message 1 {stamp}: t is the time at which the recorder logged a message, counted from message 1 ({origin} s)"
    )]
    LogTime {
        /// Log time of the first message, seconds and nanoseconds.
        origin: String,
        /// Why the stamp is not used: "is zero", "is missing" or "is not used".
        stamp: &'static str,
    },
    /// Joint names with a prefix.
    #[error("the joints of topic {topic} are those of the robot behind the prefix \"{prefix}\"")]
    Prefix {
        /// The topic.
        topic: String,
        /// Text in front of the robot's names.
        prefix: String,
    },
    /// Joints that the robot does not have.
    #[error("joints that the robot has not are passed over: {joints}")]
    OtherJoints {
        /// Their names, quoted.
        joints: String,
    },
    /// Messages without any joint of the robot.
    #[error(
        "messages that hold no joint of the robot are passed over; the first is message {number} on {topic}, with {joints}"
    )]
    OtherMessages {
        /// The topic.
        topic: String,
        /// The first such message.
        number: u64,
        /// Its joints, quoted.
        joints: String,
    },
    /// A column of time with another name.
    #[error("the time is taken from column `{label}`, the only one that is named as a time")]
    TimeColumn {
        /// Its name in the file.
        label: String,
    },
    /// A unit that the file states.
    #[error("column `{label}` is converted from {unit}, as its name states")]
    StatedUnit {
        /// Its name in the file.
        label: String,
        /// The unit.
        unit: &'static str,
    },
    /// A unit that is not known.
    #[error(
        "column `{label}` is not read, because its unit `{unit}` is not known; units are {list}",
        list = crate::unit::Unit::list()
    )]
    UnknownUnit {
        /// Its name in the file.
        label: String,
        /// The text in its brackets.
        unit: String,
    },
    /// Times since 1970 in a unit that nothing states.
    #[error(
        "the times of column `{label}` are read as {unit}, because {why}; give --unit t=UNIT if they are not"
    )]
    LikelyTime {
        /// Its name in the file.
        label: String,
        /// The unit.
        unit: &'static str,
        /// The reason, one clause.
        why: &'static str,
    },
    /// A text file whose last line has no end.
    #[error(
        "line {line}, the last one, has no line end: the file may be cut off within a number, so this row is not used"
    )]
    CutRow {
        /// The line.
        line: u64,
    },
    /// A text file of few rows whose last line has no end; the row is used.
    #[error(
        "line {line}, the last one, has no line end: if the file was cut off, its last number may lack digits"
    )]
    OpenEnd {
        /// The line.
        line: u64,
    },
    /// Times that are counted from the first row.
    #[error("t is counted from the first row, because the times of the file are {what}")]
    CountedTime {
        /// Description of the times.
        what: &'static str,
    },
    /// Columns from a topic other than that of the rows.
    #[error(
        "{columns} are interpolated linearly to the times of the rows, from topic {topic} ({rate} Hz)"
    )]
    Interpolated {
        /// Names of the columns.
        columns: String,
        /// The topic.
        topic: String,
        /// Messages per second.
        rate: String,
    },
    /// Messages whose definition the recording does not hold.
    #[error("the recording holds no definition of {of}: the standard one of ROS is used")]
    StandardDefinition {
        /// Type of the messages.
        of: String,
    },
    /// Arrays that are no columns.
    #[error("these arrays are no columns: {names}")]
    OtherArrays {
        /// Names, with shapes of those that have another number of rows.
        names: String,
    },
    /// Columns of a Parquet file that hold no numbers.
    #[error("these columns are not read: {names}")]
    OtherColumns {
        /// Names, with what they hold.
        names: String,
    },
    /// Rows without a value of another topic.
    #[error(
        "{rows} rows are left out, because topic {topic} has no message before, after or near them; the first is message {first}"
    )]
    LeftOut {
        /// The topic.
        topic: String,
        /// Number of rows.
        rows: u64,
        /// The first one.
        first: u64,
    },
    /// A row of units behind the header.
    #[error("line {line} holds the units of the columns and is read as such")]
    UnitsRow {
        /// Its line.
        line: u64,
    },
    /// A unit of a row of units that is not that of SI.
    #[error("column `{label}` is converted from {unit}, as the row of units states")]
    RowUnit {
        /// Its name in the file.
        label: String,
        /// The unit.
        unit: &'static str,
    },
    /// A first column without a name that counts the rows.
    #[error(
        "column 1 has no name and counts the rows, as pandas writes it without `index=False`; it is left out"
    )]
    RowNumbers,
    /// Rows that repeat the row before.
    #[error(
        "{} left out; the first is {first}",
        match rows {
            1 => "1 row is an exact copy of the row before it (same time, same values) and is".to_owned(),
            n => format!("{n} rows are exact copies of the row before them (same time, same values) and are"),
        }
    )]
    Copies {
        /// Number of rows.
        rows: u64,
        /// The first one.
        first: Place,
    },
    /// Rows that are missing in an even clock.
    #[error("{} interpolated between the rows around them; the first is before {first}", missing_words(*rows, *places, *most))]
    MissingRows {
        /// Number of rows.
        rows: u64,
        /// Number of gaps.
        places: u64,
        /// Most rows in one gap.
        most: usize,
        /// The row after the first gap.
        first: Place,
    },
    /// Velocities that are not numbers.
    #[error(
        "the velocity of joint \"{joint}\" is NaN in the first message: the velocities are not read"
    )]
    NoVelocity {
        /// The joint.
        joint: String,
    },
}

/// Says how many rows are missing where.
fn missing_words(rows: u64, places: u64, most: usize) -> String {
    match (rows, places, most) {
        (1, ..) => "1 missing row is".to_owned(),
        (_, 1, _) => format!("{rows} missing rows in one gap are"),
        (_, _, 1) => format!("{rows} missing rows (one in a row) are"),
        _ => format!("{rows} missing rows in {places} gaps (up to {most} in a row) are"),
    }
}

impl Remark {
    /// Returns true if it tells why a column may be missing.
    pub(super) fn is_about_missing_columns(&self) -> bool {
        matches!(
            self,
            Self::OtherArrays { .. } | Self::OtherColumns { .. } | Self::UnknownUnit { .. }
        )
    }

    /// Returns the number of its kind, from 0.
    pub(super) fn kind(&self) -> usize {
        match self {
            Self::CutOff { .. } => 0,
            Self::OtherMessages { .. } => 1,
            Self::OtherJoints { .. } => 2,
            Self::NoVelocity { .. } => 3,
            Self::Topic { .. } => 4,
            Self::Stamp { .. } | Self::LogTime { .. } => 5,
            Self::Prefix { .. } => 6,
            Self::CommentedHeader { .. } => 7,
            Self::Preamble { .. } => 8,
            Self::Separator { .. } => 9,
            Self::QuotedDecimalComma { .. } => 10,
            Self::LeftOut { .. } => 11,
            Self::Interpolated { .. } => 12,
            Self::TimeColumn { .. } => 13,
            Self::StatedUnit { .. } => 14,
            Self::CountedTime { .. } => 15,
            Self::StandardDefinition { .. } => 16,
            Self::OtherArrays { .. } => 17,
            Self::UnknownUnit { .. } => 18,
            Self::LikelyTime { .. } => 19,
            Self::CutRow { .. } => 20,
            Self::OpenEnd { .. } => 21,
            Self::RoundedStamps { .. } => 22,
            Self::Copies { .. } => 23,
            Self::UnitsRow { .. } => 24,
            Self::RowUnit { .. } => 25,
            Self::RowNumbers => 26,
            Self::OtherColumns { .. } => 27,
            Self::MissingRows { .. } => 28,
        }
    }
}
