//! Optional effects, each a block of parameters and its functions.

pub mod cogging;
pub mod dead_time;
pub mod disturbance;
pub mod drag;
pub mod encoder_eccentricity;
pub mod end_stops;
pub mod friction_warmup;
pub mod gear_eccentricity;
pub mod load_friction;
pub mod position_friction;
pub mod spring;
pub mod tilt;
pub mod torque_ripple;
pub mod torque_saturation;
pub mod transmission;
pub mod unequal_lines;
pub mod winding_temperature;
