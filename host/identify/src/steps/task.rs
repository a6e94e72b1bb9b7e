//! What is identified, and from what.

use rig_shared::multibody::COLUMNS;

use crate::options::Options;
use rig_data::prepare::Recording;
use rig_model::robot::Robot;

/// Robot, recordings and settings of an identification.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    /// The robot as described.
    pub described: &'a Robot,
    /// Recordings of the fit.
    pub training: &'a [&'a dyn Recording],
    /// Recordings that only judge the fit.
    pub holdout: &'a [&'a dyn Recording],
    /// Settings.
    pub options: &'a Options,
    /// Standard parameters that the effects use, one row per joint.
    pub beside: &'a [[f64; COLUMNS]],
}
