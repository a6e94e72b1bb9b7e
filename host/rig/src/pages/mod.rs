//! Reports: the figures, tables and sentences that show a result.
//!
//! This module only composes each page as a [`Document`](rig_report::Document). It computes no new results and uses no
//! files or clock.

mod compare;
mod compliance;
mod context;
mod control;
mod demo;
mod diagnosis;
mod estimators;
mod friction;
mod friction_map;
mod identification;
mod inspect;
mod load;
mod parts;
mod residuals;
mod run;
mod simulated;
#[cfg(test)]
mod tests;
mod treatment;
mod validation;
mod validation_voltage;

pub use compare::compare;
pub(crate) use compare::{SEE_IDENTIFY, same_torque};
pub use compliance::compliance;
pub use context::Context;
pub use control::control;
pub use demo::{
    DemoFigures, DemoParameter, Interval, OnlineEstimates, Tracking, Wire, demo, tracking_plot,
};
pub use diagnosis::{PICTURE_NAMES, diagnosis, pictures, verdict};
pub use friction_map::friction_map;
pub use identification::identification;
pub use inspect::{inspect, time_in_words, without_options};
pub use load::load;
pub use run::{RunStep, run};
pub use simulated::{simulated_overview, simulated_robot};
pub use validation::validation;
pub use validation_voltage::validation_voltage;
