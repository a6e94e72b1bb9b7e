//! Choice of the motion that separates rivals fastest.

use rig_shared::effects::{Effect, Kind};

use crate::experiment::criterion::Course;
use crate::experiment::family::{Family, Hands};
use crate::experiment::nominal::Nominal;
use crate::experiment::pairs::{Pair, constant, exact, pairs};
use crate::experiment::place::Place;
use crate::experiment::primitives::{Primitive, of_family};

/// Least separation that decides, in standard deviations.
pub(crate) const DECIDES: f64 = 5.0;
/// Least ratio of separations that justifies manual work.
const WORTH_HANDS: f64 = 2.0;

/// A motion and the separation of its closest rivals, standard deviations.
type Apart = (Primitive, f64);

/// Returns the separation per second of motion, since a longer motion separates more by its duration alone.
pub(crate) fn rate((primitive, apart): &Apart) -> f64 {
    let passes = primitive.hands.passes().len() as f64;
    apart / (passes * primitive.duration()).max(1.0).sqrt()
}

/// Returns the motion that separates the closest pair fastest, of those that decide. If none decides, it returns the
/// one with the largest separation.
pub(crate) fn best(place: &Place, rivals: &[(Effect<f64>, Nominal)], floor: f64) -> Option<Apart> {
    let mut chosen: Option<Apart> = None;
    for hands in [Hands::None, Hands::Payload, Hands::BaseOnItsSide] {
        // Manual work is not requested if a motion decides without it.
        if chosen.as_ref().is_some_and(|(_, apart)| *apart >= DECIDES) {
            break;
        }
        let mut own: Option<Apart> = None;
        for family in Family::MOVING {
            for primitive in of_family(place, family, hands) {
                let course = Course::of(place, &primitive);
                let apart = closest(&course, rivals, place.revolute, floor);
                let new = (primitive, apart);
                let better =
                    own.as_ref()
                        .is_none_or(|old| match (apart >= DECIDES, old.1 >= DECIDES) {
                            (true, true) => rate(&new) > rate(old),
                            _ => apart > old.1,
                        });
                if better {
                    own = Some(new);
                }
            }
        }
        let least = chosen
            .as_ref()
            .map_or(0.0, |(_, apart)| WORTH_HANDS * apart);
        if let Some(own) = own.filter(|(_, apart)| *apart > least) {
            chosen = Some(own);
        }
    }
    chosen
}

/// Returns the separation of the closest two rivals in standard deviations, for either as the truth.
pub(crate) fn closest(
    course: &Course,
    rivals: &[(Effect<f64>, Nominal)],
    revolute: bool,
    floor: f64,
) -> f64 {
    nearest(course, rivals, revolute, floor).map_or(0.0, |(apart, _)| apart)
}

/// Returns the same with the pair; `None` if no motion separates any.
pub(crate) fn nearest(
    course: &Course,
    rivals: &[(Effect<f64>, Nominal)],
    revolute: bool,
    floor: f64,
) -> Option<(f64, Pair)> {
    let told = pairs(rivals.len()).filter(|[a, b]| !exact([rivals[*a].0.kind, rivals[*b].0.kind]));
    told.map(|[a, b]| {
        // No motion shows a constant that the standard model or a spring can represent; any other part shows.
        let between = |truth: usize, rival: usize| {
            let spring = rivals[rival].0.kind == Kind::Spring;
            if constant(rivals[truth].0.kind) && (spring || !course.held.constant) {
                f64::INFINITY
            } else {
                course.separation(&rivals[truth], &rivals[rival].0, revolute, floor)
            }
        };
        (between(a, b).min(between(b, a)).max(0.0).sqrt(), [a, b])
    })
    .min_by(|x, y| x.0.total_cmp(&y.0))
}
