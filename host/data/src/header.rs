//! Names of the columns of a file.

/// Columns of a file.
#[derive(Debug, Default)]
pub(super) struct Header {
    /// Names that determine the meaning of the columns.
    pub names: Vec<String>,
    /// Names for messages, one per column.
    pub labels: Vec<String>,
    /// Line of the header; `None` if the file has no lines.
    pub line: Option<u64>,
    /// Reason for the missing torque, if the file could have one.
    pub without_effort: Option<String>,
}

impl Header {
    /// Builds a header whose messages use the column names.
    pub(super) fn of(names: Vec<String>) -> Self {
        Self {
            labels: names.clone(),
            names,
            ..Self::default()
        }
    }
}
