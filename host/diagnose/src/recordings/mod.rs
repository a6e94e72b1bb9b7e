//! Recordings as they are used: samples left out, noise floor, torque lead.

pub(crate) mod clamped;
pub(crate) mod coherence;
pub(crate) mod context;
pub(crate) mod disturbance;
pub(crate) mod drive_off;
pub(crate) mod encoder_zero;
pub(crate) mod external_load;
pub(crate) mod intake;
pub(crate) mod noise_floor;
pub(crate) mod outlier_segment;
pub(crate) mod position_reading;
pub(crate) mod resampling;
pub(crate) mod rest_rows;
pub(crate) mod sampling;
pub(crate) mod torque_lead;
pub(crate) mod torque_limits;
