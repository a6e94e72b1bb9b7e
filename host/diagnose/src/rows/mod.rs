//! Regression rows of the recordings.

pub(crate) mod lanes;
pub(crate) mod motion;
pub(crate) mod nominal;
pub(crate) mod nominal_torque;
pub(crate) mod one_way;
pub(crate) mod regression;
pub(crate) mod row_weights;
pub(crate) mod standstill;
pub(crate) mod thinning;
