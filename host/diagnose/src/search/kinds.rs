//! What a search asks of kinds and candidates.

use rig_shared::effects::{Channel, Direction, Kind};

use crate::columns::Candidate;

/// Whether it acts between motor and link.
pub(crate) fn is_gear(kind: Kind) -> bool {
    kind.about().channel == Channel::Transmission
}

/// Whether it is friction of a shape that the standard model's has not: a constant by direction is none.
pub(crate) fn is_friction(kind: Kind) -> bool {
    kind.about().direction == Direction::Dry && kind != Kind::AsymmetricCoulomb
}

/// Whether two candidates exclude each other: one name twice on a joint, but for waves of two orders, or two transmissions.
pub(crate) fn rivals(a: &Candidate, b: &Candidate) -> bool {
    let one = a.kind.about().name == b.kind.about().name || is_gear(a.kind) && is_gear(b.kind);
    one && a.joint == b.joint && a.other == b.other && !a.is_another_order(b)
}

/// Whether it is one constant in the torque of a joint that moves.
pub(crate) fn is_constant(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::AsymmetricCoulomb | Kind::TorqueOffset | Kind::CurrentOffset
    )
}

/// Whether two candidates are nearly one function of the motion, each of one form alone: a constant and the direction of gravity.
pub(super) fn doubles(a: &Candidate, b: &Candidate) -> bool {
    let of = |a: &Candidate, b: &Candidate| is_constant(a.kind) && b.kind == Kind::GravityTilt;
    a.joint == b.joint && (of(a, b) || of(b, a))
}

/// Whether it is a torque of the motor with any number of periods in its turn.
pub(super) fn has_many_orders(kind: Kind) -> bool {
    matches!(kind, Kind::Cogging | Kind::TorqueRipple)
}

/// Whether a kind is the law that its name is searched by; others take its place only where they do better.
pub(crate) fn is_first_law(kind: Kind) -> bool {
    Kind::named(kind.about().name, None) == Some(kind)
        // Rings of motor and joint are at different places, not different laws.
        || kind == Kind::EncoderEccentricityJoint
        || kind == Kind::ViscousWarmupTemperature
}

/// Whether a kind is searched for by itself: the first law of its name, or one with as many numbers, which bends to no more.
pub(super) fn is_searched(kind: Kind) -> bool {
    let size = |kind: Kind| kind.about().gains.len() + kind.about().shapes.len();
    let first = Kind::named(kind.about().name, None);
    is_first_law(kind) || first.is_some_and(|first| !is_gear(kind) && size(first) == size(kind))
}

/// Whether an effect's columns depend on what the model predicts.
pub(super) fn depends_on_model(kind: Kind) -> bool {
    let about = kind.about();
    matches!(
        about.channel,
        Channel::Position | Channel::Effort | Channel::Transmission
    ) || matches!(
        about.name,
        "load_friction" | "torque_ripple" | "torque_saturation" | "gravity_tilt"
    ) || kind == Kind::ViscousWarmupHeat
}
