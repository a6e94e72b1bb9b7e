//! The page of the demonstration: the emulated rig, identified by firmware and host.

mod figures;
mod missing;
mod online;
mod page;
mod parameters;
mod tracking;

pub use figures::{DemoFigures, DemoParameter, Interval, OnlineEstimates, Tracking, Wire};
pub use page::demo;
pub use tracking::tracking_plot;
