//! Recordings given to a fit: their paths, their names in messages, and the checks before any work begins.

use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::sync::Arc;

use rig::commands::{CommandError, Inputs, Watched};
use rig_data::Block;
use rig_data::prepare::{PrepareError, Recording};
use rig_model::robot::Robot;

use crate::recording::RecordingFile;
use crate::watch::Watch;

/// Recordings for one use.
pub(crate) type Files = Vec<Arc<RecordingFile>>;

/// Returns the paths of recordings.
pub(crate) fn paths(files: &Files) -> Vec<PathBuf> {
    files.iter().map(|file| file.path().to_path_buf()).collect()
}

/// Replaces the paths of temporary files by the names of their recordings.
pub(crate) fn shown(files: &[&Files], text: &str) -> String {
    files
        .iter()
        .flat_map(|files| files.iter())
        .fold(text.to_owned(), |text, file| file.shown(&text))
}

/// Writes recordings as the argument of a call, for the section "Command" of a report.
pub(crate) fn argument(files: &Files) -> String {
    let list: Vec<String> = files.iter().map(|f| format!("{:?}", f.label())).collect();
    format!("[{}]", list.join(", "))
}

/// Refuses recordings whose columns are certainly wrong. Returns what looks wrong but does not stop the work.
///
/// # Errors
/// One sentence for each fault, unless `even_if_wrong`.
pub(crate) fn checked(
    robot: &Robot,
    inputs: &[&Inputs],
    more: Vec<String>,
    even_if_wrong: bool,
) -> Result<Vec<String>, CommandError> {
    let (mut wrong, mut remarks) = (Vec::new(), Vec::new());
    for recordings in inputs {
        let found = recordings.faults(robot)?;
        remarks.extend(found.doubtful);
        wrong.extend(found.wrong.into_iter().chain(found.described));
    }
    wrong.extend(more);
    if even_if_wrong {
        remarks.extend(wrong);
    } else if !wrong.is_empty() {
        return Err(CommandError::Implausible(format!(
            "{} Nothing was fitted; give even_if_wrong=True to fit in spite of this.",
            wrong.join(" ")
        )));
    }
    Ok(remarks)
}

/// Work on recordings that passes over them several times.
pub(crate) struct Passes<'a> {
    watch: &'a Watch,
    done: Cell<f64>,
    total: f64,
}

impl<'a> Passes<'a> {
    /// Begins work of `total` bytes.
    pub(crate) fn new(watch: &'a Watch, total: u64) -> Self {
        Self {
            watch,
            done: Cell::new(0.0),
            total: total.max(1) as f64,
        }
    }

    fn at(&self, more: f64) -> Result<(), PrepareError> {
        (self.watch.at((self.done.get() + more) / self.total))
            .map_err(|_| PrepareError::Stopped("The work was interrupted.".to_owned()))
    }
}

/// A recording that reports progress and can be interrupted while it is read.
pub(crate) struct Observed<'a> {
    inner: &'a Watched<'a>,
    passes: &'a Passes<'a>,
    bytes: f64,
    /// Rows of the recording, known after the first pass.
    rows: RefCell<Option<usize>>,
}

impl<'a> Observed<'a> {
    /// Wraps recordings of `bytes` bytes in all, counted as equally long.
    pub(crate) fn all(
        recordings: &'a [Watched<'a>],
        bytes: u64,
        passes: &'a Passes<'a>,
    ) -> Vec<Self> {
        (recordings.iter())
            .map(|inner| Self {
                inner,
                passes,
                bytes: bytes as f64 / recordings.len() as f64,
                rows: RefCell::new(None),
            })
            .collect()
    }

    fn share(&self, read: usize) -> f64 {
        match *self.rows.borrow() {
            Some(rows) if rows > 0 => self.bytes * (read as f64 / rows as f64).min(1.0),
            _ => 0.0,
        }
    }
}

impl Recording for Observed<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.inner)
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        let mut read = 0;
        let done = self.inner.each_block(rows, &mut |block| {
            self.passes.at(self.share(read))?;
            read += block.len();
            take(block)
        });
        let whole = self.rows.borrow().is_none_or(|rows| read >= rows);
        if done.is_ok() && whole {
            *self.rows.borrow_mut() = Some(read);
            self.passes.done.set(self.passes.done.get() + self.bytes);
        }
        done
    }

    fn passed(&self, share: f64) {
        let done = &self.passes.done;
        done.set(done.get() + share * self.bytes);
        // An interruption is kept and ends the next pass.
        let _ = self.passes.at(0.0);
    }
}
