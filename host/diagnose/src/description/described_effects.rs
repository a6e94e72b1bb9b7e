//! Described effects beyond the standard model, and their treatment.
//!
//! A described effect starts the search with its parameters, and is refitted with everything else. If the recordings
//! neither show nor contradict it, it is held as described, and its torque subtracted. So is one without columns in the
//! search. A tilt is held until the recordings show another one, which then replaces it. A payload is a mass of its
//! link.
//!
//! Limit: held effects between motor and link cannot be subtracted from the torque of a given motion.

use std::collections::BTreeMap;

use rig_shared::effects::{Channel, Effect, Kind};
use rig_shared::multibody::Chain;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::is_gear;
use crate::description::fate::{DescribedFate, FateCause, HeldBecause, StatedParameter};
use crate::description::lifted_limit::LiftedLimit;
use crate::fit::least_squares::Fit;
use crate::outcome::{Described, Fate, Value};
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::effects::{Effects, is_torque};
use rig_model::robot::{JointKind, Placed, Robot, RobotEffect, unit_of};

/// Standard deviations within which a fitted gain agrees with the described one.
const AGREES: f64 = 3.0;
/// Relative difference above which a value has changed …
const CHANGED: f64 = 0.1;
/// … and the standard deviations that it must also exceed.
const SURE: f64 = 5.0;

/// Treatment of a described effect.
#[derive(Clone, Debug, PartialEq)]
enum Way {
    /// Part of the link.
    Link,
    /// Fitted: the search begins with it.
    Free,
    /// Held as described, with the reason, and whether its torque is subtracted.
    Held { why: HeldBecause, taken_off: bool },
    /// Removed: the recordings show another effect of its kind.
    GivenUp,
}

impl Way {
    /// Returns the treatment of an effect held in a search by torque.
    fn held(kind: Kind, why: HeldBecause) -> Self {
        let seen = !matches!(
            kind.about().channel,
            Channel::Voltage | Channel::Transmission
        );
        Self::Held {
            why,
            taken_off: seen && kind != Kind::ViscousWarmupTemperature,
        }
    }
}

/// The effects of a description.
#[derive(Clone, Debug)]
pub(crate) struct DescribedEffects {
    /// The description without its effects; payloads are part of their links.
    pub(crate) robot: Robot,
    /// True if the format of the description has no constant torque.
    pub(crate) no_offsets: bool,
    /// True if the recordings tell which part of a described constant torque is external.
    pub(crate) loads_separable: bool,
    /// True if the readings of the sensors with the drive off are given.
    pub(crate) zeros_given: bool,
    /// The ignored torque limits.
    pub(crate) lifted: Vec<LiftedLimit>,
    effects: Vec<(RobotEffect, Placed, Way)>,
}

impl DescribedEffects {
    /// Reads the effects of a description.
    pub(crate) fn of(robot: &Robot) -> Self {
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
                    kind @ Kind::GravityTilt => Way::held(kind, HeldBecause::DirectionOfGravity),
                    kind if kind.about().channel == Channel::Voltage => {
                        Way::held(kind, HeldBecause::VoltageAlone)
                    }
                    _ => Way::Free,
                };
                (effect, placed, way)
            })
            .collect();
        Self {
            robot: plain,
            no_offsets: false,
            loads_separable: false,
            zeros_given: false,
            lifted: Vec::new(),
            effects,
        }
    }

    /// Returns the effects that are refitted, in the order of the description.
    pub(crate) fn free(&self) -> Vec<Placed> {
        let of = |(_, placed, way): &(_, Placed, Way)| (*way == Way::Free).then_some(*placed);
        self.effects.iter().filter_map(of).collect()
    }

    /// Returns the tables of the held effects.
    pub(crate) fn held(&self) -> impl Iterator<Item = &RobotEffect> {
        let held = |(_, _, way): &&(RobotEffect, Placed, Way)| matches!(way, Way::Held { .. });
        self.effects.iter().filter(held).map(|(effect, ..)| effect)
    }

    /// Returns the removed effects.
    pub(crate) fn given_up(&self) -> impl Iterator<Item = &Placed> {
        let out = |(_, _, way): &&(_, Placed, Way)| *way == Way::GivenUp;
        self.effects.iter().filter(out).map(|(_, placed, _)| placed)
    }

    /// Removes held tilts if a tilt was found beside them. A wrong described tilt would otherwise appear as a
    /// difference. Returns true if any was removed.
    pub(crate) fn give_up_tilts(&mut self, found: &[FittedCandidate]) -> bool {
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

    /// Returns true if an effect of the kind is held on a joint.
    pub(crate) fn holds(&self, kind: Kind, joint: usize) -> bool {
        let of = |(_, placed, way): &(_, Placed, Way)| {
            placed.effect.kind == kind && placed.joint == joint && matches!(way, Way::Held { .. })
        };
        self.effects.iter().any(of)
    }

    /// Returns true if the description has the effect, with any treatment.
    pub(crate) fn states(&self, effect: &Candidate) -> bool {
        self.effects
            .iter()
            .any(|(_, placed, _)| is_one(placed, effect))
    }

    /// Returns the held effects to subtract from recordings, without external loads if `unburdened`; None if nothing is
    /// held.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description makes no chain.
    pub(crate) fn taken_off(
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
        let chain = robot.chain().map_err(|e| failed(&e))?;
        Ok(Some((effects, chain)))
    }

    /// Returns the description to simulate and compare with recordings without the torque of held effects.
    pub(crate) fn moving(&self) -> Robot {
        let free = self.effects.iter().filter(|(.., way)| *way == Way::Free);
        Robot {
            effects: free.map(|(effect, ..)| effect.clone()).collect(),
            ..self.robot.clone()
        }
    }

    /// Holds fitted effects that are not in the library. Returns true if there was one.
    pub(crate) fn hold_what_is_not_in(&mut self, library: &[Candidate]) -> bool {
        let mut changed = false;
        for (_, placed, way) in self.effects.iter_mut().filter(|(.., w)| *w == Way::Free) {
            if !library.contains(&candidate(placed).sort()) {
                let why = match placed.effect.kind {
                    Kind::ViscousWarmupTemperature => HeldBecause::NoTemperature,
                    _ => HeldBecause::LeftOut,
                };
                *way = Way::held(placed.effect.kind, why);
                changed = true;
            }
        }
        changed
    }

    /// Holds delays of up to `sampling_jitter`, s: without a description they would count as sampling. Returns true if there was
    /// one.
    pub(crate) fn hold_delays(&mut self, sampling_jitter: f64) -> bool {
        let mut changed = false;
        for (_, placed, way) in self.effects.iter_mut().filter(|(.., w)| *w == Way::Free) {
            let kind = placed.effect.kind;
            if kind == Kind::MeasurementDelay && placed.effect.gains[0] <= sampling_jitter {
                *way = Way::held(kind, HeldBecause::WithinSampling);
                changed = true;
            }
        }
        changed
    }

    /// Returns true if the fit changed the described effects: one is gone, or a value differs by more than noise and
    /// rounding.
    pub(crate) fn changed(&self, told: &[Described]) -> bool {
        (self.effects.iter().zip(told)).any(|((effect, ..), now)| match now.fate {
            Fate::Dropped => true,
            Fate::FittedAgain => effect.values().any(|(p, stated)| {
                (now.parameters.get(p.name)).is_some_and(|value| is_another(value, stated))
            }),
            Fate::Held | Fate::InTheLink => false,
        })
    }

    /// Holds fitted effects that were not found, unless the recordings contradict them. Link encoders contradict those
    /// that are `refuted`. Returns true if any was held.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn hold_what_is_not_refuted(
        &mut self,
        source: &Source,
        base: &Fit,
        found: &[FittedCandidate],
        refuted: &dyn Fn(&Candidate) -> bool,
    ) -> Result<bool, DiagnoseError> {
        let stays = self.matched(found);
        let fit = with(base, found, None);
        let mut changed = false;
        for ((_, placed, way), stays) in self.effects.iter_mut().zip(stays) {
            // If another gear was found on the joint, it replaces this one.
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
                None => HeldBecause::Collinear,
                Some(e)
                    if (gains(placed).iter().zip(e.gains.iter().zip(&e.stds)))
                        .all(|(stated, (gain, std))| (gain - stated).abs() <= AGREES * std) =>
                {
                    HeldBecause::NotShown
                }
                Some(_) => continue,
            };
            *way = Way::held(placed.effect.kind, why);
            changed = true;
        }
        Ok(changed)
    }

    /// Returns the index of each described effect among those found; with several orders, the nearest one.
    pub(crate) fn matched(&self, found: &[FittedCandidate]) -> Vec<Option<usize>> {
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

    /// Returns the fate of each described effect, in order. `now` are law and parameters of those in the last model.
    pub(crate) fn fates(&self, now: Vec<Option<Now>>) -> Vec<DescribedFate> {
        (self.effects.iter().zip(now))
            .map(|((effect, placed, way), now)| {
                let joint = self.robot.joints[placed.joint].kind;
                let cause = match (way, &now) {
                    (Way::Link, _) => FateCause::InTheLink,
                    (Way::Held { why, taken_off }, _) => FateCause::Held {
                        why: *why,
                        taken_off: *taken_off,
                    },
                    (Way::Free, Some(now)) => FateCause::FittedAgain {
                        changed: changed_values(effect, now, joint),
                    },
                    (Way::Free | Way::GivenUp, _) => FateCause::Dropped {
                        stated: (effect.values())
                            .map(|(p, stated)| StatedParameter {
                                name: p.name,
                                stated,
                                unit: unit_of(p, joint),
                            })
                            .collect(),
                        replaced_tilt: *way == Way::GivenUp,
                    },
                };
                DescribedFate {
                    kind: now.as_ref().map_or(placed.effect.kind, |now| now.kind),
                    joint: placed.joint,
                    cause,
                    parameters: now.map(|now| now.parameters).unwrap_or_default(),
                }
            })
            .collect()
    }

    /// Sets the treatment for a model with a voltage input. Effects of its `library` are refitted, other torques take
    /// part unchanged, the rest is ignored. Returns those that take part, and whether each is fitted.
    pub(crate) fn driven(&mut self, library: &[Kind]) -> Vec<(Effect<f64>, bool)> {
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
                    HeldBecause::NotFittedToVoltage
                } else {
                    HeldBecause::NotSimulated
                };
                Way::Held {
                    why,
                    taken_off: false,
                }
            };
        }
        parts
    }

    /// Returns the tables of effects that take no part in a model with a voltage input; after [`Self::driven`].
    pub(crate) fn undriven(&self) -> Vec<RobotEffect> {
        (self.held())
            .filter(|e| {
                !is_torque(e.effect.kind) || e.effect.kind == Kind::ViscousWarmupTemperature
            })
            .cloned()
            .collect()
    }

    /// Returns the kinds of the refitted effects; None for the others, in the order of the description.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = Option<Kind>> {
        let of =
            |(_, placed, way): &(_, Placed, Way)| (*way == Way::Free).then_some(placed.effect.kind);
        self.effects.iter().map(of)
    }
}

/// A described effect in the last model.
pub(crate) struct Now {
    /// Its law.
    pub(crate) kind: Kind,
    /// Its fitted values.
    pub(crate) parameters: BTreeMap<String, Value>,
}

/// Returns true if a fitted value differs from the described one by more than noise and rounding.
fn is_another(value: &Value, stated: f64) -> bool {
    let off = (value.value - stated).abs();
    off > CHANGED * stated.abs() && off > SURE * value.std
}

/// Returns the changed parameters of a described effect, with their new values.
fn changed_values(effect: &RobotEffect, now: &Now, kind: JointKind) -> Vec<(StatedParameter, f64)> {
    (effect.values())
        .filter_map(|(p, stated)| {
            let value = now.parameters.get(p.name)?;
            let parameter = StatedParameter {
                name: p.name,
                stated,
                unit: unit_of(p, kind),
            };
            is_another(value, stated).then_some((parameter, value.value))
        })
        .collect()
}

/// Returns the candidate of a described effect.
pub(crate) fn candidate(placed: &Placed) -> Candidate {
    Candidate::on(placed.effect.kind, placed.joint)
        .naming(placed.other)
        .shaped(&placed.effect.shapes)
}

/// Returns the described gains of the columns. The twist of a gear has gain 1.
pub(crate) fn gains(placed: &Placed) -> Vec<f64> {
    if is_gear(placed.effect.kind) {
        return vec![1.0];
    }
    placed.effect.gains[..placed.effect.kind.about().gains.len()].to_vec()
}

/// Returns true if an effect is the described one, with any law. A wave of another order is another effect.
pub(crate) fn is_one(placed: &Placed, effect: &Candidate) -> bool {
    placed.effect.kind.about().name == effect.kind.about().name
        && placed.joint == effect.joint
        && placed.other == effect.other
        && !candidate(placed).is_another_order(effect)
}

/// Adds a payload to its link, if the description gives the link's mass.
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
