//! Errors of a document.

use std::path::PathBuf;

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
    /// A heat map whose values do not fill its grid.
    #[error(
        "The heat map \"{figure}\" has {found} {what}, but {expected} are needed; it takes at least two rows and columns, and one value for each pair."
    )]
    Grid {
        /// Title of the figure.
        figure: String,
        /// What is counted.
        what: &'static str,
        /// Number found.
        found: usize,
        /// Number needed.
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
