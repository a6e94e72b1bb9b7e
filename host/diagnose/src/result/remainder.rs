//! The remainder of a result, from the unexplained residual.

use crate::acceptance::unexplained::Unexplained;
use crate::outcome::Remainder;
use crate::result::places::place;
use crate::result::sentences::remainder::text;

/// Returns the entry of the result for an unexplained residual.
pub(crate) fn remainder(left: &Unexplained) -> Remainder {
    Remainder {
        joint: left.joint.clone(),
        rms: left.rms,
        unit: left.unit.clone(),
        ratio: left.ratio,
        places: left.places.iter().map(place).collect(),
        text: text(left),
        doubt: left.cause.is_doubt(),
    }
}
