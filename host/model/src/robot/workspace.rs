//! Regions that points of the links must not leave.

use serde::{Deserialize, Serialize};

use super::array::{exact, exact_or_none};

/// A region in the base frame that a point of a link must not leave: a box, or one side of a plane, or both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the joint whose link carries the point.
    pub joint: String,
    /// The point in that joint's frame, m.
    #[serde(default, deserialize_with = "exact")]
    pub point: [f64; 3],
    /// Lowest x, y and z of the box in the base frame, m; −∞ where free.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub min: Option<[f64; 3]>,
    /// Highest x, y and z of the box, m; ∞ where free.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub max: Option<[f64; 3]>,
    /// Normal of the plane, towards the allowed side; of any length.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub normal: Option<[f64; 3]>,
    /// Distance along the normal from the base frame's origin to the allowed side, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beyond: Option<f64>,
}
