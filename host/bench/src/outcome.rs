//! Answer of a method to one case, compared with what is hidden there.

use std::collections::BTreeSet;

use rig_shared::effects::Kind;
use serde::Serialize;

use super::answer::{Answer, Named, exact_class, is_right, same_by_voltage};
use super::cases::Group;
use super::follow::Followed;
use super::parameters::Compared;
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
const PAYLOAD: &str = Kind::Payload.about().name;

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
    pub(super) fn names(&self) -> Vec<&str> {
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

    /// Returns true if the answer has an unexplained remainder.
    pub(super) fn remainder(&self) -> bool {
        self.answer.as_ref().is_some_and(|a| a.remainder)
    }

    /// The followed experiment, if the first set holds the only hidden effect.
    pub(super) fn experiment(&self) -> Option<&Followed> {
        let [truth] = self.truth()[..] else {
            return None;
        };
        let first = self.answer.as_ref()?.named.first()?;
        let held = first.set.iter().any(|name| is_right(name, truth));
        self.followed.as_ref().filter(|_| held)
    }

    /// Returns true if only the hidden effect is in the first set after the experiment.
    pub(super) fn separated(&self) -> Option<bool> {
        let truth = self.truth().first().copied()?;
        let after = self.experiment()?.answer.as_ref()?;
        Some((after.named.first()).is_some_and(|first| first.set == [truth]))
    }

    /// For one hidden effect with indistinguishable partners: true if the first set holds them all; else none.
    pub(super) fn whole_set(&self) -> Option<bool> {
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
