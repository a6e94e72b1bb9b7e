//! Settings that are invalid or have no effect.

use crate::error::IdentifyError;
use crate::options::{ModelKind, Options};
use rig_model::robot::Robot;

/// Allowed weights of recordings; beyond this range the other recordings are lost in rounding errors.
const WEIGHTS: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// Rejects settings that are invalid or have no effect with the others.
pub(crate) fn check(robot: &Robot, options: &Options) -> Result<(), IdentifyError> {
    if let Some(&weight) = options
        .recording_weights
        .iter()
        .find(|w| !WEIGHTS.contains(w))
    {
        return Err(IdentifyError::Weight(weight));
    }
    match options.prior_uncertainty {
        Some(u) if !(u.is_finite() && u > 0.0) => return Err(IdentifyError::PriorUncertainty(u)),
        // The prior of several joints' standard parameters is the description, for every estimator.
        Some(uncertainty) if robot.joints.len() == 1 && !options.estimator.has_prior() => {
            return Err(IdentifyError::UnusedUncertainty {
                uncertainty,
                estimator: options.estimator.name(),
            });
        }
        _ => {}
    }
    match (options.window, options.model) {
        (Some(window), ModelKind::Differential) => Err(IdentifyError::UnusedWindow(window)),
        _ => Ok(()),
    }
}
