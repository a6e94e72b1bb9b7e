//! Alternative names of a step.

use std::collections::BTreeMap;

use rig_shared::effects::Kind;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::experiment::testable::confounded;
use crate::outcome::Step;
use crate::search::fitted_candidate::{FittedCandidate, equal};
use rig_data::runs::Run;

/// Standard deviations by which a stiffness may exceed its estimate.
const SURELY: f64 = 2.0;
/// Largest distance of a spring's rest position from the middle of the motion, in spans of the motion.
const SPANS_TO_REST: f64 = 2.0;

/// Fills the set and the runner-up of a step. `rivals` would replace it, best first. A rival on another joint is no
/// runner-up. Kinds that it `is_not` are excluded.
pub(crate) fn rank(
    step: &mut Step,
    own: &FittedCandidate,
    rivals: &[FittedCandidate],
    runs: &[Run],
    is_not: &dyn Fn(Kind) -> bool,
) {
    let mut names = vec![step.effect.clone()];
    let mut exact = |kind: Kind| {
        for confusion in confounded(kind, own.candidate.joint, runs) {
            if Kind::from_name(confusion.with, None).is_some_and(is_not) {
                continue;
            }
            if !names.iter().any(|n| n == confusion.with) {
                names.push(confusion.with.to_owned());
            }
        }
    };
    exact(own.candidate.kind);
    let possible =
        |rival: &&FittedCandidate| may_stand(rival, runs) && !is_not(rival.candidate.kind);
    for rival in rivals.iter().filter(possible) {
        let name = rival.candidate.kind.about().name;
        if names.iter().any(|n| n == name) {
            continue;
        }
        if equal(own, rival) {
            names.push(name.to_owned());
        } else if step.runner_up.is_none() && rival.candidate.joint == own.candidate.joint {
            step.runner_up = Some(name.to_owned());
            step.runner_up_gap_closed =
                Some(step.gap_closed * (rival.evidence.gain / own.evidence.gain).clamp(0.0, 1.0));
        }
    }
    step.set = names;
    let others = rivals.iter().filter(possible).filter(|rival| {
        let kind = rival.candidate.kind;
        rival.candidate.joint == own.candidate.joint && kind.about().name != step.effect
    });
    step.name_probability = posterior(own, others);
}

/// Returns the posterior probability of a name among its rivals, with equal priors. The odds of each rival come from
/// mean and spread of the paired differences on blocks outside both fits (pseudo-BMA with the uncertainty of a sum over
/// blocks, Yao et al. 2018, Bayesian Analysis 13(3)).
fn posterior<'p>(own: &FittedCandidate, rivals: impl Iterator<Item = &'p FittedCandidate>) -> f64 {
    let normal = Normal::standard();
    let mut best: BTreeMap<&str, f64> = BTreeMap::new();
    for rival in rivals {
        let ahead = own.evidence.ahead_of(&rival.evidence);
        let odds = normal.sf(ahead) / normal.cdf(ahead).max(f64::MIN_POSITIVE);
        let most = best.entry(rival.candidate.kind.about().name).or_default();
        *most = most.max(odds);
    }
    1.0 / (1.0 + best.values().sum::<f64>())
}

/// Returns true if a rival is not at a bound. A spring may also be too soft to tell, if a slightly stiffer one would
/// rest not far from the motion.
pub(crate) fn may_stand(rival: &FittedCandidate, runs: &[Run]) -> bool {
    let (gains, stds) = (&rival.evidence.gains, &rival.evidence.stds);
    let (&[stiffness, preload], &[std, _]) = (&gains[..], &stds[..]) else {
        return rival.at_bound.is_none();
    };
    if rival.at_bound.is_none() || rival.candidate.kind != Kind::Spring {
        return rival.at_bound.is_none();
    }
    let places = (runs.iter()).flat_map(|run| &run.joints[rival.candidate.joint].q);
    let [low, high] = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
        [low.min(*q), high.max(*q)]
    });
    let pull = stiffness * 0.5 * (low + high) + preload;
    pull.abs() <= (stiffness + SURELY * std) * SPANS_TO_REST * (high - low)
}
