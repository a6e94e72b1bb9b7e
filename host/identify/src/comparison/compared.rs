//! The result of a comparison of estimators.

use serde::Serialize;

use super::endogeneity::Endogeneity;
use crate::estimator::Estimator;

/// The result of one estimator.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// Estimator.
    pub estimator: Estimator,
    /// Per joint, RMS of the residual over RMS of the torque, with every time segment predicted from the others. Null
    /// for a joint without usable torque, and altogether if the estimator failed.
    pub cross_validated_relative_error: Option<Vec<f64>>,
    /// The same on the hold-out, if given.
    pub holdout_relative_error: Option<Vec<f64>>,
    /// Distance of the estimate from the nearest physically consistent one, in standard deviations of all parameters
    /// together.
    pub distance_to_consistent: Option<f64>,
    /// True if that distance is negligible.
    pub physically_consistent: Option<bool>,
    /// Largest difference from the weighted fit over all parameters, in standard deviations of that fit.
    pub largest_shift: Option<f64>,
    /// Values in the order of `base_parameters`.
    pub values: Option<Vec<f64>>,
    /// Remarks on the fit, or the reason of its failure.
    pub said: Vec<String>,
}

/// Results of all estimators and the recommendation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Number of cross-validation segments.
    pub folds: usize,
    /// Hold-out recordings that repeat a training motion, so they do not test the prediction of another motion.
    pub repeated_holdout: Vec<String>,
    /// One entry per estimator.
    pub estimators: Vec<Compared>,
    /// Durbin–Wu–Hausman test; absent if instrumental variables failed.
    pub endogeneity: Option<Endogeneity>,
    /// The recommended estimator.
    pub recommended: Estimator,
    /// The recommendation and its reason.
    pub recommendation: String,
}
