//! A robot simulated from its description, identified off-line and on-line by both models, and compared with the truth.

mod online;
mod options;
mod prepared;
mod recorded;
mod result;
mod run;

pub use options::SimulateOptions;
pub use result::{
    Holdout, SimulatedEstimate, SimulatedRobot, SimulatedValue, SimulationError, TrueParameter,
};
pub use run::simulated;
