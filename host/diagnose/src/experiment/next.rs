//! The next experiment for the rivals of one joint.

use rig_shared::effects::{Effect, Kind};

use crate::DiagnoseError;
use crate::experiment::choice::{DECIDES, best, nearest};
use crate::experiment::criterion::{Course, predictable};
use crate::experiment::lookup::{Remedy, confused, split};
use crate::experiment::nominal::{Held, Nominal};
use crate::experiment::pairs::{Pair, exact, pairs};
use crate::experiment::place::Place;
use crate::experiment::proposal::{Deciding, Proposal, by_lookup, names};
use rig_model::robot::Robot;

/// Returns the experiment that separates `rivals` of one joint (from 0): each an effect with its estimate, and the
/// nominal parameters estimated with it. `held` are parameters that the refit kept as described. `floor` is the torque
/// noise, N·m or N, as RMS after the low-pass, so of about [`FLOOR_RATE`](crate::experiment::FLOOR_RATE) independent values a second.
///
/// `None` for fewer than two rivals.
///
/// # Errors
/// [`DiagnoseError::Model`] if the description's geometry is no chain.
pub fn next(
    robot: &Robot,
    joint: usize,
    rivals: &[(Effect<f64>, Nominal)],
    held: Held,
    floor: f64,
) -> Result<Option<Proposal>, DiagnoseError> {
    let Some((_, nominal)) = rivals.first().filter(|_| rivals.len() > 1) else {
        return Ok(None);
    };
    let place = Place::of(robot, joint, *nominal, held)?;
    let kinds = |[a, b]: Pair| [rivals[a].0.kind, rivals[b].0.kind];
    let lookup = |pair: Pair| by_lookup(robot, joint, place.as_ref(), kinds(pair), names(rivals));
    let (same, apart): (Vec<Pair>, Vec<Pair>) = pairs(rivals.len()).partition(|p| exact(kinds(*p)));
    let hidden = (apart.iter()).find(|p| !kinds(**p).into_iter().all(predictable));
    if let Some(pair) = hidden {
        return Ok(Some(lookup(*pair)));
    }
    let by = |pair: &Pair| split(kinds(*pair));
    // Experiments without manual work come first, and before them the one without motion.
    let alone = same.iter().find(|p| !by(p).needs_hands());
    if apart.is_empty() || alone.is_some_and(|p| by(p) == Remedy::DriveOffLog) {
        return Ok(alone.or(same.first()).map(|p| lookup(*p)));
    }
    let found = place.as_ref().and_then(|place| best(place, rivals, floor));
    let (primitive, separation) = match found {
        Some((primitive, separation)) if separation >= DECIDES => (primitive, separation),
        undecided => {
            let nearest = undecided
                .zip(place.as_ref())
                .and_then(|((primitive, _), place)| {
                    let course = Course::of(place, &primitive);
                    nearest(&course, rivals, place.revolute, floor).map(|(_, pair)| pair)
                });
            let told = nearest.and_then(|pair| told_by_registry(&apart, rivals, pair));
            let pulled = same.iter().find(|p| by(p) == Remedy::PullsOff);
            let pair = alone.or(pulled).copied().or(told).or(nearest);
            return Ok(pair.or(apart.first().copied()).map(lookup));
        }
    };
    let stand = place.map_or_else(Vec::new, |p| p.stand);
    let deciding = Deciding {
        robot,
        joint,
        rivals,
        primitive: &primitive,
        separation,
    };
    Ok(Some(deciding.proposal(&stand, same)))
}

/// Returns the pair that the registry lists of those whose rivals are collinear with the ones of `nearest`: they are as
/// near.
fn told_by_registry(
    apart: &[Pair],
    rivals: &[(Effect<f64>, Nominal)],
    nearest: Pair,
) -> Option<Pair> {
    let kinds = |[a, b]: Pair| [rivals[a].0.kind, rivals[b].0.kind];
    let like = |a: Kind, b: Kind| a == b || exact([a, b]);
    let listed = |p: &&Pair| {
        let ([a, b], [c, d]) = (kinds(**p), kinds(nearest));
        confused(kinds(**p)).is_some() && ((like(a, c) && like(b, d)) || (like(a, d) && like(b, c)))
    };
    apart.iter().find(listed).copied()
}
