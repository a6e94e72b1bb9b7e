//! Proposed experiments in words, with their motions.

use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::Trajectory;

use crate::experiment::family::{Family, Hands};
use crate::experiment::lookup::{PULLS_OFF, Remedy, split};
use crate::experiment::nominal::Nominal;
use crate::experiment::pairs::Pair;
use crate::experiment::place::Place;
use crate::experiment::primitives::{Primitive, clamped, of_family};
use crate::outcome::NextExperiment;
use rig_excite::{COASTING, JointTrajectory, TrajectoryFile};
use rig_model::robot::Robot;
use rig_output::format_unit;

/// Motion file named in the experiment's text; the caller writes it beside `diagnosis.json`.
pub const FILE: &str = "next_experiment.toml";

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
            .partition(|p| primitive.hands == Hands::None && remedy(p).kind == Remedy::PullsOff);
        let number = (self.joint + 1).to_string();
        let pulls_off = (pulled.first()).map(|p| remedy(p).text.replace("{k}", &number));
        let kind = match primitive.hands {
            Hands::None if pulls_off.is_some() => PULLS_OFF.to_owned(),
            Hands::None => primitive.family.name().to_owned(),
            Hands::Payload => format!("payload-swap: {}", primitive.family.name()),
            Hands::BaseOnItsSide => format!("base-turned: {}", primitive.family.name()),
        };
        Proposal {
            experiment: NextExperiment {
                kind,
                separates: names(self.rivals),
                text: self.text(pulls_off.as_deref(), &same),
                file: Some(FILE.to_owned()),
                separation: Some(self.separation),
                duration: Some(primitive.hands.passes().len() as f64 * primitive.duration()),
                hands: primitive.hands != Hands::None || pulls_off.is_some(),
                trajectory: None,
            },
            trajectory: Some(file_of(self.robot, self.joint, stand, primitive)),
        }
    }

    /// Returns the instructions: first `pulls_off`, and what the motion leaves open of the pairs `same`.
    fn text(&self, pulls_off: Option<&str>, same: &[Pair]) -> String {
        let mut text = running(self.robot, self.joint, self.primitive);
        match pulls_off {
            Some(first) => text.insert_str(0, &format!("{first} ")),
            None => text = format!("{text} {}", self.primitive.hands.text()),
        }
        text.push_str(&format!(
            " The predictions of the rivals that a motion tells apart lie {:.0} standard deviations of the noise apart along it.",
            self.separation
        ));
        if !same.is_empty() {
            let mut left: Vec<usize> = same.iter().copied().flatten().collect();
            left.sort_unstable();
            left.dedup();
            let left: Vec<_> = left.into_iter().map(|k| self.rivals[k]).collect();
            text.push_str(&format!(
                " Of {} no motion tells one from another: should they be left, the next diagnosis says what does.",
                names(&left).join(" and ")
            ));
        }
        text
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
        _ => found.kind.name(),
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
