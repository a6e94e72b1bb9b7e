//! Results from the link encoder of one joint.

use rig_shared::effects::{Kind, SHAPES};

use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::link_encoder::law::{Law, TriedLaw};
use crate::link_encoder::reading::Reading;
use crate::outcome::{Detectable, Map, Place, Step};

/// Results from the link encoder of one joint.
pub(crate) struct Across {
    /// From 0.
    pub(crate) joint: usize,
    /// Named effects, the gear's first, with their entries in the result.
    pub(crate) named: Vec<Named>,
    /// Shapes of the gear, if it has backlash or elasticity.
    pub(crate) gear: Option<(Kind, [f64; SHAPES])>,
    pub(crate) places: Vec<Place>,
    pub(crate) tried: Vec<TriedLaw>,
    pub(crate) detectable: Vec<Detectable>,
    pub(crate) reading: Reading,
}

/// A named effect with its entries in the result.
pub(crate) struct Named {
    pub(crate) kind: Kind,
    /// Its entry in the result, without the reason.
    pub(crate) step: Step,
    pub(crate) law: Law,
    /// Noise floor of q − ql, rad or m.
    pub(crate) floor: f64,
    pub(crate) map: Map,
}

/// Returns true if the analysis across a transmission excludes a candidate of the torque search.
pub(crate) fn refutes(across: &[Across], candidate: &Candidate) -> bool {
    let Some(own) = across.iter().find(|a| a.joint == candidate.joint) else {
        return false;
    };
    let named = || own.named.iter().any(|n| n.kind == candidate.kind);
    match candidate.kind {
        kind if is_gear(kind) => own.gear.is_none_or(|(gear, _)| gear != kind),
        Kind::EncoderEccentricityMotor => !named(),
        _ => false,
    }
}

/// Returns the found gears, with their shapes.
pub(crate) fn gears(across: &[Across]) -> Vec<(Candidate, [f64; SHAPES])> {
    let of = |a: &Across| {
        let (kind, shapes) = a.gear?;
        let candidate = Candidate::on(kind, a.joint);
        Some((candidate, shapes))
    };
    across.iter().filter_map(of).collect()
}

/// Returns true if any named effect is not in the description.
pub(crate) fn names_something(across: &[Across], stated: &dyn Fn(&Candidate) -> bool) -> bool {
    across
        .iter()
        .any(|a| (a.named.iter()).any(|n| !stated(&Candidate::on(n.kind, a.joint))))
}
