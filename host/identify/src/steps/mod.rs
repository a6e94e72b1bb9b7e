//! The steps of an identification.

pub(crate) mod below_zero;
pub(crate) mod check;
pub(crate) mod estimated;
pub(crate) mod freed;
pub(crate) mod further;
pub(crate) mod judged;
pub(crate) mod larger_residual;
pub(crate) mod named;
pub(crate) mod outcome;
pub(crate) mod own;
pub(crate) mod own_fit;
pub(crate) mod planner;
pub(crate) mod recordings;
pub(crate) mod results;
pub(crate) mod robot_model;
pub(crate) mod settled;
pub(crate) mod solve;
pub(crate) mod task;
pub(crate) mod torque_agreement;
pub(crate) mod torque_scale;
pub(crate) mod treated;
pub(crate) mod warnings;
