//! What the description states beyond the standard model, and what becomes of it.
//!
//! An effect that a description states is where the search begins, its parameters as first values; it is fitted again
//! together with everything else. One that these recordings neither show nor contradict is held at its description and
//! taken off them, as is one that the search has no columns for. A tilt is held until the recordings show another beside it: then it
//! is taken out, and what they show of a tilt is looked for in its place. A payload is a mass of its link.
//!
//! Leaves out: effects between motor and link that are held, which no torque for a given motion can be freed of.

use std::collections::BTreeMap;

use rig_shared::effects::{Channel, Effect, Kind};
use rig_shared::multibody::Chain;

use super::DiagnoseError;
use super::columns::{Candidate, Source};
use super::fit::Fit;
use super::outcome::{Described, Fate, Value};
use super::profile::Profile;
use super::search::{is_gear, with};
use rig_model::effects::{Effects, is_torque};
use rig_model::robot::{JointKind, Placed, Robot, RobotEffect, title_of, unit_of};
use rig_output::{format_significant, format_unit};

/// Standard deviations within which the recordings do not contradict a described gain.
const AGREES: f64 = 3.0;
/// A described value is another where it differs by this share …
const CHANGED: f64 = 0.1;
/// … and so many standard deviations.
const SURE: f64 = 5.0;

/// What happens to a described effect.
#[derive(Clone, Debug, PartialEq)]
enum Way {
    /// Part of the link.
    Link,
    /// The search begins with it.
    Free,
    /// At its description, for the reason given; whether recordings are freed of it.
    Held { why: String, taken_off: bool },
    /// Taken out: beside it the recordings show another of its kind, which takes its place.
    GivenUp,
}

impl Way {
    /// Of a search by torque.
    fn held(kind: Kind, why: &str) -> Self {
        let seen = !matches!(
            kind.about().channel,
            Channel::Voltage | Channel::Transmission
        );
        Self::Held {
            why: why.to_owned(),
            taken_off: seen && kind != Kind::ViscousWarmupTemperature,
        }
    }
}

/// The effects of a description.
#[derive(Clone, Debug)]
pub(super) struct Stated {
    /// The description without them; payloads are masses of their links.
    pub(super) robot: Robot,
    /// Whether its format has no place for a constant torque.
    pub(super) no_offsets: bool,
    /// Whether the recordings tell which part of a stated constant torque comes from outside.
    pub(super) pulls_told: bool,
    /// What was said of limits that were left out, sentences.
    pub(super) lifted: Vec<String>,
    effects: Vec<(RobotEffect, Placed, Way)>,
}

impl Stated {
    /// Those of a description.
    pub(super) fn of(robot: &Robot) -> Self {
        let mut plain = robot.clone();
        plain.effects.clear();
        let placed = robot.placed_effects();
        let effects = (robot.effects.iter().cloned().zip(placed))
            .map(|(effect, placed)| {
                let way = match placed.effect.kind {
                    Kind::Payload => {
                        carried(&mut plain, &placed);
                        Way::Link
                    }
                    kind @ Kind::GravityTilt => Way::held(kind, "what is fitted of a tilt is the direction of gravity, which the description states beside it"),
                    kind if kind.about().channel == Channel::Voltage => {
                        Way::held(kind, "it shows in the motor's voltage alone")
                    }
                    _ => Way::Free,
                };
                (effect, placed, way)
            })
            .collect();
        Self {
            robot: plain,
            no_offsets: false,
            pulls_told: false,
            lifted: Vec::new(),
            effects,
        }
    }

    /// The effects that are fitted again, in the order of the description.
    pub(super) fn free(&self) -> Vec<Placed> {
        let of = |(_, placed, way): &(_, Placed, Way)| (*way == Way::Free).then_some(*placed);
        self.effects.iter().filter_map(of).collect()
    }

    /// Tables of the effects that are not fitted.
    pub(super) fn held(&self) -> impl Iterator<Item = &RobotEffect> {
        let held = |(_, _, way): &&(RobotEffect, Placed, Way)| matches!(way, Way::Held { .. });
        self.effects.iter().filter(held).map(|(effect, ..)| effect)
    }

    /// The effects that were taken out.
    pub(super) fn given_up(&self) -> impl Iterator<Item = &Placed> {
        let out = |(_, _, way): &&(_, Placed, Way)| *way == Way::GivenUp;
        self.effects.iter().filter(out).map(|(_, placed, _)| placed)
    }

    /// Takes held tilts out where a tilt was found beside them: one that is stated and is not there, or is another, would come out
    /// as the difference. Whether there was one.
    pub(super) fn give_up_tilts(&mut self, found: &[Profile]) -> bool {
        let tilted = |kind: Kind| kind == Kind::GravityTilt;
        let another = found.iter().any(|p| tilted(p.candidate.kind));
        let mut changed = false;
        for (_, placed, way) in &mut self.effects {
            if another && tilted(placed.effect.kind) && *way != Way::GivenUp {
                *way = Way::GivenUp;
                changed = true;
            }
        }
        changed
    }

    /// Whether an effect of the kind is held on a joint.
    pub(super) fn holds(&self, kind: Kind, joint: usize) -> bool {
        let of = |(_, placed, way): &(_, Placed, Way)| {
            placed.effect.kind == kind && placed.joint == joint && matches!(way, Way::Held { .. })
        };
        self.effects.iter().any(of)
    }

    /// Whether the description has the effect, whatever became of it.
    pub(super) fn states(&self, effect: &Candidate) -> bool {
        self.effects
            .iter()
            .any(|(_, placed, _)| is_one(placed, effect))
    }

    /// What recordings are freed of, those of the rig with nothing that pulls on it where `unburdened`; none where nothing is
    /// held.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] on a description that makes no chain.
    pub(super) fn taken_off(
        &self,
        unburdened: bool,
    ) -> Result<Option<(Effects, Chain<f64>)>, DiagnoseError> {
        let mut robot = self.robot.clone();
        let there = |e: &&RobotEffect| !(unburdened && e.effect.kind.is_external());
        robot.effects = self.held().filter(there).cloned().collect();
        if robot.effects.is_empty() {
            return Ok(None);
        }
        let failed = |e: &dyn std::fmt::Display| DiagnoseError::Model(e.to_string());
        let effects = Effects::of(&robot).map_err(|e| failed(&e))?;
        let chain = Chain::new(&robot.geometry(), robot.gravity).map_err(|e| failed(&e))?;
        Ok(Some((effects, chain)))
    }

    /// The description whose motion is compared with recordings that were freed of what is held.
    pub(super) fn moving(&self) -> Robot {
        let free = self.effects.iter().filter(|(.., way)| *way == Way::Free);
        Robot {
            effects: free.map(|(effect, ..)| effect.clone()).collect(),
            ..self.robot.clone()
        }
    }

    /// Holds free effects that a library has no columns for; whether there was one.
    pub(super) fn hold_what_is_not_in(&mut self, library: &[Candidate]) -> bool {
        let mut changed = false;
        for (_, placed, way) in self.effects.iter_mut().filter(|(.., w)| *w == Way::Free) {
            if !library.contains(&candidate(placed).sort()) {
                let why = match placed.effect.kind {
                    Kind::ViscousWarmupTemperature => "the temperature was not recorded throughout",
                    _ => "it was left out of the search",
                };
                *way = Way::held(placed.effect.kind, why);
                changed = true;
            }
        }
        changed
    }

    /// Holds delays of up to `slack`, s, which are taken for the instants of sampling where nothing states them; whether
    /// there was one.
    pub(super) fn hold_delays(&mut self, slack: f64) -> bool {
        let mut changed = false;
        for (_, placed, way) in self.effects.iter_mut().filter(|(.., w)| *w == Way::Free) {
            let kind = placed.effect.kind;
            if kind == Kind::MeasurementDelay && placed.effect.gains[0] <= slack {
                let why = "it is no longer than what the instants of sampling may make of it";
                *way = Way::held(kind, why);
                changed = true;
            }
        }
        changed
    }

    /// Whether what was fitted is not what the description states: an effect that is gone, or a value that is another by
    /// more than noise and rounding.
    pub(super) fn changed(&self, told: &[Described]) -> bool {
        (self.effects.iter().zip(told)).any(|((effect, ..), now)| match now.fate {
            Fate::Dropped => true,
            Fate::FittedAgain => effect.values().any(|(p, stated)| {
                (now.parameters.get(p.name)).is_some_and(|value| is_another(value, stated))
            }),
            Fate::Held | Fate::InTheLink => false,
        })
    }

    /// Holds free effects that are not among those found and that the recordings do not contradict; whether there was one.
    /// Those that encoders on the links have `refuted` are contradicted.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn hold_what_is_not_refuted(
        &mut self,
        source: &Source,
        base: &Fit,
        found: &[Profile],
        refuted: &dyn Fn(&Candidate) -> bool,
    ) -> Result<bool, DiagnoseError> {
        let stays = self.matched(found);
        let fit = with(base, found, None);
        let mut changed = false;
        for ((_, placed, way), stays) in self.effects.iter_mut().zip(stays) {
            // Of two gears on a joint the one that was found stands for both.
            let replaced = is_gear(placed.effect.kind)
                && (found.iter())
                    .any(|p| p.candidate.joint == placed.joint && is_gear(p.candidate.kind));
            if *way != Way::Free || stays.is_some() || replaced || refuted(&candidate(placed)) {
                continue;
            }
            let columns = source.columns(&candidate(placed), &placed.effect.shapes)?;
            let open = vec![[f64::NEG_INFINITY, f64::INFINITY]; columns.len()];
            let shown = (fit.distinct(&columns)).and_then(|own| fit.evidence(&own, &open));
            let why = match shown {
                None => {
                    "along this motion its torque is a combination of what other parameters give"
                }
                Some(e)
                    if (gains(placed).iter().zip(e.gains.iter().zip(&e.stds)))
                        .all(|(stated, (gain, std))| (gain - stated).abs() <= AGREES * std) =>
                {
                    "these recordings neither show nor contradict it"
                }
                Some(_) => continue,
            };
            *way = Way::held(placed.effect.kind, why);
            changed = true;
        }
        Ok(changed)
    }

    /// For each effect the place of what it has become among those found; of several under one name the nearest in shape.
    pub(super) fn matched(&self, found: &[Profile]) -> Vec<Option<usize>> {
        let mut taken = vec![false; found.len()];
        (self.effects.iter())
            .map(|(_, placed, way)| {
                let off = |k: &usize| (found[*k].shapes[0] - placed.effect.shapes[0]).abs();
                let place = (0..found.len())
                    .filter(|k| *way == Way::Free && !taken[*k])
                    .filter(|k| is_one(placed, &found[*k].candidate))
                    .min_by(|a, b| off(a).total_cmp(&off(b)))?;
                taken[place] = true;
                Some(place)
            })
            .collect()
    }

    /// What became of each, in the order of the description; `now` are law and parameters of those that are still in the
    /// model.
    pub(super) fn told(&self, now: Vec<Option<Now>>) -> Vec<Described> {
        (self.effects.iter().zip(now))
            .map(|((effect, placed, way), now)| {
                let kind = now.as_ref().map_or(placed.effect.kind, |now| now.kind);
                let joint = &self.robot.joints[placed.joint];
                let what = format!("{} of joint {}", title_of(kind), joint.name);
                let (fate, text) = match (way, &now) {
                    (Way::Link, _) => (
                        Fate::InTheLink,
                        format!("The description's payload on joint {} counts as part of its link, where model.toml has it.", joint.name),
                    ),
                    (Way::Held { why, taken_off }, _) => (
                        Fate::Held,
                        format!(
                            "The description's {what} is held as stated{}: {why}.",
                            if *taken_off { ", and was taken off the recordings" } else { "" }
                        ),
                    ),
                    (Way::Free, Some(now)) => (
                        Fate::FittedAgain,
                        format!(
                            "The description's {what} stays, fitted again together with everything else.{}",
                            what_changed(effect, now, joint.kind)
                        ),
                    ),
                    (Way::Free | Way::GivenUp, _) => {
                        let values = effect.values().map(|(p, value)| {
                            let unit = unit_of(p, joint.kind);
                            format!("{} {} {unit}", p.name, format_significant(value, 3))
                        });
                        let values: Vec<String> = values.collect();
                        (
                            Fate::Dropped,
                            format!(
                                "The description's {what} ({}) is not in model.toml: beside everything else that these recordings show it does not stand as stated.{}",
                                values.join(", "),
                                match way {
                                    Way::GivenUp => " What they show of a tilt is in the direction of gravity.",
                                    _ => "",
                                }
                            ),
                        )
                    }
                };
                Described {
                    effect: kind.about().name.to_owned(),
                    law: kind.about().law.map(str::to_owned),
                    joint: joint.name.clone(),
                    fate,
                    parameters: now.map(|now| now.parameters).unwrap_or_default(),
                    text,
                }
            })
            .collect()
    }

    /// Decides what a model that a voltage drives makes of the effects: those of its `library` are fitted again, other
    /// torques take part as they are, the rest does not. Gives those that take part, and which of them are fitted.
    pub(super) fn driven(&mut self, library: &[Kind]) -> Vec<(Effect<f64>, bool)> {
        let mut parts = Vec::new();
        for (_, placed, way) in self.effects.iter_mut().filter(|(.., w)| *w != Way::Link) {
            let kind = placed.effect.kind;
            let fitted = library.contains(&kind);
            let torque = is_torque(kind) && kind != Kind::ViscousWarmupTemperature;
            if fitted || torque {
                parts.push((placed.effect, fitted));
            }
            *way = if fitted {
                Way::Free
            } else {
                let why = if torque {
                    "it takes part in the simulation, and is not fitted to a voltage"
                } else {
                    "the simulation of a joint that its voltage drives does not have it"
                };
                Way::Held {
                    why: why.into(),
                    taken_off: false,
                }
            };
        }
        parts
    }

    /// Tables of the effects that take no part in a model that a voltage drives; after [`Self::driven`].
    pub(super) fn undriven(&self) -> Vec<RobotEffect> {
        (self.held())
            .filter(|e| {
                !is_torque(e.effect.kind) || e.effect.kind == Kind::ViscousWarmupTemperature
            })
            .cloned()
            .collect()
    }

    /// Kinds of the effects that are fitted again; none for the others, in the order of the description.
    pub(super) fn fitted(&self) -> impl Iterator<Item = Option<Kind>> {
        let of =
            |(_, placed, way): &(_, Placed, Way)| (*way == Way::Free).then_some(placed.effect.kind);
        self.effects.iter().map(of)
    }
}

/// What a described effect is in the last model.
pub(super) struct Now {
    /// By which law.
    pub(super) kind: Kind,
    /// As fitted.
    pub(super) parameters: BTreeMap<String, Value>,
}

/// Whether a fitted value is another than the one stated, by more than noise and rounding.
fn is_another(value: &Value, stated: f64) -> bool {
    let off = (value.value - stated).abs();
    off > CHANGED * stated.abs() && off > SURE * value.std
}

/// What of a stated effect's values has changed, a sentence; empty where nothing has.
fn what_changed(effect: &RobotEffect, now: &Now, kind: JointKind) -> String {
    let changed: Vec<String> = (effect.values())
        .filter_map(|(p, stated)| {
            let value = now.parameters.get(p.name)?;
            let unit = match unit_of(p, kind) {
                unit if unit == "1" => String::new(),
                unit => format!(" {}", format_unit(&unit)),
            };
            let [from, to] = [stated, value.value].map(|x| format_significant(x, 4));
            is_another(value, stated).then(|| format!("{} from {from} to {to}{unit}", p.name))
        })
        .collect();
    match changed.as_slice() {
        [] => String::new(),
        list => format!(" Changed: {}.", list.join(", ")),
    }
}

/// The place of a described effect in a library.
pub(super) fn candidate(placed: &Placed) -> Candidate {
    Candidate::on(placed.effect.kind, placed.joint)
        .naming(placed.other)
        .shaped(&placed.effect.shapes)
}

/// What the columns of a described effect are multiplied by: a gear's twist counts once.
pub(super) fn gains(placed: &Placed) -> Vec<f64> {
    if is_gear(placed.effect.kind) {
        return vec![1.0];
    }
    placed.effect.gains[..placed.effect.kind.about().gains.len()].to_vec()
}

/// Whether an effect is the described one, by whatever law; a wave of another order is another effect.
pub(super) fn is_one(placed: &Placed, effect: &Candidate) -> bool {
    placed.effect.kind.about().name == effect.kind.about().name
        && placed.joint == effect.joint
        && placed.other == effect.other
        && !candidate(placed).is_another_order(effect)
}

/// Counts a payload to its link, where the description says what the link weighs.
fn carried(robot: &mut Robot, placed: &Placed) {
    let (mass, arm) = (placed.effect.gains[0], placed.effect.shapes[0]);
    if let Some(link) = robot.joints[placed.joint].inertial.as_mut() {
        link.mass += mass;
        link.first_moment[0] += mass * arm;
        // Iyy and Izz of a point on x.
        link.inertia[3] += mass * arm * arm;
        link.inertia[5] += mass * arm * arm;
    }
}

#[cfg(test)]
mod tests;
