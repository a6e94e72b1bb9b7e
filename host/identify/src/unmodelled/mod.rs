//! Effects that the description does not state.

pub(crate) mod beyond;
pub(crate) mod field_torque;
pub(crate) mod lag;
pub(crate) mod look_beyond;
pub(crate) mod position;
pub(crate) mod search;
pub(crate) mod term_rows;
pub(crate) mod terms;
pub(crate) mod tilt;
pub(crate) mod together;
