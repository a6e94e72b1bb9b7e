//! Writes the figures of a diagnosis as separate files.

use std::path::Path;

use super::error::CommandError;
use crate::pages;
use crate::pages::PICTURE_NAMES;
use rig_diagnose::outcome::Diagnosis;
use rig_report::{self, ReportError};

/// Upper bound on the number of figures of one kind.
const MOST: usize = 64;

/// Writes the figures and removes those of an earlier result.
///
/// # Errors
/// A figure that cannot be drawn, a file that cannot be written or removed.
pub(super) fn write(out: &Path, found: &Diagnosis) -> Result<(), CommandError> {
    let all = PICTURE_NAMES
        .iter()
        .flat_map(|kind| (1..=MOST).map(move |k| format!("{kind}-{k}.svg")));
    for old in all {
        forget(&out.join(old))?;
    }
    for (name, plot) in &pages::pictures(found) {
        match rig_report::write_svg(&out.join(name), plot) {
            // The report shows a sentence in its place.
            Err(ReportError::NothingToDraw { .. }) => {}
            written => written?,
        }
    }
    Ok(())
}

/// Removes a file of an earlier result, so that nobody takes it for a part of the new one.
///
/// # Errors
/// A file that cannot be removed.
pub(super) fn forget(path: &Path) -> Result<(), CommandError> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(CommandError::Sentence(
            format!("{} cannot be removed: {error}.", path.display()),
        )),
        _ => Ok(()),
    }
}
