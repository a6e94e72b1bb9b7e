//! Rows of files that hold arrays: NumPy archives and MATLAB files. The whole file is in memory.

use std::path::{Path, PathBuf};

use super::array::{Columns, columns};
use super::columns::Layout;
use super::error::DataError;
use super::form::Arrays;
use super::header::Header;
use super::place::Place;
use super::remark::Remark;
use super::{mat, mat73, npz};

/// Reader of rows.
pub(super) struct TableRows {
    path: PathBuf,
    columns: Columns,
    next: usize,
    bytes: u64,
}

/// Reads the columns of a file of arrays.
pub(super) fn table(path: &Path, form: Arrays) -> Result<(Columns, u64), DataError> {
    let failed = |source| DataError::Read {
        path: path.into(),
        source,
    };
    let file = std::fs::read(path).map_err(failed)?;
    let bytes = file.len() as u64;
    let read = match form {
        Arrays::NumPy => npz::arrays(&file),
        Arrays::Matlab => mat::arrays(&file),
        Arrays::Matlab73 => mat73::arrays(file),
    };
    let (arrays, others) = read.map_err(|message| DataError::Bag {
        path: path.into(),
        message,
    })?;
    let mut found = columns(arrays);
    found.others.extend(others);
    if found.names.is_empty() {
        return Err(DataError::Bag {
            path: path.into(),
            message: format!(
                "the {} holds no arrays of numbers that could be columns; give arrays t, q and tau of equally many rows",
                match form {
                    Arrays::NumPy => "NumPy archive",
                    Arrays::Matlab | Arrays::Matlab73 => "MATLAB file",
                }
            ),
        });
    }
    Ok((found, bytes))
}

impl TableRows {
    /// Opens a file.
    pub(super) fn open(path: &Path, form: Arrays) -> Result<(Self, Header), DataError> {
        let (columns, bytes) = table(path, form)?;
        let header = Header::of(columns.names.clone());
        let rows = Self {
            path: path.into(),
            columns,
            next: 0,
            bytes,
        };
        Ok((rows, header))
    }

    /// Returns the length of the file once it was read.
    pub(super) fn bytes_read(&self) -> u64 {
        let rows = self.columns.values.first().map_or(0, Vec::len).max(1) as f64;
        (self.bytes as f64 * (self.next as f64 / rows).min(1.0)) as u64
    }

    /// Returns the arrays that are no columns.
    pub(super) fn remarks(&self) -> Vec<Remark> {
        let others = &self.columns.others;
        let remark = (!others.is_empty()).then(|| Remark::OtherArrays {
            names: others.join(", "),
        });
        remark.into_iter().collect()
    }

    /// Reads the next row into `values`; returns its number from 1, or `None` at the end.
    pub(super) fn next_row(
        &mut self,
        layout: &Layout,
        values: &mut [f64],
    ) -> Result<Option<u64>, DataError> {
        let row = self.next;
        if self
            .columns
            .values
            .first()
            .is_none_or(|own| row >= own.len())
        {
            return Ok(None);
        }
        self.next += 1;
        let number = self.next as u64;
        for (place, own) in values.iter_mut().zip(&self.columns.values) {
            *place = own.get(row).copied().unwrap_or(f64::NAN);
        }
        match layout.refused(values) {
            Some((_, column, value)) => {
                Err(column.no_measurement(&self.path, Place::Row(number), value))
            }
            None => Ok(Some(number)),
        }
    }
}
