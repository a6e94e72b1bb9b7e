//! Next experiment that separates rival effects.
//!
//! The library has safe motions over amplitudes and speeds within the robot's limits. The chosen motion separates the
//! rivals' predictions most, the loser refitted each time (T-optimality: Atkinson and Fedorov 1975, Biometrika 62).
//! Pairs that are the same function of torque and motion need another channel, another load or another direction of
//! gravity. These are requested last.
//!
//! Leaves out: ranges of cranks and regions of the workspace; the posteriors of the rivals' parameters, which the
//! estimates represent; the other joints, which stand in mid-range.

mod criterion;
mod lookup;
mod place;
mod primitives;
pub mod testable;

#[cfg(test)]
mod tests;

use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::Trajectory;

pub use criterion::{FLOOR_RATE, Held};
pub use lookup::{OFF_LOG, PULLS_OFF};
pub use place::Nominal;
pub use primitives::{Family, Hands};

use crate::DiagnoseError;
use crate::outcome::NextExperiment;
use rig_excite::{COASTING, JointTrajectory, TrajectoryFile};
use rig_model::robot::Robot;
use rig_output::format_unit;

use criterion::{Course, predictable};
use lookup::{confused, split};
use place::Place;
use primitives::{Primitive, clamped, of_family};

/// Motion file named in the experiment's text; the caller writes it beside `diagnosis.json`.
pub const FILE: &str = "next_experiment.toml";
/// Least separation that decides, in standard deviations.
const DECIDES: f64 = 5.0;
/// Least ratio of separations that justifies manual work.
const WORTH_HANDS: f64 = 2.0;

/// The next experiment, with its motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Text and figures for the diagnosis.
    pub experiment: NextExperiment,
    /// Motion to write as [`FILE`]; `None` if no motion helps.
    pub trajectory: Option<TrajectoryFile>,
}

/// Returns the experiment that separates `rivals` of one joint (from 0): each an effect with its estimate, and the
/// nominal parameters estimated with it. `held` are parameters that the refit kept as described. `floor` is the torque
/// noise, N·m or N, as RMS after the low-pass, so of about [`FLOOR_RATE`] independent values a second.
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
        // Collinear partners of the nearest pair are as near; the registry may list theirs.
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
    // External loads are removed for the same motion. This also separates a spring from a constant: gravity and
    // friction are then known without both.
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

/// Indices of two rivals.
type Pair = [usize; 2];

/// Returns all pairs.
fn pairs(count: usize) -> impl Iterator<Item = Pair> {
    (0..count).flat_map(|b| (0..b).map(move |a| [a, b]))
}

/// Returns true if the registry has both as the same function of torque and motion.
pub(crate) fn exact(pair: [Kind; 2]) -> bool {
    confused(pair).is_some_and(|c| c.exact)
}

/// Returns true if an effect is a constant torque while the joint moves.
fn constant(kind: Kind) -> bool {
    kind == Kind::TorqueOffset || exact([kind, Kind::TorqueOffset])
}

/// A motion and the separation of its closest rivals, standard deviations.
type Apart = (Primitive, f64);

/// Returns the separation per second of motion, since a longer motion separates more by its duration alone.
fn rate((primitive, apart): &Apart) -> f64 {
    let passes = primitive.hands.passes().len() as f64;
    apart / (passes * primitive.duration()).max(1.0).sqrt()
}

/// Returns the motion that separates the closest pair fastest, of those that decide. If none decides, it returns the
/// one with the largest separation.
fn best(place: &Place, rivals: &[(Effect<f64>, Nominal)], floor: f64) -> Option<Apart> {
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
fn closest(course: &Course, rivals: &[(Effect<f64>, Nominal)], revolute: bool, floor: f64) -> f64 {
    nearest(course, rivals, revolute, floor).map_or(0.0, |(apart, _)| apart)
}

/// Returns the same with the pair; `None` if no motion separates any.
fn nearest(
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

/// Returns sentences on how to run the motion.
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

/// Returns the remedy of the pair, with the widest motion of its family.
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
            // Torque steps if they are known, else friction.
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
