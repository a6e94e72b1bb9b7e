//! The closed loop of a model and its controller.

mod acting;
mod closed_loop;
mod controllers;
mod elastic;
#[cfg(test)]
mod elastic_tests;
mod error;
mod friction;
mod history;
mod link_map;
mod link_motion;
mod load_wrench;
#[cfg(test)]
mod mixed_tests;
mod model;
mod solve;
mod step;
#[cfg(test)]
mod tests;

pub use closed_loop::{Inputs, Motion, closed_loop, closed_loop_since, closed_loop_watched};
pub use controllers::{STAND_IN_BANDWIDTH, controllers};
pub use error::{Light, SimulateError, TooStiff};
pub use history::Since;
pub use link_motion::LinkMotion;
pub use load_wrench::LoadWrench;
pub use model::{Model, Motors};
pub use step::Stepper;
