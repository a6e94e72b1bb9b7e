//! What to record next so that rivals come apart.
//!
//! From a library of safe motions, each over amplitudes and speeds within the robot's limits, the one along which the
//! rivals' predictions lie farthest apart, the loser refitted each time (T-optimality: Atkinson and Fedorov 1975,
//! Biometrika 62). Pairs that are the same function of torque and motion stand together there; what splits them is another
//! channel, another load, another direction of gravity, and is asked for once nothing else is left.
//!
//! Leaves out: ranges of cranks and regions of the workspace; the posteriors of the rivals' parameters, of which the
//! estimates stand for all; the other joints, which stand in the middle of their ranges.

mod criterion;
mod lookup;
mod place;
mod primitives;

#[cfg(test)]
mod tests;

use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::Trajectory;

pub use criterion::{FLOOR_RATE, Held};
pub use lookup::{OFF_LOG, PULLS_OFF};
pub use place::Nominal;
pub use primitives::{Family, Hands};

use super::DiagnoseError;
use super::outcome::NextExperiment;
use rig_excite::{COASTING, JointTrajectory, TrajectoryFile};
use rig_model::robot::Robot;
use rig_output::format_unit;

use criterion::{Course, predictable};
use lookup::{confused, split};
use place::Place;
use primitives::{Primitive, clamped, of_family};

/// The file that the experiment's text speaks of; the caller writes it beside `diagnosis.json`.
pub const FILE: &str = "next_experiment.toml";
/// Fewer standard deviations than this decide nothing.
const DECIDES: f64 = 5.0;
/// What needs hands must do so much better than what does not.
const WORTH_HANDS: f64 = 2.0;

/// What to do next, with the motion for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// For the diagnosis.
    pub experiment: NextExperiment,
    /// To be written as [`FILE`]; none where no motion helps.
    pub trajectory: Option<TrajectoryFile>,
}

/// The experiment that tells `rivals` of one joint (from 0) apart: each an effect with its estimate and the joint's
/// nominal parameters estimated beside it; `held` is what the refit of the nominal model left as described. `floor` is the
/// noise of its torque, N·m or N, as RMS after the low-pass, so of about [`FLOOR_RATE`] independent values a second.
///
/// None where there are fewer than two rivals.
///
/// # Errors
/// [`DiagnoseError::Model`] where the description's geometry is no chain.
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
    // What the rig does by itself comes first, and first of all what it does without moving.
    let alone = same.iter().find(|p| !by(p).hands);
    if apart.is_empty() || alone.is_some_and(|p| by(p).kind == OFF_LOG) {
        return Ok(alone.or(same.first()).map(|p| lookup(*p)));
    }
    let found = place.as_ref().and_then(|place| best(place, rivals, floor));
    let Some((primitive, apart)) = found.as_ref().filter(|(_, apart)| *apart >= DECIDES) else {
        let nearest = found
            .zip(place.as_ref())
            .and_then(|((primitive, _), place)| {
                let course = Course::of(place, &primitive);
                nearest(&course, rivals, place.revolute, floor).map(|(_, pair)| pair)
            });
        // Partners of the nearest pair lie as near; the registry may speak of theirs.
        let told = nearest.and_then(|pair| {
            let like = |a: Kind, b: Kind| a == b || exact([a, b]);
            apart.iter().find(|p| {
                let ([a, b], [c, d]) = (kinds(**p), kinds(pair));
                confused(kinds(**p)).is_some()
                    && ((like(a, c) && like(b, d)) || (like(a, d) && like(b, c)))
            })
        });
        let pulled = same.iter().find(|p| by(p).kind == PULLS_OFF);
        let pair = alone.or(pulled).or(told).copied().or(nearest);
        return Ok(pair.or(apart.first().copied()).map(lookup));
    };
    let stand = place.as_ref().map_or_else(Vec::new, |p| p.stand.clone());
    // What pulls from outside is taken off for the same motion. A spring is told from a constant by that, too: gravity and
    // friction are then known without either.
    let (pulled, same): (Vec<Pair>, Vec<Pair>) =
        (same.into_iter()).partition(|p| primitive.hands == Hands::None && by(p).kind == PULLS_OFF);
    let pulls_off = (pulled.first()).map(|p| by(p).text.replace("{k}", &(joint + 1).to_string()));
    let mut text = running(robot, joint, primitive);
    match &pulls_off {
        Some(first) => text.insert_str(0, &format!("{first} ")),
        None => text = format!("{text} {}", primitive.hands.text()),
    }
    text.push_str(&format!(
        " The predictions of the rivals that a motion tells apart lie {apart:.0} standard deviations of the noise apart along it."
    ));
    if !same.is_empty() {
        let mut left: Vec<usize> = same.iter().copied().flatten().collect();
        left.sort_unstable();
        left.dedup();
        let left: Vec<_> = left.into_iter().map(|k| rivals[k]).collect();
        text.push_str(&format!(
            " Of {} no motion tells one from another: should they be left, the next diagnosis says what does.",
            names(&left).join(" and ")
        ));
    }
    let kind = match primitive.hands {
        Hands::None if pulls_off.is_some() => PULLS_OFF.to_owned(),
        Hands::None => primitive.family.name().to_owned(),
        Hands::Payload => format!("payload-swap: {}", primitive.family.name()),
        Hands::BaseOnItsSide => format!("base-turned: {}", primitive.family.name()),
    };
    Ok(Some(Proposal {
        experiment: NextExperiment {
            kind,
            separates: names(rivals),
            text,
            file: Some(FILE.to_owned()),
            separation: Some(*apart),
            duration: Some(primitive.hands.passes().len() as f64 * primitive.duration()),
            hands: primitive.hands != Hands::None || pulls_off.is_some(),
            trajectory: None,
        },
        trajectory: Some(file_of(robot, joint, &stand, primitive)),
    }))
}

fn names(rivals: &[(Effect<f64>, Nominal)]) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for (effect, _) in rivals {
        let about = effect.kind.about();
        let shared = rivals
            .iter()
            .filter(|(e, _)| e.kind.about().name == about.name)
            .count();
        list.push(match about.law {
            Some(law) if shared > 1 => format!("{} ({law})", about.name),
            _ => about.name.to_owned(),
        });
    }
    list
}

/// Two rivals by their places.
type Pair = [usize; 2];

/// Every pair of so many once.
fn pairs(count: usize) -> impl Iterator<Item = Pair> {
    (0..count).flat_map(|b| (0..b).map(move |a| [a, b]))
}

/// Whether the registry has the two as the same function of torque and motion.
pub(super) fn exact(pair: [Kind; 2]) -> bool {
    confused(pair).is_some_and(|c| c.exact)
}

/// Whether an effect is one constant torque as long as the joint moves.
fn constant(kind: Kind) -> bool {
    kind == Kind::TorqueOffset || exact([kind, Kind::TorqueOffset])
}

/// A motion and how far apart the closest rivals lie along it, standard deviations.
type Apart = (Primitive, f64);

/// Distance that the same motion would give in one second: what lasts longer decides more by lasting alone.
fn rate((primitive, apart): &Apart) -> f64 {
    let passes = primitive.hands.passes().len() as f64;
    apart / (passes * primitive.duration()).max(1.0).sqrt()
}

/// The motion that takes the closest pair apart fastest, of those that decide; where none does, the one that takes them
/// farthest.
fn best(place: &Place, rivals: &[(Effect<f64>, Nominal)], floor: f64) -> Option<Apart> {
    let mut chosen: Option<Apart> = None;
    for hands in [Hands::None, Hands::Payload, Hands::BaseOnItsSide] {
        // What decides without hands is not asked for with them.
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

/// Standard deviations between the closest two rivals that a motion can tell apart, whichever of them is true.
fn closest(course: &Course, rivals: &[(Effect<f64>, Nominal)], revolute: bool, floor: f64) -> f64 {
    nearest(course, rivals, revolute, floor).map_or(0.0, |(apart, _)| apart)
}

/// The same with the pair; none where no motion tells any apart.
fn nearest(
    course: &Course,
    rivals: &[(Effect<f64>, Nominal)],
    revolute: bool,
    floor: f64,
) -> Option<(f64, Pair)> {
    let told = pairs(rivals.len()).filter(|[a, b]| !exact([rivals[*a].0.kind, rivals[*b].0.kind]));
    told.map(|[a, b]| {
        // A constant that the standard model or a spring holds as well shows along no motion, but what is more than a constant
        // shows.
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

/// How the motion is run, sentences.
fn running(robot: &Robot, joint: usize, primitive: &Primitive) -> String {
    let (start, seconds) = (primitive.start, primitive.duration());
    let own = &robot.joints[joint];
    let how = if robot.joints.len() == 1 {
        let clamp = match primitive.family {
            Family::LockedRotor => ", clamp it",
            _ => "",
        };
        let after = match primitive.drive_off {
            Some(_) => format!(" --seconds {COASTING}"),
            None => String::new(),
        };
        format!(
            "bring the joint to {start:.4}{clamp} and run it with `rig record --port PORT --robot R --trajectory {FILE} --home {start:.4}{after} --out next.csv` (`--emulated` for the emulated rig; {FILE} lies in the folder of --out)"
        )
    } else {
        format!(
            "bring joint {} to {start:.4} {}, the others to the middle of their ranges, and let your controller follow it; `rig simulate` shows it first",
            own.name,
            format_unit(own.kind.units().0),
        )
    };
    format!(
        "{FILE} holds {} about {start:.4}, {seconds:.0} s: {how}.",
        primitive.figures
    )
}

fn file_of(robot: &Robot, joint: usize, stand: &[f64], primitive: &Primitive) -> TrajectoryFile {
    let hold = primitive
        .trajectory
        .duration_micros()
        .min(u64::from(u32::MAX)) as u32;
    let joints = robot.joints.iter().enumerate().map(|(j, own)| {
        let moves = j == joint;
        JointTrajectory {
            name: own.name.clone(),
            start: if moves {
                primitive.start
            } else {
                stand.get(j).copied().unwrap_or(0.0)
            },
            trajectory: if moves {
                primitive.trajectory.clone()
            } else {
                Trajectory::Hold(hold)
            },
        }
    });
    TrajectoryFile {
        robot: robot.name.clone(),
        design: None,
        drive_off: primitive.drive_off,
        joints: joints.collect(),
    }
}

/// By what splits the pair, with the widest motion of the family that it asks for.
fn by_lookup(
    robot: &Robot,
    joint: usize,
    place: Option<&Place>,
    pair: [Kind; 2],
    separates: Vec<String>,
) -> Proposal {
    let found = split(pair);
    let mut text = found.text.replace("{k}", &(joint + 1).to_string());
    let motion = found.motion.zip(place).and_then(|(family, place)| {
        let first = |family| of_family(place, family, Hands::None).into_iter().next();
        let primitive = match family {
            // Steps of the torque where they are known, else of the friction.
            Family::LockedRotor => clamped(place).or_else(|| first(Family::NestedReversals)),
            other => first(other),
        };
        Some((primitive?, place.stand.clone()))
    });
    let kind = match &motion {
        Some((primitive, _)) if found.motion == Some(Family::LockedRotor) => {
            primitive.family.name()
        }
        _ => found.kind,
    };
    if let Some((primitive, _)) = &motion {
        text = format!("{text} {}", running(robot, joint, primitive));
    }
    Proposal {
        experiment: NextExperiment {
            kind: kind.to_owned(),
            separates,
            text,
            file: motion.as_ref().map(|_| FILE.to_owned()),
            separation: None,
            duration: motion.as_ref().map(|(p, _)| p.duration()),
            hands: found.hands,
            trajectory: None,
        },
        trajectory: motion.map(|(primitive, stand)| file_of(robot, joint, &stand, &primitive)),
    }
}
