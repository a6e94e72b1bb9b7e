//! A ball screw on a crank.

use std::collections::BTreeMap;

use rig_shared::transmission::ScrewMap;
use serde::{Deserialize, Serialize};

use super::array::{exact, exact_or_none};

/// A ball screw between a fixed anchor and the tip of a crank that turns with the joints.
///
/// In the plane of the crank, its axle at the origin: the tip lies at crank·(cos ψ, sin ψ) with ψ = Σ c_j·q_j + offset,
/// the anchor at (x, y). The motor turns by (2π/lead)·distance (Kozłowski 1998, joints 2 and 3 of the IRp-6).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "struct Screw")]
pub struct BallScrewCrank {
    /// Screw lead, m per motor turn; negative if the screw shortens as the motor turns forwards.
    pub lead: f64,
    /// m
    pub crank: f64,
    /// Place of the anchor, m.
    #[serde(deserialize_with = "exact")]
    pub anchor: [f64; 2],
    /// Radians of the crank per radian (or metre) of each named joint.
    pub angle: BTreeMap<String, f64>,
    /// Crank angle with all joints at zero, rad.
    #[serde(default)]
    pub offset: f64,
    /// Lowest and highest angle of the crank, rad; absent: the range from the limits of its joints.
    #[serde(
        default,
        deserialize_with = "exact_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub range: Option<[f64; 2]>,
}

impl BallScrewCrank {
    /// Returns the map with distance² = s + m·cos ψ − n·sin ψ.
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

    /// Returns the crank angle of the longest screw, rad; half a turn further it is shortest. Both are dead centres.
    pub(super) fn dead_centre(&self) -> f64 {
        let [x, y] = self.anchor;
        (-y).atan2(-x)
    }
}
