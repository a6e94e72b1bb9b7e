//! Stepwise search: fit of each candidate, acceptance tests, joint refinement, removal and exchange.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rig_shared::effects::{Kind, SHAPES};

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::{depends_on_model, doubles, has_many_orders, is_gear, rivals};
use crate::columns::wave_orders::Orders;
use crate::columns::waves;
use crate::fit::least_squares::Fit;
use crate::levels::LEAST_GAIN;
use crate::rows::regression::Column;
use crate::search::chosen::with;
use crate::search::fitted_candidate::{FittedCandidate, equal};
use crate::search::shapes::{goes_straight, grid, grid_on};
use rig_data::runs::{blurred, resolution};
use rig_model::robot::Placed;

mod begin;
mod growth;
mod pairs;
pub(crate) mod shadow;
mod side;
mod simplest;
mod sweep;
mod tentative;

/// Encoder steps below which a distance equals zero: the direction of motion is not known more precisely.
const STEPS_OF_A_DISTANCE: f64 = 2.0;
/// p-value below which an effect stays in the model.
const STAYS: f64 = 1e-3;

/// The search over a candidate library.
pub(crate) struct Search<'a> {
    /// Data for the columns.
    pub(crate) source: Source<'a>,
    /// Candidates.
    pub(crate) library: Vec<Candidate>,
    /// Described effects, with which the search begins.
    pub(crate) described: Vec<Placed>,
    /// Gears from link encoders, with their shapes. The torque does not change them.
    pub(crate) measured: Vec<(Candidate, [f64; SHAPES])>,
    /// Gears from the torque, with fixed shapes while all other effects are searched.
    settled: Vec<(Candidate, [f64; SHAPES])>,
    /// Threads.
    pub(crate) threads: usize,
    /// Encoder resolution, joint by joint.
    pub(crate) resolution: Vec<f64>,
    /// Travel since reversal within the blur time of the filter, joint by joint, rad or m.
    blurred: Vec<f64>,
    /// Range of positions, joint by joint, rad or m.
    spans: Vec<f64>,
    /// Orders of motor torque waves beyond the grid, joint by joint.
    orders: Vec<Orders>,
    /// Constants whose side of the gear is certain.
    sided: Vec<Candidate>,
    /// Candidates that the last search dropped.
    dropped: Vec<Candidate>,
    /// A backlash that almost passed.
    pub(crate) nearly: Option<FittedCandidate>,
    /// Backlash that the observer supports: its open-loop gain may be smaller.
    pub(crate) accepted_by_observer: Vec<Candidate>,
    cache: Mutex<HashMap<usize, Vec<Arc<Vec<Column>>>>>,
}

/// Returns the source of columns for given effects.
pub(crate) type Renew<'r, 'a> =
    dyn Fn(&[FittedCandidate]) -> Result<Source<'a>, DiagnoseError> + 'r;

impl<'a> Search<'a> {
    /// Creates a search.
    pub(crate) fn new(
        source: Source<'a>,
        library: Vec<Candidate>,
        described: Vec<Placed>,
        threads: usize,
    ) -> Self {
        Self {
            resolution: (0..source.nominal.joints())
                .map(|joint| resolution(source.runs, joint))
                .collect(),
            blurred: (0..source.nominal.joints())
                .map(|joint| blurred(source.runs, joint, source.thinning.smear()))
                .collect(),
            spans: (0..source.nominal.joints())
                .map(|joint| waves::span(source.runs, joint))
                .collect(),
            orders: (0..source.nominal.joints())
                .map(|joint| orders_of(&source, &library, joint))
                .collect(),
            source,
            library,
            described,
            measured: Vec::new(),
            settled: Vec::new(),
            sided: Vec::new(),
            dropped: Vec::new(),
            nearly: None,
            accepted_by_observer: Vec::new(),
            threads,
            cache: Mutex::new(HashMap::new()),
        }
    }

    /// Returns the smallest distance that a law of this kind can resolve on a joint, rad or m: some encoder steps. For
    /// friction at least the travel since reversal before the filter shows the reversal.
    pub(crate) fn least_told(&self, kind: Kind, joint: usize) -> f64 {
        let steps = STEPS_OF_A_DISTANCE * self.resolution[joint];
        if is_gear(kind) {
            steps
        } else {
            steps.max(self.blurred[joint])
        }
    }

    /// Sets a source with new predictions, and clears cached columns that depend on them.
    fn renewed(&mut self, source: Source<'a>) {
        // Presliding changes the friction through its contact.
        let slid = !(self.source.bent.is_empty() && source.bent.is_empty());
        self.source = source;
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        cache.retain(|c, _| {
            let kind = self.library[*c].kind;
            !(depends_on_model(kind)
                || slid && (kind.acts_through_contact() || kind.is_presliding()))
        });
    }

    /// Returns true if the motion spans a candidate with these shapes; other effects than waves always pass.
    pub(crate) fn shows(&self, candidate: &Candidate, shapes: &[f64; SHAPES]) -> bool {
        let joint = &self.source.robot.joints[candidate.joint];
        waves::shown(candidate.kind, joint, shapes, self.spans[candidate.joint])
    }

    /// Returns the index of a candidate in the library.
    pub(crate) fn place(&self, candidate: &Candidate) -> Option<usize> {
        self.library.iter().position(|l| *l == candidate.sort())
    }

    /// Returns the grid of a candidate's shapes.
    pub(crate) fn grid(&self, candidate: &Candidate) -> Vec<[f64; SHAPES]> {
        let joints = &self.source.robot.joints;
        // On a single joint such waves replace the misfit of other laws: of load friction, on the emulated rig.
        let mut points = if joints.len() == 1 {
            grid(candidate.kind)
        } else {
            grid_on(candidate.kind, &joints[candidate.joint])
        };
        if has_many_orders(candidate.kind) {
            points.extend(self.orders[candidate.joint].loud.iter().map(|order| {
                let mut point = [0.0; SHAPES];
                point[0] = *order;
                point
            }));
        }
        let running = self.source.running();
        points.retain(|point| !goes_straight(candidate.kind, point, running));
        points
    }

    /// Returns the columns at a candidate's grid points.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn cached(
        &self,
        c: usize,
        points: &[[f64; SHAPES]],
    ) -> Result<Vec<Arc<Vec<Column>>>, DiagnoseError> {
        let cache = || self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(held) = cache().get(&c) {
            return Ok(held.clone());
        }
        let columns: Vec<Arc<Vec<Column>>> =
            (self.source.columns_of(1, &self.library[c], points)?)
                .into_iter()
                .map(Arc::new)
                .collect();
        cache().insert(c, columns.clone());
        Ok(columns)
    }

    /// Recomputes predicted load, inertia and contact deflection with the current effects, then refits the effects.
    /// Effects at a bound are removed.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    fn refresh_predictions(
        &mut self,
        base: &Fit,
        chosen: &mut Vec<FittedCandidate>,
        renew: &Renew<'_, 'a>,
    ) -> Result<(), DiagnoseError> {
        let before = chosen.len();
        for _ in 0..2 {
            self.renewed(renew(chosen)?);
            self.refine_all(base, chosen)?;
        }
        chosen.retain(|profile| profile.at_bound.is_none());
        if chosen.len() < before {
            self.renewed(renew(chosen)?);
            self.refine_all(base, chosen)?;
        }
        Ok(())
    }

    /// Returns replacements of the `i`-th effect beside all others, best first. Gears only if it is a gear or
    /// confusable with one.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn alternatives(
        &self,
        base: &Fit,
        chosen: &[FittedCandidate],
        i: usize,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let fit = with(base, chosen, Some(i));
        let mut others: Vec<Candidate> = (chosen.iter().enumerate())
            .filter(|(k, _)| *k != i)
            .map(|(_, p)| p.candidate)
            .collect();
        let own = chosen[i].candidate.kind;
        others.push(chosen[i].candidate);
        if !is_gear(own) {
            let like = |name: &str| own.about().confused.iter().any(|c| c.with == name);
            let unlike = |c: &&Candidate| is_gear(c.kind) && !like(c.kind.about().name);
            others.extend(self.library.iter().filter(unlike));
        }
        self.sweep_at(chosen[i].candidate.joint, &fit, &others, &[])
    }

    /// Returns candidates that the last search dropped but that have a large gain beside all effects, `chosen`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn still_taking(
        &self,
        base: &Fit,
        chosen: &[FittedCandidate],
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        let fit = with(base, chosen, None);
        let trials = self.trials();
        let mut taking = Vec::new();
        for candidate in &self.dropped {
            let place = self.place(candidate);
            let profile = place.map(|c| self.profile(&fit, c, None)).transpose()?;
            taking.extend(profile.flatten().filter(|p| p.takes_much(trials)));
        }
        Ok(taking)
    }

    /// Returns the other laws that exclude a candidate, with library index: the same name or another transmission.
    fn laws_beside(&self, present: Candidate) -> impl Iterator<Item = (usize, &Candidate)> {
        let another = move |c: &Candidate| rivals(c, &present) && c.kind != present.kind;
        (self.library.iter().enumerate()).filter(move |(_, c)| another(c))
    }

    /// Replaces effects by better laws of the same name. A law with more parameters, or in place of a described one,
    /// must be clearly better. Returns true if it replaced one.
    fn other_laws(
        &self,
        base: &Fit,
        chosen: &mut [FittedCandidate],
    ) -> Result<bool, DiagnoseError> {
        let mut changed = false;
        for i in 0..chosen.len() {
            let fit = with(base, chosen, Some(i));
            let present = chosen[i].candidate;
            for (c, law) in self.laws_beside(present) {
                let bends_more = self.size(law) != self.size(&present) || is_gear(law.kind);
                let least = match bends_more || self.is_described(&present) {
                    true => LEAST_GAIN,
                    false => 0.0,
                };
                if let Some(rival) = self.profile(&fit, c, None)?
                    && rival.at_bound.is_none()
                    && rival.evidence.beyond(&chosen[i].evidence) > least
                {
                    chosen[i] = rival;
                    changed = true;
                }
            }
        }
        Ok(changed)
    }

    /// Refines all shapes, removes effects that are not significant, and swaps effects for better ones. Returns those
    /// at a bound.
    fn refine_prune_swap(
        &self,
        base: &Fit,
        chosen: &mut Vec<FittedCandidate>,
        trials: usize,
        impossible: &[Candidate],
    ) -> Result<Vec<Candidate>, DiagnoseError> {
        for _ in 0..2 {
            self.refine_all(base, chosen)?;
        }
        // Substitutes go once the true effect is in the model.
        let at_bound = self.prune(base, chosen)?;
        // Look for a better effect in the place of each earlier one.
        if chosen.len() > 1 {
            for i in 0..chosen.len() - 1 {
                if self.fixed(&chosen[i].candidate).is_some() {
                    continue;
                }
                let fit = with(base, chosen, Some(i));
                let others: Vec<Candidate> = (chosen.iter().enumerate())
                    .filter(|(k, _)| *k != i)
                    .map(|(_, p)| p.candidate)
                    .collect();
                let rival = self
                    .sweep_at(chosen[i].candidate.joint, &fit, &others, impossible)?
                    .into_iter()
                    .find(|p| p.refused(trials).is_none());
                if let Some(rival) = rival
                    && rival.candidate != chosen[i].candidate
                    && rival.evidence.gain > chosen[i].evidence.gain
                    // A described effect gives way to a better one, not to an equal one.
                    && !(self.is_described(&chosen[i].candidate) && equal(&chosen[i], &rival))
                {
                    chosen[i] = rival;
                    self.refine_all(base, chosen)?;
                }
            }
        }
        Ok(at_bound)
    }

    /// Refines effects after others were removed, and drops those at a bound.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn possible(
        &self,
        base: &Fit,
        mut chosen: Vec<FittedCandidate>,
    ) -> Result<Vec<FittedCandidate>, DiagnoseError> {
        self.refine_all(base, &mut chosen)?;
        chosen.retain(|profile| profile.at_bound.is_none());
        Ok(chosen)
    }

    /// Refines the shapes of each effect, and updates its evidence, beside all others.
    fn refine_all(&self, base: &Fit, chosen: &mut [FittedCandidate]) -> Result<(), DiagnoseError> {
        for i in 0..chosen.len() {
            let fit = with(base, chosen, Some(i));
            let c = self.place(&chosen[i].candidate);
            let Some(c) = c else { continue };
            let mut better = self.profile(&fit, c, Some(chosen[i].shapes))?;
            if better.is_none() && chosen[i].candidate.kind.is_presliding() {
                // Beside other friction, a bristle of these shapes may be negative.
                better = self.profile(&fit, c, None)?;
            }
            if let Some(mut better) = better {
                better.near_collinear =
                    (chosen.iter()).any(|p| doubles(&p.candidate, &better.candidate));
                chosen[i] = better;
            } else {
                // Its columns are collinear, or have impossible signs.
                chosen[i].evidence.gain = 0.0;
                chosen[i].evidence.joint_gain = 0.0;
                chosen[i].evidence.p_value = 1.0;
                chosen[i].at_bound = Some("gain");
            }
        }
        Ok(())
    }
}

/// Returns the orders of a joint beyond the grids of its motor waves.
fn orders_of(source: &Source, library: &[Candidate], joint: usize) -> Orders {
    let own = |c: &&Candidate| c.joint == joint && has_many_orders(c.kind);
    let highest = (library.iter().filter(own))
        .filter_map(|c| c.kind.about().shapes.first())
        .map(|order| order.range[1])
        .fold(0.0, f64::max);
    let of = &source.robot.joints[joint];
    if highest == 0.0 || !waves::motor_is_known(of) {
        return Orders::default();
    }
    Orders::of(source.runs, joint, of.gear_ratio(), highest as usize)
}

#[cfg(test)]
mod tests;
