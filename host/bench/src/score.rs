//! Computes figures from the answers of a method.
//!
//! An effect is *above the floor* if its residual after a refit of the nominal model is at least half of the noise
//! floor ([`rig_scenario::Size::above_floor`]). Names that describe exactly the same function of the recording count as one.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::cases::Group;
use super::outcome::Outcome;
use super::parameters::Compared;
use super::wilson::Proportion;
use rig_numerics::statistics::{mean, median_of_finite};
use rig_scenario::Effect;

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
    pub gap_closed: BTreeMap<GapClass, f64>,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GapClass {
    /// Backlash.
    Backlash,
    /// Elastic gear.
    Elasticity,
    /// Presliding.
    Presliding,
    /// Every other effect.
    Static,
}

impl GapClass {
    fn of(effect: &Effect) -> Self {
        match effect {
            Effect::Presliding { .. } => Self::Presliding,
            Effect::JointElasticity { .. } => Self::Elasticity,
            Effect::Backlash { .. } => Self::Backlash,
            _ => Self::Static,
        }
    }
}

impl Score {
    /// Computes the figures of a method.
    pub fn of(method: &str, outcomes: &[Outcome]) -> Self {
        let group = |group: Group| outcomes.iter().filter(move |o| o.group == group);
        let single = || group(Group::Single).filter(|o| o.above());
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
            false_discovery: false_discovery(outcomes),
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
            gap_closed: gap_closed(single()),
            left_wrongly: Proportion::of(complete.map(Outcome::remainder)),
            invented_silently: Proportion::of(left_out().map(|o| o.alarmed() && !o.remainder())),
            remainder_flagged: Proportion::of(left_out().map(Outcome::remainder)),
            set_returned: Proportion::of(single().filter_map(Outcome::whole_set)),
            experiment_runs: Proportion::of(
                (single().filter_map(Outcome::experiment)).map(|f| f.answer.is_some()),
            ),
            set_separated: Proportion::of(single().filter_map(Outcome::separated)),
            parameter_error: median_of_finite(compared().map(Compared::error).collect()),
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

/// Returns the mean share of wrong names in cases with hidden effects; none without such cases.
fn false_discovery(outcomes: &[Outcome]) -> Option<f64> {
    let something: Vec<f64> = outcomes
        .iter()
        .filter(|o| matches!(o.group, Group::Single | Group::Combination) && o.answer.is_some())
        .map(Outcome::false_discoveries)
        .collect();
    (!something.is_empty()).then(|| mean(&something))
}

/// Returns the median share of the gap that answers with a right first name close, by class of the hidden effect.
fn gap_closed<'a>(single: impl Iterator<Item = &'a Outcome>) -> BTreeMap<GapClass, f64> {
    let mut classes: BTreeMap<GapClass, Vec<f64>> = BTreeMap::new();
    for outcome in single.filter(|o| o.right_first()) {
        let closed = outcome.answer.as_ref().and_then(|a| a.gap_closed);
        if let (Some(share), [hidden]) = (closed, &outcome.hidden[..]) {
            let class = GapClass::of(&hidden.effect);
            classes.entry(class).or_default().push(share);
        }
    }
    let medians = classes.into_iter();
    medians
        .filter_map(|(class, shares)| Some((class, median_of_finite(shares)?)))
        .collect()
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
            gap_closed: median_of_finite(closed.collect()),
            parameter_error: median_of_finite(errors.map(Compared::error).collect()),
            taken_for,
        }
    }
}
