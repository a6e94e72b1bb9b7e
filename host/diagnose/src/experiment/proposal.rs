//! Proposed experiments, with their motions.

use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::Trajectory;

use crate::experiment::family::{Family, Hands};
use crate::experiment::kind::ExperimentKind;
use crate::experiment::lookup::{Remedy, split};
use crate::experiment::nominal::Nominal;
use crate::experiment::pairs::Pair;
use crate::experiment::place::Place;
use crate::experiment::primitives::{Primitive, clamped, of_family};
use crate::experiment::sentences;
use crate::experiment::sentences::FILE;
use crate::outcome::NextExperiment;
use rig_excite::{JointTrajectory, TrajectoryFile};
use rig_model::robot::Robot;

/// The next experiment, with its motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Text and figures for the diagnosis.
    pub experiment: NextExperiment,
    /// Motion to write as [`FILE`]; `None` if no motion helps.
    pub trajectory: Option<TrajectoryFile>,
}

/// A motion that separates the rivals.
pub(crate) struct Deciding<'a> {
    pub(crate) robot: &'a Robot,
    /// From 0.
    pub(crate) joint: usize,
    pub(crate) rivals: &'a [(Effect<f64>, Nominal)],
    pub(crate) primitive: &'a Primitive,
    /// Separation of the closest rivals, standard deviations.
    pub(crate) separation: f64,
}

impl Deciding<'_> {
    /// Returns the proposal of the motion. `stand` are the positions of the standing joints, `same` the pairs that no
    /// motion separates.
    pub(crate) fn proposal(&self, stand: &[f64], same: Vec<Pair>) -> Proposal {
        let primitive = self.primitive;
        let remedy = |pair: &Pair| split(pair.map(|k| self.rivals[k].0.kind));
        // External loads are removed for the same motion. This also separates a spring from a constant: gravity and
        // friction are then known without both.
        let (pulled, same): (Vec<Pair>, Vec<Pair>) = (same.into_iter())
            .partition(|p| primitive.hands == Hands::None && remedy(p) == Remedy::PullsOff);
        let pulls_off = pulled.first().map(remedy);
        let kind = match (primitive.hands, pulls_off) {
            (Hands::None, Some(remedy)) => remedy.experiment().0,
            (Hands::None, None) => ExperimentKind::Motion(primitive.family),
            (Hands::Payload, _) => ExperimentKind::WithPayload(primitive.family),
            (Hands::BaseOnItsSide, _) => ExperimentKind::WithBaseTurned(primitive.family),
        };
        let mut left: Vec<usize> = same.into_iter().flatten().collect();
        left.sort_unstable();
        left.dedup();
        let left: Vec<_> = left.into_iter().map(|k| self.rivals[k]).collect();
        Proposal {
            experiment: NextExperiment {
                kind,
                separates: names(self.rivals),
                text: sentences::deciding(
                    self.robot,
                    self.joint,
                    primitive,
                    self.separation,
                    pulls_off,
                    &names(&left),
                ),
                file: Some(FILE.to_owned()),
                separation: Some(self.separation),
                duration: Some(primitive.hands.passes().len() as f64 * primitive.duration()),
                hands: primitive.hands != Hands::None || pulls_off.is_some(),
                trajectory: None,
            },
            trajectory: Some(file_of(self.robot, self.joint, stand, primitive)),
        }
    }
}

/// Returns the names of rivals, with their laws where a name is shared.
pub(crate) fn names(rivals: &[(Effect<f64>, Nominal)]) -> Vec<String> {
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

/// Returns the motion file: `stand` are the positions of the standing joints.
pub(crate) fn file_of(
    robot: &Robot,
    joint: usize,
    stand: &[f64],
    primitive: &Primitive,
) -> TrajectoryFile {
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
pub(crate) fn by_lookup(
    robot: &Robot,
    joint: usize,
    place: Option<&Place>,
    pair: [Kind; 2],
    separates: Vec<String>,
) -> Proposal {
    let remedy = split(pair);
    let (mut kind, family) = remedy.experiment();
    let motion = family.zip(place).and_then(|(family, place)| {
        let first = |family| of_family(place, family, Hands::None).into_iter().next();
        let primitive = match family {
            // Torque steps if they are known, else friction.
            Family::LockedRotor => clamped(place).or_else(|| first(Family::NestedReversals)),
            other => first(other),
        };
        Some((primitive?, place.stand.clone()))
    });
    let mut text = sentences::remedy(remedy, joint);
    if let Some((primitive, _)) = &motion {
        if family == Some(Family::LockedRotor) {
            kind = ExperimentKind::Motion(primitive.family);
        }
        text = format!("{text} {}", sentences::running(robot, joint, primitive));
    }
    Proposal {
        experiment: NextExperiment {
            kind,
            separates,
            text,
            file: motion.as_ref().map(|_| FILE.to_owned()),
            separation: None,
            duration: motion.as_ref().map(|(p, _)| p.duration()),
            hands: remedy.needs_hands(),
            trajectory: None,
        },
        trajectory: motion.map(|(primitive, stand)| file_of(robot, joint, &stand, &primitive)),
    }
}
