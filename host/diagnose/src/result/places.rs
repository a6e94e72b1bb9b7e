//! Places of a result: dependences of a residual on coordinates.

use crate::acceptance::residual_dependence::dependence::Dependence;
use crate::outcome::Place;
use crate::result::sentences::place::text;

/// Returns the entry of the result for a dependence.
pub(crate) fn place(own: &Dependence) -> Place {
    Place {
        joint: own.joint.clone(),
        coordinate: own.coordinate.clone(),
        interval: own.interval,
        unit: own.unit.clone(),
        share: own.share,
        p_value: own.p_value,
        text: text(own),
    }
}
