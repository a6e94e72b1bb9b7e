//! Models with effects: as descriptions, and as simulated motion.

pub(crate) mod bodies;
pub(crate) mod description;
pub(crate) mod observer_models;
pub(crate) mod output_error;
pub(crate) mod parameter_change;
pub(crate) mod payload;
pub(crate) mod remark;
pub(crate) mod rms_path;
pub(crate) mod simulated_motion;
pub(crate) mod tilt;
