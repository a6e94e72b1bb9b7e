//! Physical plausibility of effects: one table with sources.
//!
//! An effect that fails here replaces something that the library lacks, such as slow friction, a lag or flexible links.
//! It is refused, and the torque that it explained becomes a remainder.

use rig_shared::effects::Kind;

use crate::fit::refit::Joint;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::refusal::Refusal;
use crate::search::stepwise::Search;

/// One physical limit.
struct Belief {
    /// Effects that it applies to.
    kinds: &'static [Kind],
    /// Returns true if a machine cannot have the effect.
    fails: fn(&Asked, usize) -> bool,
    /// Reason for the refusal.
    why: Refusal,
}

/// The effects and the results to judge them by.
pub(crate) struct Asked<'a, 'r> {
    /// The library on the training data.
    pub(crate) search: &'a Search<'r>,
    /// All effects fitted together.
    pub(crate) joint: &'a Joint,
    /// Free nominal directions.
    pub(crate) free: usize,
    /// The effects.
    pub(crate) chosen: &'a [FittedCandidate],
}

/// Largest plausible twist of an arm's joint under its RMS load, rad. Lightweight arms are the softest without series
/// elastic actuators: 6 to 15 kN·m/rad at up to 200 N·m, 20 mrad at full torque (Albu-Schäffer et al. 2007, "The DLR
/// lightweight robot", Industrial Robot 34(5)). On a softer joint the sag is visible, so the user describes it.
const MOST_SAG: f64 = 0.02;
/// Least ratio of a distance (gap, stroke) to its standard deviation. Two: the 95 % interval then excludes zero.
const SURE_OF_A_DISTANCE: f64 = 2.0;
/// Standard deviations by which two joints' delays on one recorder may differ. Three: by chance 1 pair in 400.
const ONE_CLOCK: f64 = 3.0;

const TABLE: [Belief; 5] = [
    Belief {
        kinds: &[Kind::JointElasticity],
        fails: sags,
        why: Refusal::Sags,
    },
    Belief {
        kinds: &[Kind::Backlash],
        fails: |asked, k| may_be_none(asked, k, "gap"),
        why: Refusal::NoGap,
    },
    // Without a stroke it is the Coulomb friction that the description has.
    Belief {
        kinds: &[Kind::PreslidingDahl],
        fails: |asked, k| may_be_none(asked, k, "stroke"),
        why: Refusal::NoStroke,
    },
    Belief {
        kinds: &[Kind::MeasurementDelay],
        fails: another_clock,
        why: Refusal::AnotherClock,
    },
    Belief {
        kinds: &[Kind::InertiaCoupling],
        fails: not_neighbours,
        why: Refusal::NotNeighbours,
    },
];

impl Asked<'_, '_> {
    /// Returns the first implausible effect among `found`, with the reason.
    pub(crate) fn implausible(
        &self,
        mut found: std::ops::Range<usize>,
    ) -> Option<(usize, Refusal)> {
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

    /// Returns the value of a named shape, and its standard deviation if it is identifiable.
    fn shape(&self, k: usize, name: &str) -> Option<(f64, Option<f64>)> {
        let profile = &self.chosen[k];
        let shapes = profile.candidate.kind.about().shapes;
        let place = shapes.iter().position(|shape| shape.name == name)?;
        let told = self.joint.shapes(self.chosen);
        let std = told.iter().find(|(at, _)| *at == (k, place));
        Some((profile.shapes[place], std.map(|(_, [_, std])| *std)))
    }

    /// Returns the delay of an effect and its variance.
    fn delay(&self, k: usize) -> [f64; 2] {
        let [value, std] = self.joint.gain(self.chosen, self.free, k, 0);
        [value, std * std]
    }
}

/// Returns true if an arm would sag too much on an elastic joint. A single link may have any spring.
fn sags(asked: &Asked, k: usize) -> bool {
    let Some((stiffness, _)) = asked.shape(k, "stiffness").filter(|_| asked.joints() > 1) else {
        return false;
    };
    let own = asked.chosen[k].candidate.joint;
    // A joint with a vertical axis carries the same weight across its axis as the next joint turns.
    let loads = (own..asked.joints()).map(|joint| {
        let predicted = &asked.search.source.predicted;
        let all = || predicted.iter().flat_map(|run| &run.load[joint]);
        let squares: f64 = all().map(|load| load * load).sum();
        (squares / all().count().max(1) as f64).sqrt()
    });
    loads.fold(0.0, f64::max) > MOST_SAG * stiffness
}

/// Returns true if a distance is not significantly larger than zero. One without a standard deviation is not
/// identifiable.
fn may_be_none(asked: &Asked, k: usize, name: &str) -> bool {
    (asked.shape(k, name))
        .is_some_and(|(value, std)| std.is_none_or(|std| value < SURE_OF_A_DISTANCE * std))
}

/// Returns true if not all moving joints of an arm have this delay.
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

/// Returns true if a coupling connects joints that are not neighbours.
fn not_neighbours(asked: &Asked, k: usize) -> bool {
    let candidate = asked.chosen[k].candidate;
    (candidate.other).is_some_and(|other| candidate.joint.abs_diff(other) > 1)
}
