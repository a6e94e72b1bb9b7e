//! Properties of kinds and candidates.

use rig_shared::effects::{Channel, Direction, Kind};

use crate::columns::candidate::Candidate;

/// Returns true if the kind acts between motor and link.
pub(crate) fn is_gear(kind: Kind) -> bool {
    kind.about().channel == Channel::Transmission
}

/// Returns true for friction that the standard model lacks. A constant by direction is no such friction.
pub(crate) fn is_friction(kind: Kind) -> bool {
    kind.about().direction == Direction::Dry && kind != Kind::AsymmetricCoulomb
}

/// Returns true if two candidates exclude each other: one name on one joint (except wave orders), or two gears.
pub(crate) fn rivals(a: &Candidate, b: &Candidate) -> bool {
    let one = a.kind.about().name == b.kind.about().name || is_gear(a.kind) && is_gear(b.kind);
    one && a.joint == b.joint && a.other == b.other && !a.is_another_order(b)
}

/// Returns true if the kind is a constant torque on a moving joint.
pub(crate) fn is_constant(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::AsymmetricCoulomb | Kind::TorqueOffset | Kind::CurrentOffset
    )
}

/// Returns true if two candidates are near-collinear with one form each: a constant and the direction of gravity.
pub(crate) fn doubles(a: &Candidate, b: &Candidate) -> bool {
    let of = |a: &Candidate, b: &Candidate| is_constant(a.kind) && b.kind == Kind::GravityTilt;
    a.joint == b.joint && (of(a, b) || of(b, a))
}

/// Returns true for a motor torque with any number of periods per turn.
pub(crate) fn has_many_orders(kind: Kind) -> bool {
    matches!(kind, Kind::Cogging | Kind::TorqueRipple)
}

/// Returns true for the default law of a name. Other laws are tried only as replacements.
pub(crate) fn is_first_law(kind: Kind) -> bool {
    Kind::from_name(kind.about().name, None) == Some(kind)
        // Rings of motor and joint are at different places, not different laws.
        || kind == Kind::EncoderEccentricityJoint
        || kind == Kind::ViscousWarmupTemperature
}

/// Returns true if a kind is searched for itself: the default law, or a law with as many parameters.
pub(crate) fn is_searched(kind: Kind) -> bool {
    let size = |kind: Kind| kind.about().gains.len() + kind.about().shapes.len();
    let first = Kind::from_name(kind.about().name, None);
    is_first_law(kind) || first.is_some_and(|first| !is_gear(kind) && size(first) == size(kind))
}

/// Returns true if the columns of a kind depend on predictions of the model.
pub(crate) fn depends_on_model(kind: Kind) -> bool {
    matches!(
        kind.about().channel,
        Channel::Position | Channel::Effort | Channel::Transmission
    ) || matches!(
        kind,
        Kind::LoadFriction
            | Kind::TorqueRipple
            | Kind::TorqueSaturation
            | Kind::GravityTilt
            | Kind::ViscousWarmupHeat
    )
}
