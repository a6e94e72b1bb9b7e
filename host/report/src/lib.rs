//! Documents of text, tables and plots, as one HTML file or as Markdown with pictures.
//!
//! Compose a [`Document`], then [`write()`] it. The page is self-contained and needs no network. Without JavaScript
//! every plot is a still picture; with JavaScript it can be zoomed. In print, everything is unfolded. The same document
//! gives the same bytes. Every text is escaped: a name from a file cannot become mark-up.
//!
//! [`markdown()`] and [`write_markdown`] give the same document as Markdown, with its figures as SVG files.
//!
//! [`svg`] and [`write_svg`] return one plot as a separate picture. [`assets`] holds what other pages share with these.
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

pub mod assets;
mod axis;
mod document;
mod error;
mod escape;
mod file;
mod heat_map;
mod html;
mod markdown;
mod plot;
mod scene;
mod svg;
mod text;
mod thin;

pub use document::{
    Alignment, Block, Column, Document, Fact, Link, NoteKind, Section, Table, Tone,
};
pub use error::ReportError;
pub use file::{remove_markdown, write, write_markdown, write_svg};
pub use heat_map::HeatMap;
pub use html::render;
pub use markdown::{Markdown, markdown};
pub use plot::{Axis, Direction, Marker, Plot, Role, Series, Style};
pub use svg::svg;
pub use text::text_tables;
pub use thin::thin;

#[cfg(test)]
mod tests;
