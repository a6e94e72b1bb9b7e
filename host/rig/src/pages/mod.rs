//! Reports: which figures, tables and sentences a result is shown with.
//!
//! Every page is a [`Document`](rig_report::Document) composed here and nothing else: no computation that
//! a result does not already hold, no file, no clock.

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

/// What a page says beside its result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Context {
    /// The command line that repeats the result.
    pub command: String,
    /// Name and text of the description that was written beside the page.
    pub identified: Option<(String, String)>,
    /// What had to be decided to write that description.
    pub remarks: Vec<String>,
    /// What reading the recordings gave reason to say.
    pub warnings: Vec<String>,
}
