//! A ball screw on a crank.

use std::collections::BTreeMap;

use rig_shared::transmission::ScrewMap;
use serde::{Deserialize, Serialize};

use super::array::{exact, exact_or_none};

/// A ball screw between a fixed anchor and the tip of a crank that turns with the joints.
///
/// In the plane of the crank, its axle at the origin: the tip lies at crank·(cos ψ, sin ψ) with ψ = Σ c_j·q_j + offset,
/// the anchor at (x, y), and the motor turns by (2π/lead)·distance (Kozłowski 1998, joints 2 and 3 of the IRp-6).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Screw {
    /// m a motor turn; negative where the screw shortens as the motor turns forwards.
    pub lead: f64,
    /// m
    pub crank: f64,
    /// Place of the anchor, m.
    #[serde(deserialize_with = "exact")]
    pub anchor: [f64; 2],
    /// Radians of the crank a radian (or metre) of each joint named.
    pub angle: BTreeMap<String, f64>,
    /// Crank's angle where all joints are at zero, rad.
    #[serde(default)]
    pub offset: f64,
    /// Lowest and highest angle of the crank, rad; absent: what the limits of its joints allow.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub range: Option<[f64; 2]>,
}

impl Screw {
    /// Distance² = s + m·cos ψ − n·sin ψ.
    pub(super) fn map<'a>(&self, weights: &'a [f64]) -> ScrewMap<'a> {
        let [x, y] = self.anchor;
        ScrewMap {
            lead: self.lead,
            constant: self.crank * self.crank + x * x + y * y,
            cosine: -2.0 * self.crank * x,
            sine: 2.0 * self.crank * y,
            weights,
            offset: self.offset,
        }
    }

    /// The angle of the crank at which the screw is longest; half a turn on it is shortest. Both are dead centres.
    pub(super) fn dead_centre(&self) -> f64 {
        let [x, y] = self.anchor;
        (-y).atan2(-x)
    }
}
