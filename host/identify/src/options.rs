//! Settings of an identification.

use serde::{Deserialize, Serialize};

use crate::estimator::{Estimator, Loss};
use rig_data::prepare::PrepareOptions;

/// Which equations are fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelKind {
    /// Torque as a function of acceleration, velocity and position.
    #[default]
    Differential,
    /// One joint: work equals change of energy over a window. Several joints: impulse equals change of momentum, one
    /// equation per joint. Needs no acceleration.
    Integral,
}

/// Settings of an identification.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The equations to fit.
    pub model: ModelKind,
    /// The estimator.
    pub estimator: Estimator,
    /// Loss of the robust estimator.
    pub loss: Loss,
    /// Filters, decimation, masks.
    pub prepare: PrepareOptions,
    /// Window length of the integral model, s; chosen from the motion if absent. Unused by the differential model.
    pub window: Option<f64>,
    /// Seed of the random states used to find the base parameters.
    pub seed: u64,
    /// How many times each training recording counts; recordings beyond the end of the list count once.
    pub recording_weights: Vec<f64>,
    /// Relative uncertainty of the described inertial values, for [`Estimator::has_prior`] and the standard parameters
    /// of several joints. If absent, `ridge` maximises the likelihood of the data and everything else uses 2.
    pub prior_uncertainty: Option<f64>,
    /// Further estimators to compare; empty for no comparison.
    pub compare: Vec<Estimator>,
    /// Searches for springs, ripple and a tilted base if several joints are described with all their links. If false,
    /// the description is used unchanged.
    pub look_beyond: bool,
}

impl Options {
    /// Returns the factor for the rows of training recording `r`: the root of its weight, because squares are summed.
    pub fn row_weight(&self, r: usize) -> f64 {
        self.recording_weights.get(r).map_or(1.0, |w| w.sqrt())
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            model: ModelKind::default(),
            estimator: Estimator::default(),
            loss: Loss::default(),
            prepare: PrepareOptions::default(),
            window: None,
            seed: 1,
            recording_weights: Vec::new(),
            prior_uncertainty: None,
            compare: Vec::new(),
            look_beyond: false,
        }
    }
}
