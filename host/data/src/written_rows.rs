//! What all writers of recordings have in common: the columns, and the checks of their rows.

use std::io;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::error::DataError;
use rig_output::{format_short, temporary};

/// A column to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name as in the contract, for instance `tau1`.
    pub name: String,
    /// Unit, for instance `N*m`.
    pub unit: String,
}

impl Column {
    /// Creates a column from name and unit.
    pub fn new(name: &str, unit: &str) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
        }
    }
}

/// Common part of all formats: names, row counter and checks.
pub(crate) struct Rows {
    pub(crate) path: PathBuf,
    /// Temporary file until the recording is complete.
    pub(crate) hidden: PathBuf,
    pub(crate) names: Vec<String>,
    pub(crate) count: u64,
    /// Space for the text of a row.
    pub(crate) text: String,
}

impl Rows {
    /// Checks the columns, and opens the file that takes the name `path` when the recording is complete.
    pub(crate) fn start(
        path: &Path,
        columns: &[Column],
    ) -> Result<(Self, NamedTempFile), DataError> {
        let mut rows = Self::new(path, columns)?;
        let file = temporary(path).map_err(|e| rows.failed(e))?;
        rows.hidden = file.path().to_path_buf();
        Ok((rows, file))
    }

    fn new(path: &Path, columns: &[Column]) -> Result<Self, DataError> {
        let names: Vec<String> = columns.iter().map(|c| c.name.clone()).collect();
        let mut sorted = names.clone();
        sorted.sort();
        sorted.dedup();
        let plain =
            |n: &String| !n.is_empty() && !n.contains([',', '"', '\n', '\r']) && n.trim() == n;
        if names.first().map(String::as_str) != Some("t")
            || sorted.len() != names.len()
            || !names.iter().all(plain)
        {
            return Err(DataError::Header {
                path: path.into(),
                place: None,
                message: format!(
                    "columns cannot be called {names:?}; the first must be `t`, and all need different names without commas and quotes"
                ),
            });
        }
        Ok(Self {
            path: path.into(),
            hidden: PathBuf::new(),
            names,
            count: 0,
            text: String::new(),
        })
    }

    pub(crate) fn accept(&mut self, row: &[f64]) -> Result<(), DataError> {
        self.count += 1;
        let bad = |message| DataError::BadRow {
            path: self.path.clone(),
            row: self.count,
            message,
        };
        if row.len() != self.names.len() {
            return Err(bad(format!(
                "it has {} values, but there are {} columns",
                row.len(),
                self.names.len()
            )));
        }
        match self.names.iter().zip(row).find(|(_, v)| !v.is_finite()) {
            Some((name, value)) => Err(bad(format!(
                "column `{name}` is {}, but a recording holds finite numbers only",
                format_short(*value)
            ))),
            None => Ok(()),
        }
    }

    pub(crate) fn failed(&self, source: io::Error) -> DataError {
        DataError::Write {
            path: self.path.clone(),
            source,
        }
    }
}
