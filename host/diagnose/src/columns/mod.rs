//! Torque of each effect along the measured motion.

pub(crate) mod candidate;
pub(crate) mod effect_columns;
pub(crate) mod kinds;
pub(crate) mod slopes;
pub(crate) mod transmission;
pub(crate) mod wave_orders;
pub(crate) mod waves;
