//! Computes figures from the answers of a method.
//!
//! An effect is *above the floor* if its residual after a refit of the nominal model is at least half of the noise
//! floor ([`Size::above_floor`]). Names that describe exactly the same function of the recording count as one.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::answer::{Answer, Named, exact_class, is_right, same_by_voltage};
use super::cases::Group;
use super::follow::Followed;
use super::parameters::Compared;
use super::wilson::Proportion;
use rig_scenario::{Hidden, Size};

/// One case and the answer of a method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Group of the case.
    pub group: Group,
    /// Level of noise.
    pub level: &'static str,
    /// Seed of the scenario.
    pub seed: u64,
    /// Hidden effects.
    pub hidden: Vec<Hidden>,
    /// Sizes of the hidden effects, in the order of `hidden`.
    pub sizes: Vec<Size>,
    /// Answer; none if the method failed.
    pub answer: Option<Answer>,
    /// Reason of a failure.
    pub failure: Option<String>,
    /// Result of the proposed experiment, if the first name was open and the experiment was to be followed.
    pub followed: Option<Followed>,
    /// Parameters of rightly named effects.
    pub parameters: Vec<Compared>,
}

/// The hidden effect that is a change of values in the description.
const PAYLOAD: &str = "payload";

/// Returns true if each name of `truth` is in a separate set and all sets are used.
pub(super) fn one_each(truth: &[&str], sets: &[BTreeSet<String>]) -> bool {
    match truth {
        [] => sets.is_empty(),
        [first, rest @ ..] => (0..sets.len()).any(|k| {
            let others = || [&sets[..k], &sets[k + 1..]].concat();
            sets[k].iter().any(|name| is_right(name, first)) && one_each(rest, &others())
        }),
    }
}

impl Outcome {
    fn truth(&self) -> Vec<&'static str> {
        // Random phases removed the hidden effect from the recording.
        if self.group.is_null() {
            return Vec::new();
        }
        self.hidden.iter().map(|h| h.effect.name()).collect()
    }

    /// Names in the answer. A change of values is the name of a payload if one is hidden, otherwise no name.
    fn names(&self) -> Vec<&str> {
        let Some(answer) = &self.answer else {
            return Vec::new();
        };
        if answer.changed && self.truth().contains(&PAYLOAD) {
            return vec![PAYLOAD];
        }
        answer.named.iter().map(|n| n.effect.as_str()).collect()
    }

    /// Returns true if the answer wrongly says that values of the description have changed.
    fn changed_wrongly(&self) -> bool {
        let is_so = self.group == Group::WrongDescription || self.truth().contains(&PAYLOAD);
        !is_so && self.answer.as_ref().is_some_and(|a| a.changed)
    }

    /// Returns true if every hidden effect is above the floor.
    pub fn above(&self) -> bool {
        self.sizes.iter().all(Size::above_floor)
    }

    /// Returns true if the first name is one of the hidden effects.
    pub fn right_first(&self) -> bool {
        let names = self.names();
        names
            .first()
            .is_some_and(|first| self.truth().iter().any(|truth| is_right(first, truth)))
    }

    /// Returns true if the names are exactly those of the hidden effects.
    pub fn exact(&self) -> bool {
        let classes = |names: &[&str]| -> BTreeSet<String> {
            let first = |name: &&str| exact_class(name).into_iter().next().unwrap_or(name).into();
            names.iter().map(first).collect()
        };
        // A failed method has no names, which is wrong if an effect is hidden.
        classes(&self.names()) == classes(&self.truth())
    }

    /// Returns true if each hidden effect is in the set of possible names of a separate step, and no step is left over.
    pub fn exact_as_sets(&self) -> bool {
        let named = |answer: &Answer| -> Vec<BTreeSet<String>> {
            let set = |n: &Named| n.set.iter().cloned().chain([n.effect.clone()]).collect();
            answer.named.iter().map(set).collect()
        };
        let sets = self.answer.as_ref().map_or(Vec::new(), named);
        self.exact() || one_each(&self.truth(), &sets)
    }

    /// Returns true if the answer has a name or wrongly says that values have changed.
    pub fn alarmed(&self) -> bool {
        !self.names().is_empty() || self.changed_wrongly()
    }

    /// Returns true if the answer has a wrong name or wrongly says that values have changed.
    pub fn invented(&self) -> bool {
        self.wrong() > 0 || self.changed_wrongly()
    }

    fn wrong(&self) -> usize {
        let truth = self.truth();
        let names = self.names();
        let unknown = |name: &&&str| !truth.iter().any(|t| is_right(name, t));
        names.iter().filter(unknown).count()
    }

    /// Share of wrong names; 0 if the answer has no names.
    pub fn false_discoveries(&self) -> f64 {
        self.wrong() as f64 / self.names().len().max(1) as f64
    }

    fn remainder(&self) -> bool {
        self.answer.as_ref().is_some_and(|a| a.remainder)
    }

    /// The followed experiment, if the first set holds the only hidden effect.
    fn experiment(&self) -> Option<&Followed> {
        let [truth] = self.truth()[..] else {
            return None;
        };
        let first = self.answer.as_ref()?.named.first()?;
        let held = first.set.iter().any(|name| is_right(name, truth));
        self.followed.as_ref().filter(|_| held)
    }

    /// Returns true if only the hidden effect is in the first set after the experiment.
    fn separated(&self) -> Option<bool> {
        let truth = self.truth().first().copied()?;
        let after = self.experiment()?.answer.as_ref()?;
        Some((after.named.first()).is_some_and(|first| first.set == [truth]))
    }

    /// For one hidden effect with indistinguishable partners: true if the first set holds them all; else none.
    fn whole_set(&self) -> Option<bool> {
        let [truth] = self.truth()[..] else {
            return None;
        };
        let class = same_by_voltage(truth);
        let set = self.answer.as_ref()?.named.first();
        (class.len() > 1).then(|| {
            set.is_some_and(|named| class.iter().all(|name| named.set.iter().any(|s| s == name)))
        })
    }
}

/// Figures of one method.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Name of the method.
    pub method: String,
    /// The first name is right; one hidden effect above the floor.
    pub right_first: Proportion,
    /// As `right_first`, including effects below the floor.
    pub right_first_any_size: Proportion,
    /// The answer has a name although no effect is hidden.
    pub false_alarm: Proportion,
    /// Mean share of wrong names in cases with hidden effects.
    pub false_discovery: Option<f64>,
    /// The names are exactly the hidden ones; one effect above the floor.
    pub exact_single: Proportion,
    /// The names are exactly the hidden ones; two or more effects, each above the floor.
    pub exact_combination: Proportion,
    /// As `exact_combination`, but an open name counts as right if its set holds the hidden effect.
    pub exact_combination_as_sets: Proportion,
    /// Median share of the gap on the hold-out that is closed if the first name is right, by class of effect.
    pub gap_closed: BTreeMap<&'static str, f64>,
    /// The answer has a remainder although no effect is hidden, or although the only hidden effect was named exactly.
    pub left_wrongly: Proportion,
    /// Effect not in the library: the answer has a name and no remainder.
    pub invented_silently: Proportion,
    /// Effect not in the library: the answer has a remainder.
    pub remainder_flagged: Proportion,
    /// Effect of an exactly confounded set: the answer has the whole set.
    pub set_returned: Proportion,
    /// The rig can run the experiment proposed for a first set with the hidden effect, with or without external loads.
    pub experiment_runs: Proportion,
    /// Share of these experiments after which only the hidden effect is in the set.
    pub set_separated: Proportion,
    /// Median relative error of the parameters of rightly named effects.
    pub parameter_error: Option<f64>,
    /// 95 % intervals that hold the true value, only for laws of the same form.
    pub coverage: Proportion,
    /// Wrong names, by negative control.
    pub controls: BTreeMap<Group, Proportion>,
    /// Figures for each effect, from cases with one hidden effect.
    pub effects: BTreeMap<&'static str, EffectScore>,
    /// Number of cases in which the method failed.
    pub failed: usize,
}

/// Figures of one effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct EffectScore {
    /// The first name is right; effects above the floor.
    pub right_first: Proportion,
    /// The names are exact; effects above the floor.
    pub exact: Proportion,
    /// The answer has a wrong name; effects below the floor.
    pub invented_below: Proportion,
    /// Median share of the gap closed on the hold-out; effects above the floor with a right first name.
    pub gap_closed: Option<f64>,
    /// Median relative error of the parameters.
    pub parameter_error: Option<f64>,
    /// Wrong first names and their counts; effects above the floor.
    pub taken_for: BTreeMap<String, usize>,
}

/// Class of an effect for the figure of the gap closed.
fn class_of(effect: &str) -> &'static str {
    match effect {
        "presliding" => "presliding",
        "joint_elasticity" => "elasticity",
        "backlash" => "backlash",
        _ => "static",
    }
}

pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let (low, high) = (values.get(n.saturating_sub(1) / 2)?, values.get(n / 2)?);
    Some(0.5 * (low + high))
}

impl Score {
    /// Computes the figures of a method.
    pub fn of(method: &str, outcomes: &[Outcome]) -> Self {
        let group = |group: Group| outcomes.iter().filter(move |o| o.group == group);
        let single = || group(Group::Single).filter(|o| o.above());
        let closed = |o: &&Outcome| {
            let share = o.answer.as_ref().and_then(|a| a.gap_closed)?;
            o.right_first().then_some(share)
        };
        let mut classes: BTreeMap<&'static str, Vec<f64>> = BTreeMap::new();
        for outcome in single() {
            if let (Some(share), [hidden]) = (closed(&outcome), &outcome.hidden[..]) {
                classes
                    .entry(class_of(hidden.effect.name()))
                    .or_default()
                    .push(share);
            }
        }
        let something: Vec<f64> = outcomes
            .iter()
            .filter(|o| matches!(o.group, Group::Single | Group::Combination) && o.answer.is_some())
            .map(Outcome::false_discoveries)
            .collect();
        let compared = || single().flat_map(|o| &o.parameters);
        // A wrong value of the description does not belong to the library: "changed" is then the right verdict.
        let only_values = |o: &&Outcome| o.sizes.iter().all(|size| size.parameter_change);
        let left_out = || {
            let all = group(Group::LeftOut).filter(|o| o.above());
            all.filter(move |o| !only_values(o))
        };
        let complete = (outcomes.iter()).filter(|o| {
            o.group == Group::Nothing || o.group == Group::Single && o.above() && o.exact()
        });
        let controls = [
            Group::WrongDescription,
            Group::PhaseRandomised,
            Group::Faint,
            Group::PoorExcitation,
            Group::OneRunOnly,
            Group::FineStep,
        ];
        let names: BTreeSet<&'static str> = group(Group::Single)
            .flat_map(|o| o.hidden.iter().map(|h| h.effect.name()))
            .collect();
        Self {
            method: method.into(),
            right_first: Proportion::of(single().map(Outcome::right_first)),
            right_first_any_size: Proportion::of(group(Group::Single).map(Outcome::right_first)),
            false_alarm: Proportion::of(group(Group::Nothing).map(Outcome::alarmed)),
            false_discovery: (!something.is_empty())
                .then(|| something.iter().sum::<f64>() / something.len() as f64),
            exact_single: Proportion::of(single().map(Outcome::exact)),
            exact_combination: Proportion::of(
                group(Group::Combination)
                    .filter(|o| o.above())
                    .map(Outcome::exact),
            ),
            exact_combination_as_sets: Proportion::of(
                group(Group::Combination)
                    .filter(|o| o.above())
                    .map(Outcome::exact_as_sets),
            ),
            gap_closed: classes
                .into_iter()
                .filter_map(|(class, shares)| Some((class, median(shares)?)))
                .collect(),
            left_wrongly: Proportion::of(complete.map(Outcome::remainder)),
            invented_silently: Proportion::of(left_out().map(|o| o.alarmed() && !o.remainder())),
            remainder_flagged: Proportion::of(left_out().map(Outcome::remainder)),
            set_returned: Proportion::of(single().filter_map(Outcome::whole_set)),
            experiment_runs: Proportion::of(
                (single().filter_map(Outcome::experiment)).map(|f| f.answer.is_some()),
            ),
            set_separated: Proportion::of(single().filter_map(Outcome::separated)),
            parameter_error: median(compared().map(Compared::error).collect()),
            coverage: Proportion::of(compared().filter(|c| c.same_form).map(Compared::covered)),
            controls: controls
                .into_iter()
                .map(|g| (g, Proportion::of(group(g).map(Outcome::invented))))
                .filter(|(_, p)| p.of > 0)
                .collect(),
            effects: names
                .into_iter()
                .map(|name| (name, EffectScore::of(name, outcomes)))
                .collect(),
            failed: outcomes.iter().filter(|o| o.answer.is_none()).count(),
        }
    }
}

impl EffectScore {
    fn of(name: &str, outcomes: &[Outcome]) -> Self {
        let all: Vec<&Outcome> = outcomes
            .iter()
            .filter(|o| o.group == Group::Single)
            .filter(|o| o.hidden.iter().any(|h| h.effect.name() == name))
            .collect();
        let (above, below): (Vec<&Outcome>, Vec<&Outcome>) =
            all.into_iter().partition(|o| o.above());
        let mut taken_for = BTreeMap::new();
        for outcome in above.iter().filter(|o| !o.right_first()) {
            let first = outcome.names().first().map_or("nothing", |name| *name);
            *taken_for.entry(first.to_owned()).or_insert(0) += 1;
        }
        let closed = above.iter().filter(|o| o.right_first());
        let closed = closed.filter_map(|o| o.answer.as_ref()?.gap_closed);
        let errors = above.iter().flat_map(|o| &o.parameters);
        Self {
            right_first: Proportion::of(above.iter().map(|o| o.right_first())),
            exact: Proportion::of(above.iter().map(|o| o.exact())),
            invented_below: Proportion::of(below.iter().map(|o| o.invented())),
            gap_closed: median(closed.collect()),
            parameter_error: median(errors.map(Compared::error).collect()),
            taken_for,
        }
    }
}
