//! The tool point of an arm.

use super::design::at_start;
use super::error::ControlError;
use rig_shared::multibody::{Chain, Pose, frame_pose};

/// Computes the position of a point of the last link in the base frame, m, and its twist for a unit velocity of each
/// joint.
pub(crate) fn tool_pose(
    chain: &Chain<f64>,
    q: &[f64],
    tool: [f64; 3],
    jacobian: &mut [[f64; 6]],
) -> Result<[f64; 3], ControlError> {
    let fixed = Pose {
        position: tool,
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    frame_pose(chain, q, chain.last_link(), &fixed, jacobian)
        .map(|pose| pose.position)
        .map_err(|error| at_start(error.into()))
}
