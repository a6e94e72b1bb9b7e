//! Documents of text, tables and plots, and their one-file HTML form.
//!
//! Compose a [`Document`], then [`write()`] it. The page is self-contained and needs no network. Without JavaScript
//! every plot is a still picture; with JavaScript it can be zoomed. In print, everything is unfolded. The same document
//! gives the same bytes. Every text is escaped: a name from a file cannot become mark-up.
//!
//! [`svg`] and [`write_svg`] return one plot as a separate picture.
//!
//! ```
//! use rig_report::{Axis, Plot, Role, Series, svg};
//!
//! let t: Vec<f64> = (0..100).map(f64::from).collect();
//! let torque = t.iter().map(|t| (0.1 * t).sin()).collect();
//! let plot = Plot::new("Torque", Axis::new("time", "s"), Axis::new("torque", "N*m"))
//!     .with(Series::line("measured", Role::Measured, t, torque));
//! assert!(svg(&plot).unwrap().contains("<svg"));
//! ```

mod axis;
mod document;
mod escape;
mod html;
mod plot;
mod scene;
mod svg;
mod thin;

use std::path::{Path, PathBuf};

use rig_output::write_whole;

pub use document::{Alignment, Block, Column, Document, Fact, NoteKind, Section, Table, Tone};
pub use html::render;
pub use plot::{Axis, Direction, Marker, Plot, Role, Series, Style};
pub use svg::svg;
pub use thin::thin;

/// Why a document could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file could not be created or replaced.
    #[error(
        "{path} could not be written: {source}; check that its folder exists and may be written to."
    )]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// Columns of a series that differ in length.
    #[error(
        "The series \"{series}\" of the figure \"{figure}\" has {found} {what} but {expected} abscissae; each sample needs one of each."
    )]
    Lengths {
        /// Title of the figure.
        figure: String,
        /// Name of the series.
        series: String,
        /// Name of the column.
        what: &'static str,
        /// Length of the column.
        found: usize,
        /// Number of abscissae.
        expected: usize,
    },
    /// Equal aspect with a logarithmic axis.
    #[error(
        "The figure \"{figure}\" asks for equal scales and a logarithmic axis; only linear axes can have equal scales."
    )]
    Aspect {
        /// Title of the figure.
        figure: String,
    },
    /// A height that a page cannot hold.
    #[error(
        "The figure \"{figure}\" is to be {height} px high; heights from 120 to 2000 px are possible."
    )]
    Height {
        /// Title of the figure.
        figure: String,
        /// The requested height, px.
        height: u32,
    },
    /// No finite point in any series.
    #[error("The figure \"{figure}\" has no finite point to draw; give it at least one.")]
    NothingToDraw {
        /// Title of the figure.
        figure: String,
    },
    /// A row of a table whose length differs from the head.
    #[error(
        "Row {row} of the table \"{table}\" has {cells} cells; its {columns} columns need {columns}."
    )]
    Row {
        /// Caption of the table.
        table: String,
        /// Number of the row, from 1.
        row: usize,
        /// Number of its cells.
        cells: usize,
        /// Number of columns of the table.
        columns: usize,
    },
    /// An anchor of a section that is used twice or malformed.
    #[error(
        "The section id \"{id}\" is used twice or is not a letter followed by letters, digits, - and _; give each section its own."
    )]
    SectionId {
        /// The id.
        id: String,
    },
}

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

#[cfg(test)]
mod tests;
