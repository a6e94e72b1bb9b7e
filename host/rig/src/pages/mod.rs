//! Reports: the figures, tables and sentences that show a result.
//!
//! This module only composes each page as a [`Document`](rig_report::Document). It computes no new results and uses no
//! files or clock.

mod demo;
mod diagnosis;
mod estimators;
mod friction_map;
mod identification;
mod parts;
#[cfg(test)]
mod tests;
mod validation;
mod validation_voltage;

pub use demo::{
    DemoFigures, DemoParameter, Interval, OnlineEstimates, Tracking, Wire, demo, tracking_plot,
};
pub use diagnosis::{PICTURE_NAMES, diagnosis, pictures, verdict};
pub use friction_map::friction_map;
pub use identification::identification;
pub use validation::validation;
pub use validation_voltage::validation_voltage;

/// Information on a page beside the result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Context {
    /// The command line that repeats the result.
    pub command: String,
    /// Name and text of the description that was written into the same folder.
    pub identified: Option<(String, String)>,
    /// Remarks about choices made to write that description.
    pub remarks: Vec<String>,
    /// Warnings from reading the recordings.
    pub warnings: Vec<String>,
}
