//! Documents and plots as files.

use std::path::Path;

use super::document::Document;
use super::error::ReportError;
use super::html::render;
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
