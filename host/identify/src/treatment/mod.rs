//! Treatment of the recordings, as decided from their data.

pub(crate) mod band;
pub(crate) mod clear_rows;
pub(crate) mod cutoff;
pub(crate) mod decide;
pub(crate) mod decimation;
pub(crate) mod left_out;
pub(crate) mod speed;
pub(crate) mod trial_rows;
pub(crate) mod window;
