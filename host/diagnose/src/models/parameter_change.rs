//! Changes of the nominal parameters against the description: a payload, a torque constant, a single value.

use std::collections::BTreeMap;

use rig_shared::effects::Kind;

use crate::fit::evidence::Evidence;
use crate::fit::least_squares::Fit;
use crate::fit::open_parameters::described_sizes;
use crate::fit::refit::Refit;
use crate::fit::solution::Solution;
use crate::fit::systematic_uncertainty::LINK;
use crate::levels::{LEAST_GAIN, SIGNIFICANT};
use crate::models::payload::{LEAST_SIGMAS, Load, on_last_link, on_single_link};
use crate::outcome::Value;
use crate::recordings::context::DiagnosisContext;
use crate::rows::regression::{Column, Rows, combined};
use crate::search::fitted_candidate::FittedCandidate;
use rig_numerics::statistics::rms;
use rig_numerics::vector::dot;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Share of the whole change's gain that some parameters must reach to explain it.
const SPEAKS_FOR_ALL: f64 = 0.9;

/// The same for inertia and gravity of a payload beside friction effects, whose mismatch moves friction values.
const SPEAKS_BESIDE_FRICTION: f64 = 0.5;
/// Difference of the growth of inertia and gravity below which both have one factor.
const ONE_RATIO: f64 = 0.05;

/// Least relative change of at least one nominal parameter. The mismatch of effects moves all of them by a per cent in
/// a refit.
const LEAST_CHANGE: f64 = 0.04;
/// Least relative change of both inertia and gravity for a payload …
const LEAST_OF_BOTH: f64 = 0.02;
/// … and with an unexplained residual, which moves parameters at random.
const LEAST_OF_BOTH_BESIDE: f64 = 0.04;

/// RMS ratio of the described to the refitted parameters, at one joint, above which the description's values are wrong
/// whatever their relative change. 2: identified descriptions of four simulated arms left 1.00 to 1.14 of a recording of
/// the same arm, and 8 to 3000 with a payload (29 November 2026).
const GAP: f64 = 2.0;

/// Largest departure of parameters from one common factor. The mismatch of effects moves them as much.
const ONE_FACTOR: f64 = 0.15;

/// A changed value of a nominal parameter, SI.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ChangedValue {
    /// Name of the parameter.
    pub(crate) name: String,
    /// Described value.
    pub(crate) described: f64,
    /// Fitted value.
    pub(crate) value: f64,
    /// Its standard deviation.
    pub(crate) std: f64,
}

/// What has changed.
#[derive(Clone, Debug)]
pub(crate) enum ChangeCause {
    /// A payload on a single link.
    Payload,
    /// A payload on the last of several links.
    PayloadOnLast(Load),
    /// All parameters by one factor.
    OneFactor {
        /// The change, per cent.
        percent: f64,
    },
    /// One parameter.
    Single(ChangedValue),
    /// Several parameters.
    Several(Vec<ChangedValue>),
    /// The described values together, none of which differs significantly on its own.
    Together,
}

/// A change of nominal parameters.
#[derive(Clone, Debug)]
pub(crate) struct Change {
    /// What has changed.
    pub(crate) cause: ChangeCause,
    /// Name of the effect, if it is one.
    pub(crate) effect: Option<Kind>,
    /// Its parameters.
    pub(crate) parameters: BTreeMap<String, Value>,
    /// p-value of freeing the parameters that explain it, corrected for the sets tried.
    pub(crate) p_value: f64,
}

/// Data for the comparison of a refit with the description.
pub(crate) struct RefitData<'c> {
    /// Robot and treatment.
    pub(crate) context: &'c DiagnosisContext<'c>,
    /// The rows of the refit.
    pub(crate) rows: &'c Rows,
    /// Coefficients of the free nominal directions, beside the effects.
    pub(crate) after: &'c Solution,
    /// True if friction is among the effects.
    pub(crate) beside_friction: bool,
    /// True if a residual remains.
    pub(crate) left: bool,
}

/// Compares the refit with the description. `known` is the torque of the effects found. Kinds in `without` are not
/// named.
pub(crate) fn change(
    refit: &Refit,
    refitted: &RefitData,
    known: &Column,
    without: &[Kind],
) -> Option<Change> {
    if !refitted.context.anchor.stated {
        return None;
    }
    let described = DescribedFit::of(refit, refitted, known);
    if !described.is_beyond_description(refitted, &refit.free) {
        return None;
    }
    let gap = described.has_gap(&refit.free);
    let Some(whole) = evidence_in(&described.frozen, &refit.free, &described.all) else {
        // Folds of this recording do not determine the parameters, so there is no test; the gap stands.
        return gap.then(|| Change {
            cause: ChangeCause::Together,
            effect: None,
            parameters: BTreeMap::new(),
            p_value: f64::NAN,
        });
    };
    let comparison = Comparison::of(refit, refitted, described, whole)?;
    if comparison.moved_most() < LEAST_CHANGE && !gap {
        return None;
    }
    let payload = match without.contains(&Kind::Payload) {
        true => None,
        false => comparison.payload(),
    };
    payload
        .or_else(|| comparison.one_factor(known.len()))
        .or_else(|| comparison.single())
        .or_else(|| comparison.several())
        .or_else(|| gap.then(|| comparison.nameless(ChangeCause::Together, &comparison.whole)))
}

/// The description beside the effects found.
struct DescribedFit<'r> {
    /// Described directions. An undescribed parameter cannot change.
    all: Vec<usize>,
    /// Residual of the description, the effects, and the undescribed parameters.
    frozen: Fit<'r>,
    /// The same with undescribed parameters as columns.
    beside_constants: Fit<'r>,
}

impl<'r> DescribedFit<'r> {
    fn of(refit: &Refit<'r>, refitted: &RefitData, known: &Column) -> Self {
        let (anchor, free) = (&refitted.context.anchor, &refit.free);
        let mut frozen = refit.frozen(refitted.context);
        frozen.subtract(known);
        let (unstated, all): (Vec<usize>, Vec<usize>) =
            (0..free.len()).partition(|k| anchor.is_unstated(*k));
        let beside_constants = frozen.clone().taking(unstated.iter().map(|k| &free[*k]));
        let constants = (unstated.iter()).map(|k| (&free[*k], refitted.after.values[*k]));
        frozen.subtract(&combined(known.len(), constants));
        Self {
            all,
            frozen,
            beside_constants,
        }
    }

    /// Returns the RMS residual of each joint with the described parameters and with refitted ones.
    fn residuals(&self, free: &[Column]) -> Vec<[f64; 2]> {
        let refitted = (self.frozen.clone()).taking(self.all.iter().map(|k| &free[*k]));
        (0..self.frozen.rows().joints())
            .map(|j| [self.frozen.rms(j), refitted.rms(j)])
            .collect()
    }

    /// Returns true if the described parameters leave much more than refitted ones at some joint.
    fn has_gap(&self, free: &[Column]) -> bool {
        (self.residuals(free).iter()).any(|[described, refitted]| *described > GAP * refitted)
    }

    /// Returns true if the difference between both residuals is more than the error that a right description has, at some
    /// joint: [`LINK`] of the described torque of an arm, and what the described values' own uncertainty explains.
    fn is_beyond_description(&self, refitted: &RefitData, free: &[Column]) -> bool {
        let (rows, anchor) = (refitted.rows, &refitted.context.anchor);
        let uncertain = anchor.uncertain_torques(rows);
        if rows.joints() < 2 && uncertain.is_empty() {
            return true;
        }
        let link = if rows.joints() < 2 { 0.0 } else { LINK };
        let torque = combined(
            rows.joints(),
            rows.nominal.iter().zip(anchor.prior.iter().copied()),
        );
        let level = SIGNIFICANT / rows.joints() as f64;
        let residuals = self.residuals(free);
        (residuals.iter().enumerate()).any(|(j, [before, after])| {
            let own = torque[j].as_ref().map_or(0.0, |torque| rms(torque));
            let beyond = before.powi(2) - after.powi(2) - (link * own).powi(2);
            beyond > 0.0 && probability_of(beyond, &uncertain, j) < level
        })
    }
}

/// Returns the probability that the uncertainty of the values of a right description makes a mean square torque of more
/// than `square` at joint `j`; `torques` are those of one standard deviation along independent directions. The mean square is
/// a quadratic form of normal variables, G, and has the distribution of a multiple of χ² with the same mean tr G and variance
/// 2·tr G² (Satterthwaite 1946).
fn probability_of(square: f64, torques: &[Column], j: usize) -> f64 {
    let own: Vec<&Vec<f64>> = torques.iter().filter_map(|c| c[j].as_ref()).collect();
    let rows = own.first().map_or(1, |c| c.len().max(1)) as f64;
    let (mut trace, mut squares) = (0.0, 0.0);
    for (a, x) in own.iter().enumerate() {
        trace += dot(x, x) / rows;
        for (b, y) in own[..=a].iter().enumerate() {
            let twice = if a == b { 1.0 } else { 2.0 };
            squares += twice * (dot(x, y) / rows).powi(2);
        }
    }
    ChiSquared::new(trace * trace / squares).map_or(0.0, |d| d.sf(square * trace / squares))
}

/// The description beside a refit, with a significant difference.
struct Comparison<'c, 'r> {
    refitted: &'c RefitData<'c>,
    /// Columns of the free nominal directions.
    free: &'c [Column],
    /// Their described coefficients.
    prior: Vec<f64>,
    /// Described directions. An undescribed parameter cannot change.
    all: Vec<usize>,
    /// Residual of the description, the effects, and the undescribed parameters.
    frozen: Fit<'r>,
    /// The same with undescribed parameters as columns.
    beside_constants: Fit<'r>,
    /// Evidence for the change of all described directions.
    whole: Evidence,
}

impl<'c, 'r> Comparison<'c, 'r> {
    /// Returns the comparison; None if the `whole` change is not significant.
    fn of(
        refit: &'c Refit<'r>,
        refitted: &'c RefitData,
        described: DescribedFit<'r>,
        whole: Evidence,
    ) -> Option<Self> {
        let comparison = Self {
            refitted,
            free: &refit.free,
            prior: refitted.context.anchor.prior_coefficients(),
            whole,
            all: described.all,
            frozen: described.frozen,
            beside_constants: described.beside_constants,
        };
        let whole = &comparison.whole;
        let by_chance = whole.gain < LEAST_GAIN || comparison.corrected(whole) > SIGNIFICANT;
        (!by_chance).then_some(comparison)
    }

    /// Returns the p-value, corrected for the sets: all, a payload, all in one ratio, each alone. Every set counts, not
    /// only those tried before a success.
    fn corrected(&self, e: &Evidence) -> f64 {
        e.corrected(3 + self.all.len())
    }

    /// Returns the largest relative change.
    fn moved_most(&self) -> f64 {
        let (after, prior) = (self.refitted.after, &self.prior);
        // A value described as 0, or as a rounding of it, is no reference for a relative change.
        let sizes = described_sizes(self.refitted.context);
        (self.all.iter())
            .map(|&k| (after.values[k] - prior[k]).abs() / prior[k].abs().max(sizes[k]))
            .fold(0.0, f64::max)
    }

    fn evidence(&self, picked: &[usize]) -> Option<Evidence> {
        evidence_in(&self.frozen, self.free, picked)
    }

    /// Returns true if some parameters explain nearly all of the change.
    fn speaks(&self, e: &Evidence) -> bool {
        e.gain >= SPEAKS_FOR_ALL * self.whole.gain
    }

    /// Returns true if inertia and moment explain enough beside friction. A common factor is a torque constant.
    fn carries(&self, e: &Evidence, [inertia, moment]: &[usize; 2]) -> bool {
        let growth = |k: usize| self.refitted.after.values[k] / self.prior[k];
        let [inertia, moment] = [inertia, moment].map(|k| growth(*k));
        e.gain >= SPEAKS_BESIDE_FRICTION * self.whole.gain
            && (inertia / moment - 1.0).abs() > ONE_RATIO
    }

    /// Returns a payload as the change.
    fn payload(&self) -> Option<Change> {
        let RefitData {
            context,
            rows,
            after,
            beside_friction,
            left,
        } = *self.refitted;
        let told = |cause, parameters, e: &Evidence| Change {
            cause,
            effect: Some(Kind::Payload),
            parameters,
            p_value: self.corrected(e),
        };
        let least = if left {
            LEAST_OF_BOTH_BESIDE
        } else {
            LEAST_OF_BOTH
        };
        if let Some((parameters, directions)) = on_single_link(context, after, &self.prior, least)
            && let Some(e) = self.evidence(&directions)
            && (self.speaks(&e) || beside_friction && self.carries(&e, &directions))
        {
            return Some(told(ChangeCause::Payload, parameters, &e));
        }
        // Undescribed constants are fitted with it: gravity's part of them is not known before.
        let share = match beside_friction {
            true => SPEAKS_BESIDE_FRICTION,
            false => SPEAKS_FOR_ALL,
        };
        if let Some((load, e)) = on_last_link(context, rows, &self.beside_constants)
            && load.mass.value > LEAST_SIGMAS * load.mass.std
            && let Some(whole) = evidence_in(&self.beside_constants, self.free, &self.all)
            && e.gain >= share * whole.gain
        {
            let parameters = load.parameters();
            return Some(told(ChangeCause::PayloadOnLast(load), parameters, &e));
        }
        None
    }

    /// Returns one factor on all parameters of a robot with `joints` joints as the change.
    fn one_factor(&self, joints: usize) -> Option<Change> {
        let (after, prior, frozen) = (self.refitted.after, &self.prior, &self.frozen);
        let scale = combined(joints, self.free.iter().zip(prior.iter().copied()));
        let open = [[f64::NEG_INFINITY, f64::INFINITY]];
        // If gravity and inertia dominate the torque, they also decide on friction, whatever that does.
        let of_one_factor = |factor: f64| {
            self.all.iter().all(|&k| {
                let apart = (after.values[k] - factor * prior[k]).abs();
                apart <= LEAST_SIGMAS * after.std(k) + ONE_FACTOR * (factor * prior[k]).abs()
            })
        };
        let e = frozen.evidence(&[frozen.projected(frozen.weighted(&scale))], &open)?;
        if !self.speaks(&e) || !of_one_factor(1.0 + e.gains[0]) {
            return None;
        }
        let percent = 100.0 * e.gains[0];
        Some(self.nameless(ChangeCause::OneFactor { percent }, &e))
    }

    /// Returns a single parameter that explains the change.
    fn single(&self) -> Option<Change> {
        self.all.iter().find_map(|&k| {
            let e = self.evidence(&[k]).filter(|e| self.speaks(e))?;
            Some(self.nameless(ChangeCause::Single(self.value(k)), &e))
        })
    }

    /// Returns all parameters with a significant change.
    fn several(&self) -> Option<Change> {
        let (after, prior) = (self.refitted.after, &self.prior);
        let moved: Vec<ChangedValue> = (self.all.iter().copied())
            .filter(|&k| {
                let described = self.refitted.context.anchor.described_std(k);
                (after.values[k] - prior[k]).abs() > 4.0 * after.std(k).hypot(described)
            })
            .map(|k| self.value(k))
            .collect();
        (!moved.is_empty()).then(|| self.nameless(ChangeCause::Several(moved), &self.whole))
    }

    /// Returns a change that is no effect.
    fn nameless(&self, cause: ChangeCause, e: &Evidence) -> Change {
        Change {
            cause,
            effect: None,
            parameters: BTreeMap::new(),
            p_value: self.corrected(e),
        }
    }

    /// Returns the values of a free direction.
    fn value(&self, k: usize) -> ChangedValue {
        let after = self.refitted.after;
        ChangedValue {
            name: self.name(k),
            described: self.prior[k],
            value: after.values[k],
            std: after.std(k),
        }
    }

    /// Returns the name of a free direction.
    fn name(&self, k: usize) -> String {
        let context = self.refitted.context;
        match context.anchor.free[k].as_slice() {
            [(b, _)] => context.expression(*b),
            _ => "the first moment (gravity)".into(),
        }
    }
}

/// Returns the evidence for the `picked` columns beside a fit.
fn evidence_in(fit: &Fit, free: &[Column], picked: &[usize]) -> Option<Evidence> {
    let own = |k: &usize| fit.projected(fit.weighted(&free[*k]));
    let columns: Vec<Vec<f64>> = picked.iter().map(own).collect();
    let open = vec![[f64::NEG_INFINITY, f64::INFINITY]; picked.len()];
    fit.evidence(&columns, &open)
}

/// Returns true if inertia and gravity beside these effects have grown like a payload on a single link.
pub(crate) fn is_loaded(
    context: &DiagnosisContext,
    refit: &Refit,
    chosen: &[FittedCandidate],
) -> bool {
    let prior = context.anchor.prior_coefficients();
    let grown = |after| on_single_link(context, &after, &prior, LEAST_OF_BOTH_BESIDE).is_some();
    refit.solution(chosen).is_ok_and(grown)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Mean squares that drawn errors of a right description make, beside the probability that is told for them.
    #[test]
    fn errors_of_a_right_description_exceed_a_square_as_often_as_told() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        // Directions of very different size, as a motion shows some combinations far better than others.
        let torques: Vec<Column> = [2.0, 1.0, 0.5, 0.1, 0.1]
            .map(|size| vec![Some((0..40).map(|_| size * normal()).collect())])
            .to_vec();
        let mut squares: Vec<f64> = (0..4000)
            .map(|_| {
                let drawn: Vec<f64> = torques.iter().map(|_| normal()).collect();
                let torque = combined(1, torques.iter().zip(drawn));
                torque[0].as_ref().map_or(0.0, |t| dot(t, t) / 40.0)
            })
            .collect();
        squares.sort_by(f64::total_cmp);
        for share in [0.5, 0.9, 0.99] {
            let told = probability_of(squares[(share * 4000.0) as usize], &torques, 0);
            assert!(
                (0.5..2.0).contains(&(told / (1.0 - share))),
                "{share}: {told}"
            );
        }
    }

    #[test]
    fn without_an_uncertainty_every_difference_is_beyond_it() {
        assert_eq!(probability_of(1e-9, &[], 0), 0.0);
    }
}
