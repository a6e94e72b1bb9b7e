//! Places of a result: dependences of a residual on coordinates.

use crate::acceptance::coordinates::Coordinate;
use crate::acceptance::residual_dependence::dependence::Dependence;
use crate::acceptance::residual_dependence::{self, Known};
use crate::outcome::Place;
use crate::result::sentences::place::text;
use crate::rows::regression::Rows;

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

/// Returns the entries of the result for the coordinates on which a joint's residual depends; parameters as of
/// [`residual_dependence::locate`].
pub(crate) fn locate(
    rows: &Rows,
    coordinates: &[Coordinate],
    residual: &[f64],
    known: Option<&Known>,
    block: &[usize],
    joint: usize,
    joint_name: &str,
    floor: f64,
    seed: u64,
) -> Vec<Place> {
    let found = residual_dependence::locate(
        rows,
        coordinates,
        residual,
        known,
        block,
        joint,
        joint_name,
        floor,
        seed,
    );
    found.iter().map(place).collect()
}
