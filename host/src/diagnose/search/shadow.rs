//! What a right name leaves because its law is not quite the rig's.

use rig_shared::effects::Kind;

use super::is_gear;
use crate::diagnose::profile::Profile;

/// Share of the squares that an effect takes away which the difference between its law and the rig's may leave: a law that
/// closes 93 % of the gap leaves so much …
const SHADOW: f64 = 0.005;
/// … the curve along which friction falls with speed has other forms than the library's: a law that closes 86 % …
const SHADOW_OF_A_CURVE: f64 = 0.02;
/// … a constant and the direction of gravity have no other form: what they leave is what the joint does at rest …
const SHADOW_OF_A_CONSTANT: f64 = 0.001;
/// … and 86 % for gears, whose motion is driven by the measured one.
const SHADOW_OF_A_GEAR: f64 = 0.02;

/// Whether an effect takes away no more than another of its joint leaves because its law is not quite the rig's.
pub(super) fn in_the_shadow(chosen: &[Profile], i: usize) -> bool {
    let squares =
        |p: &Profile| -> f64 { p.evidence.block_errors.iter().map(|e| e[0] - e[1]).sum() };
    let own = squares(&chosen[i]);
    (chosen.iter().enumerate()).any(|(k, other)| {
        k != i
            && other.candidate.joint == chosen[i].candidate.joint
            && own < shadow(other) * squares(other)
    })
}

/// Share of the squares that an effect takes away which the difference between its law and the rig's may leave.
pub(in crate::diagnose) fn shadow(of: &Profile) -> f64 {
    match of.candidate.kind {
        kind if is_gear(kind) => SHADOW_OF_A_GEAR,
        Kind::TorqueOffset | Kind::CurrentOffset | Kind::AsymmetricCoulomb | Kind::GravityTilt => {
            SHADOW_OF_A_CONSTANT
        }
        Kind::Stribeck | Kind::StribeckExponential => SHADOW_OF_A_CURVE,
        _ => SHADOW,
    }
}
