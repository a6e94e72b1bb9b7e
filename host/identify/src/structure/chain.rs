//! Geometry and drives of a robot description.

use rig_shared::multibody::Chain;
use rig_shared::transmission::Transmission;

use crate::error::IdentifyError;
use rig_model::robot::Robot;

/// Builds the chain of a robot description.
///
/// # Errors
/// [`IdentifyError::Model`] if the geometry is invalid.
pub fn chain_of(robot: &Robot) -> Result<Chain<f64>, IdentifyError> {
    robot
        .chain()
        .map_err(|e| IdentifyError::Model(e.to_string()))
}

/// Builds the drives of a robot description.
///
/// # Errors
/// [`IdentifyError::Model`] if the drives are impossible.
pub fn transmission_of(robot: &Robot) -> Result<Transmission<f64>, IdentifyError> {
    robot
        .transmission()
        .map_err(|e| IdentifyError::Model(e.to_string()))
}
