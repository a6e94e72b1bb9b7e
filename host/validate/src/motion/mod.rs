//! The simulated closed loop of model and controller compared with the recorded motion. Without a described controller,
//! the recorded torques drive the model.

mod check;
mod difference;
mod reference;
mod replay;
mod simulation;
mod stretch;

pub(crate) use check::check;
pub(crate) use simulation::Subject;
