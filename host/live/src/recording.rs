//! Recordings that are switched on and off while the rig is watched.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rig_data::{Column, DataError, RecordingWriter};
use rig_link::{COLUMNS, Row, UNITS};

/// A recording that is being written.
pub(crate) struct Recording {
    writer: RecordingWriter,
    path: PathBuf,
    samples: u64,
    missing: u64,
}

impl Recording {
    /// Starts `live-1.csv` in `folder`, or the first higher number that is not taken.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn start(folder: &Path) -> Result<Self, DataError> {
        let columns: Vec<Column> = (COLUMNS.iter().zip(UNITS))
            .map(|(name, unit)| Column::new(name, unit))
            .collect();
        let path = (1u32..)
            .map(|k| folder.join(format!("live-{k}.csv")))
            .find(|path| path.symlink_metadata().is_err())
            .unwrap_or_else(|| folder.join("live.csv"));
        Ok(Self {
            writer: RecordingWriter::create(&path, &columns, &BTreeMap::new())?,
            path,
            samples: 0,
            missing: 0,
        })
    }

    pub(crate) fn push(&mut self, row: &Row) -> Result<(), DataError> {
        self.writer.push_row(&row.values())?;
        self.samples += 1;
        Ok(())
    }

    /// Counts samples that the line lost.
    pub(crate) fn lose(&mut self, missing: u64) {
        self.missing += missing;
    }

    /// Completes the file; returns a sentence about it.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(self) -> Result<String, DataError> {
        self.writer.finish()?;
        Ok(format!(
            "{}: {} samples, {} missing.",
            self.path.display(),
            self.samples,
            self.missing
        ))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the hidden name of the file until it is complete.
    pub(crate) fn temporary(&self) -> &Path {
        self.writer.temporary()
    }

    /// Returns the numbers of written and of missing samples.
    pub(crate) fn counts(&self) -> (u64, u64) {
        (self.samples, self.missing)
    }
}
