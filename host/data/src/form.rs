//! Form of a recording: a text file, a file of messages, or the files of a bag.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::bag::bag_files;
use super::error::DataError;
use super::foreign::{ForeignFormat, HEAD};
use super::mat;
use super::mat73;
use super::mcap_records::MAGIC;
use super::parquet;
use super::sqlite;

/// A file of arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrays {
    /// NumPy archive.
    NumPy,
    /// MATLAB file of version 5 to 7.2.
    Matlab,
    /// MATLAB file of version 7.3.
    Matlab73,
}

/// How the samples are stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// Text with a line for each sample.
    Csv,
    /// Arrays in one file.
    Arrays(Arrays),
    /// Parquet file.
    Parquet,
    /// Files of messages, MCAP or SQLite, in the order of recording.
    Messages(Vec<PathBuf>),
}

impl Form {
    /// Returns the form of a recording, from the first bytes of its file, and its length in bytes. A folder is a bag of
    /// rosbag2.
    pub(super) fn of(path: &Path) -> Result<(Self, u64), DataError> {
        if !(std::fs::metadata(path).map_err(|e| unreadable(path, e))?).is_dir() {
            return file(path);
        }
        let files = bag_files(path)?;
        let mut bytes = 0;
        for own in &files {
            let (form, length) = file(own)?;
            if !matches!(form, Self::Messages(_)) {
                return Err(DataError::Bag {
                    path: path.into(),
                    message: format!(
                        "{} is neither an MCAP nor an SQLite file; convert the bag with `ros2 bag convert` and storage_id mcap",
                        own.display()
                    ),
                });
            }
            bytes += length;
        }
        Ok((Self::Messages(files), bytes))
    }
}

fn unreadable(path: &Path, source: std::io::Error) -> DataError {
    DataError::Read {
        path: path.into(),
        source,
    }
}

/// Checks that a path names a regular file of a known format. Returns its form and its length in bytes.
fn file(path: &Path) -> Result<(Form, u64), DataError> {
    let failed = |source| unreadable(path, source);
    let metadata = std::fs::metadata(path).map_err(failed)?;
    // Opening a pipe without a writer would block forever.
    if !metadata.is_file() {
        return Err(DataError::NotAFile { path: path.into() });
    }
    let mut start = Vec::new();
    let mut head = File::open(path).map_err(failed)?.take(HEAD as u64);
    head.read_to_end(&mut start).map_err(failed)?;
    // By content, because file extensions are often wrong.
    let is = |magic: &[u8]| start.starts_with(magic);
    let form = if is(&MAGIC[..5]) || is(sqlite::MAGIC) {
        Form::Messages(vec![path.into()])
    } else if is(mat::MAGIC) {
        Form::Arrays(Arrays::Matlab)
    } else if is(mat73::MAGIC) {
        Form::Arrays(Arrays::Matlab73)
    } else if is(parquet::MAGIC) {
        Form::Parquet
    } else {
        match ForeignFormat::of(&start) {
            None => Form::Csv,
            Some(ForeignFormat::NumPyArchive) => Form::Arrays(Arrays::NumPy),
            Some(format) => {
                return Err(DataError::Foreign {
                    path: path.into(),
                    format,
                });
            }
        }
    };
    Ok((form, metadata.len()))
}
