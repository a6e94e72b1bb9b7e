//! Results of the search, as the report needs them.

use crate::acceptance::coordinates::Coordinate;
use crate::description::parameter_prior::ParameterPrior;
use crate::fit::least_squares::Fit;
use crate::models::simulated_motion::Positions;
use crate::rows::nominal::Nominal;
use crate::rows::one_way::OneWay;
use crate::rows::regression::Rows;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::Search;
use rig_data::runs::Run;
use rig_model::robot::Robot;

/// Results of the search.
pub(crate) struct Found<'a, 'r> {
    /// Robot as given.
    pub(crate) robot: &'a Robot,
    /// Base parameters of the robot.
    pub(crate) nominal: &'a Nominal,
    /// Free base parameters.
    pub(crate) anchor: &'a ParameterPrior,
    /// Candidate library with the training data.
    pub(crate) search: &'a Search<'r>,
    /// Training data minus the torque of held parameters.
    pub(crate) rows: &'a Rows,
    /// Nominal model fitted to them.
    pub(crate) base: &'a Fit<'r>,
    /// Description with the found effects.
    pub(crate) model: &'a Robot,
    /// All effects, those of the description first.
    pub(crate) chosen: &'a [FittedCandidate],
    /// Number of effects from the description.
    pub(crate) described: usize,
    /// Coordinates of the training data, joint by joint.
    pub(crate) coordinates: &'a [Vec<Coordinate>],
    /// Noise floor, joint by joint.
    pub(crate) floors: &'a [f64],
    /// … obtained without a model; NaN if unknown.
    pub(crate) known: &'a [f64],
    /// Seed of the bootstrap.
    pub(crate) seed: u64,
    /// Sensor readings with the drive off, if recorded.
    pub(crate) sensor_zeros: &'a [[f64; 2]],
    /// Joints that move in one direction only.
    pub(crate) one_way: &'a [OneWay],
    /// Recordings to draw.
    pub(crate) drawn: Drawn<'a>,
}

impl<'a> Found<'a, '_> {
    /// Returns the effects that the description does not state.
    pub(crate) fn found(&self) -> &'a [FittedCandidate] {
        &self.chosen[self.described..]
    }
}

/// Recordings and the models' torque residuals, joint by joint over the rows.
pub(crate) struct Drawn<'a> {
    /// In the order of the rows.
    pub(crate) runs: &'a [Run],
    /// Rows of the recordings.
    pub(crate) rows: &'a Rows,
    /// Residuals of the refitted description and of the model with all effects.
    pub(crate) left: [Vec<Vec<f64>>; 2],
    /// Simulated positions of the same models, run by run; empty if not simulated.
    pub(crate) motion: [Vec<Positions>; 2],
}
