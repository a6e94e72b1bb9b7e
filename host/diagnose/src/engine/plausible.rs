//! What a machine can have: physical plausibility of a name, in one table with its sources.
//!
//! A name that fails here stands in for something that the library does not hold, such as slow friction, a lag or flexible links. It
//! is not taken, and what it explained is left as a remainder.

use rig_shared::effects::Kind;

use crate::profile::Profile;
use crate::refit::Joint;
use crate::search::Search;

/// One thing that a machine cannot have.
struct Belief {
    /// Of which effects.
    kinds: &'static [Kind],
    /// What is asked; true where the machine cannot have it.
    fails: fn(&Asked, usize) -> bool,
    /// Why it is refused, a clause.
    why: &'static str,
}

/// The effects and what they are judged by.
pub(super) struct Asked<'a, 'r> {
    /// The library on the training data.
    pub(super) search: &'a Search<'r>,
    /// All effects fitted together.
    pub(super) joint: &'a Joint,
    /// Free nominal directions.
    pub(super) free: usize,
    /// The effects.
    pub(super) chosen: &'a [Profile],
}

/// Twist of a joint of an arm under the RMS torque that the arm puts on it, rad. Lightweight arms, the softest that are no series
/// elastic actuators, have 6 to 15 kN·m/rad at up to 200 N·m (Albu-Schäffer et al. 2007, "The DLR lightweight robot", Industrial Robot
/// 34(5)): 20 mrad at the full torque. A softer joint sags so far that a user knows it and describes it.
const MOST_SAG: f64 = 0.02;
/// Standard deviations by which a gap has to be larger than none. Two: its 95 % interval then leaves out zero.
const SURE_OF_A_GAP: f64 = 2.0;
/// Standard deviations by which delays of two joints of one recorder may differ. Three: one pair in 400 by chance.
const ONE_CLOCK: f64 = 3.0;

const TABLE: [Belief; 4] = [
    Belief {
        kinds: &[Kind::JointElasticity],
        fails: sags,
        why: "the arm would sag on it by more than 20 mrad under its own load, and no arm that is not described so is as soft",
    },
    Belief {
        kinds: &[Kind::Backlash],
        fails: gap_may_be_none,
        why: "its gap is less than two of its standard deviations",
    },
    Belief {
        kinds: &[Kind::MeasurementDelay],
        fails: another_clock,
        why: "other joints of the same recorder do not have that delay, and one recorder has one clock",
    },
    Belief {
        kinds: &[Kind::InertiaCoupling],
        fails: not_neighbours,
        why: "the two joints are not neighbours, and drives are coupled between neighbours only (wrists, parallelograms)",
    },
];

impl Asked<'_, '_> {
    /// The first of the effects `found` that the machine cannot have, and why.
    pub(super) fn implausible(
        &self,
        mut found: std::ops::Range<usize>,
    ) -> Option<(usize, &'static str)> {
        let of = |k: usize| {
            let kind = self.chosen[k].candidate.kind;
            let own = TABLE.iter().filter(|belief| belief.kinds.contains(&kind));
            let mut own = own.filter(|belief| (belief.fails)(self, k));
            own.next().map(|belief| (k, belief.why))
        };
        found.find_map(of)
    }

    fn joints(&self) -> usize {
        self.search.source.robot.joints.len()
    }

    /// Value of a shape of an effect, with its standard deviation where the motion tells one.
    fn shape(&self, k: usize, name: &str) -> Option<(f64, Option<f64>)> {
        let profile = &self.chosen[k];
        let shapes = profile.candidate.kind.about().shapes;
        let place = shapes.iter().position(|shape| shape.name == name)?;
        let told = self.joint.shapes(self.chosen);
        let std = told.iter().find(|(at, _)| *at == (k, place));
        Some((profile.shapes[place], std.map(|(_, [_, std])| *std)))
    }

    /// The delay of an effect and its variance.
    fn delay(&self, k: usize) -> [f64; 2] {
        let [value, std] = self.joint.gain(self.chosen, self.free, k, 0);
        [value, std * std]
    }
}

/// Whether an arm would sag on an elastic joint. A single link may be on any spring.
fn sags(asked: &Asked, k: usize) -> bool {
    let Some((stiffness, _)) = asked.shape(k, "stiffness").filter(|_| asked.joints() > 1) else {
        return false;
    };
    let own = asked.chosen[k].candidate.joint;
    // A joint about the vertical carries the same weight across its axis as the next one turns.
    let loads = (own..asked.joints()).map(|joint| {
        let predicted = &asked.search.source.predicted;
        let all = || predicted.iter().flat_map(|run| &run.load[joint]);
        let squares: f64 = all().map(|load| load * load).sum();
        (squares / all().count().max(1) as f64).sqrt()
    });
    loads.fold(0.0, f64::max) > MOST_SAG * stiffness
}

/// Whether a gap could as well be none.
fn gap_may_be_none(asked: &Asked, k: usize) -> bool {
    // Of a gap that the motion does not tell there is no deviation.
    (asked.shape(k, "gap"))
        .is_some_and(|(gap, std)| std.is_none_or(|std| gap < SURE_OF_A_GAP * std))
}

/// Whether a delay of an arm's joint is not that of all joints that move.
fn another_clock(asked: &Asked, k: usize) -> bool {
    let delays = |kind: Kind| kind == Kind::MeasurementDelay;
    let library = asked.search.library.iter();
    let moving = library.filter(|c| delays(c.kind)).count();
    let found: Vec<usize> = (0..asked.chosen.len())
        .filter(|i| delays(asked.chosen[*i].candidate.kind))
        .collect();
    let [own, variance] = asked.delay(k);
    let differs = |i: &usize| {
        let [other, more] = asked.delay(*i);
        (own - other).abs() > ONE_CLOCK * (variance + more).sqrt()
    };
    asked.joints() > 1 && (found.len() < moving || found.iter().any(differs))
}

/// Whether a coupling is one of joints that are not next to each other.
fn not_neighbours(asked: &Asked, k: usize) -> bool {
    let candidate = asked.chosen[k].candidate;
    (candidate.other).is_some_and(|other| candidate.joint.abs_diff(other) > 1)
}
