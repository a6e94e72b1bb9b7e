//! Documents and plots as files.

use std::path::Path;

use super::document::Document;
use super::error::ReportError;
use super::html::render;
use super::markdown::{figure_name, markdown};
use super::plot::Plot;
use super::svg::svg;
use rig_output::write_whole;

/// Writes a document as one HTML file, atomically.
///
/// # Errors
/// [`ReportError`] if the document contradicts itself or the file cannot be written.
pub fn write(path: &Path, document: &Document) -> Result<(), ReportError> {
    replace(path, &render(document)?)
}

/// Writes a document as Markdown, its figures as SVG files beside it (`report-figure-1.svg` beside `report.md`), each
/// atomically. Figures of an earlier document of this name are removed.
///
/// # Errors
/// [`ReportError`] if the document contradicts itself, or a file cannot be written or removed.
pub fn write_markdown(path: &Path, document: &Document) -> Result<(), ReportError> {
    let made = markdown(document, &stem(path))?;
    remove_figures(path, made.figures.len())?;
    for (name, picture) in &made.figures {
        replace(&path.with_file_name(name), picture)?;
    }
    replace(path, &made.text)
}

/// Removes what [`write_markdown`] wrote, if anything.
///
/// # Errors
/// [`ReportError::File`] if a file cannot be removed.
pub fn remove_markdown(path: &Path) -> Result<(), ReportError> {
    remove_figures(path, 0)?;
    remove(path).map(|_| ())
}

/// Removes the figures with numbers above `kept`, up to the first number without a figure.
fn remove_figures(path: &Path, kept: usize) -> Result<(), ReportError> {
    let mut number = kept + 1;
    while remove(&path.with_file_name(figure_name(&stem(path), number)))? {
        number += 1;
    }
    Ok(())
}

/// Removes a file. Returns true if there was one.
fn remove(path: &Path) -> Result<bool, ReportError> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(false),
        Err(source) => Err(ReportError::File {
            path: path.into(),
            source,
        }),
    }
}

/// Returns the name of a file without its ending.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy());
    stem.map_or_else(String::new, std::borrow::Cow::into_owned)
}

/// Writes one plot as a standalone SVG file, atomically.
///
/// # Errors
/// [`ReportError`] if the plot contradicts itself or is empty, or if the file cannot be written.
pub fn write_svg(path: &Path, plot: &Plot) -> Result<(), ReportError> {
    replace(path, &svg(plot)?)
}

/// Replaces a file by a text in one step.
fn replace(path: &Path, text: &str) -> Result<(), ReportError> {
    write_whole(path, text.as_bytes()).map_err(|error| ReportError::File {
        path: error.path,
        source: error.cause,
    })
}
