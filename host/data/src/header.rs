//! Names of the columns of a file.

use super::remark::Remark;
use super::unit::Unit;

/// Columns of a file.
#[derive(Debug, Default)]
pub(super) struct Header {
    /// Names that determine the meaning of the columns.
    pub names: Vec<String>,
    /// Names for messages, one per column.
    pub labels: Vec<String>,
    /// The part of each label that may state a unit; empty if all labels may.
    pub stems: Vec<String>,
    /// Line of the header; `None` if the file has no lines.
    pub line: Option<u64>,
    /// Unit of each column; `None` for that of SI. Empty if all have those of SI.
    pub units: Vec<Option<Unit>>,
    /// Units that a row behind the header states, one per column; empty without such a row.
    pub row_units: Vec<Unit>,
    /// Assumptions about names and units.
    pub remarks: Vec<Remark>,
    /// Reason for the missing torque, if the file could have one.
    pub without_effort: Option<String>,
}

impl Header {
    /// Returns the part of the label of column `k` that may state a unit.
    pub(super) fn stem(&self, k: usize) -> &str {
        let stem = self.stems.get(k).or_else(|| self.labels.get(k));
        stem.map_or("", String::as_str)
    }

    /// Builds a header whose messages use the column names.
    pub(super) fn of(names: Vec<String>) -> Self {
        Self {
            labels: names.clone(),
            names,
            ..Self::default()
        }
    }
}
