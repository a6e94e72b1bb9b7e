//! Which effect, one after the other: each candidate at its best, gates; then joint refinement, removal and exchange.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rig_shared::effects::{Kind, SHAPES};

use super::DiagnoseError;
use super::columns::{Candidate, Source};
use super::fit::Fit;
use super::judge::equal;
use super::orders::Orders;
use super::profile::{LEAST_GAIN, Profile, goes_straight, grid, grid_on};
use super::rows::Column;
use super::waves;
use rig_data::runs::{blurred, resolution};
use rig_model::robot::Placed;

mod begin;
mod kinds;
mod pairs;
mod shadow;
mod side;
mod simplest;
mod sweep;
mod tentative;

use kinds::{depends_on_model, doubles, has_many_orders};
pub(super) use kinds::{is_constant, is_first_law, is_friction, is_gear, rivals};
use shadow::in_the_shadow;
pub(super) use shadow::shadow;

/// Steps of the recorded position below which a distance is not told from none: the direction of motion is not known to less.
const STEPS_OF_A_DISTANCE: f64 = 2.0;
/// An effect in the model stays while its own probability is below this.
const STAYS: f64 = 1e-3;
/// How often laws are weighed against others of their names, each time beside those that have changed.
const LAWS_ANEW: usize = 2;
/// Most effects beside those of the description, the orders of one wave counting once.
const MOST_EFFECTS: usize = 6;

/// The search over a library.
pub(super) struct Search<'a> {
    /// What columns are formed from.
    pub(super) source: Source<'a>,
    /// Candidates.
    pub(super) library: Vec<Candidate>,
    /// What the description states of them: the search begins with it.
    pub(super) described: Vec<Placed>,
    /// Gears that encoders on the links have shown, with their shapes: the torque has no say in them.
    pub(super) measured: Vec<(Candidate, [f64; SHAPES])>,
    /// Gears that the torque has shown, once all else is searched beside them.
    settled: Vec<(Candidate, [f64; SHAPES])>,
    /// Threads.
    pub(super) threads: usize,
    /// Joint by joint.
    pub(super) resolution: Vec<f64>,
    /// How far each joint goes from a reversal within the time that its filter blurs, rad or m.
    blurred: Vec<f64>,
    /// Lowest to highest position, joint by joint, rad or m.
    spans: Vec<f64>,
    /// Orders of waves of the motors' torque beyond the grids', joint by joint.
    orders: Vec<Orders>,
    /// Constants of which a gear has told on which side of it they act.
    sided: Vec<Candidate>,
    /// What the last search had to drop.
    dropped: Vec<Candidate>,
    /// A play that it all but took.
    pub(super) nearly: Option<Profile>,
    /// Plays whose links followed the recorded torque by far better: less is asked of them as the motor's motion drives them.
    pub(super) heard: Vec<Candidate>,
    cache: Mutex<HashMap<usize, Vec<Arc<Vec<Column>>>>>,
}

impl<'a> Search<'a> {
    /// A search.
    pub(super) fn new(
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
            heard: Vec::new(),
            threads,
            cache: Mutex::new(HashMap::new()),
        }
    }

    /// The least distance that joint `joint`'s motion tells from none to a law of that kind, rad or m: some steps of its encoder;
    /// to friction also how far the joint goes from a reversal before the filter lets it be seen that it has reversed.
    pub(super) fn least_told(&self, kind: Kind, joint: usize) -> f64 {
        let steps = STEPS_OF_A_DISTANCE * self.resolution[joint];
        if is_gear(kind) {
            steps
        } else {
            steps.max(self.blurred[joint])
        }
    }

    /// Takes a source with another model's predictions; columns that depend on them are forgotten.
    fn renewed(&mut self, source: Source<'a>) {
        // Where presliding has come in, or has gone, what acts through its contact goes with it.
        let slid = !(self.source.bent.is_empty() && source.bent.is_empty());
        self.source = source;
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        cache.retain(|c, _| {
            let kind = self.library[*c].kind;
            !(depends_on_model(kind)
                || slid && (kind.acts_through_contact() || kind.is_presliding()))
        });
    }

    /// Whether the motion spans a candidate with these shapes where it is a wave.
    pub(super) fn shows(&self, candidate: &Candidate, shapes: &[f64; SHAPES]) -> bool {
        let joint = &self.source.robot.joints[candidate.joint];
        waves::shown(candidate.kind, joint, shapes, self.spans[candidate.joint])
    }

    /// Place of a candidate in the library.
    pub(super) fn place(&self, candidate: &Candidate) -> Option<usize> {
        self.library.iter().position(|l| *l == candidate.sort())
    }

    /// Shapes that the search of a candidate begins with.
    pub(super) fn grid(&self, candidate: &Candidate) -> Vec<[f64; SHAPES]> {
        let joints = &self.source.robot.joints;
        // Of one joint such waves stand in for what the laws of others leave: of load friction, on the emulated rig.
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

    /// Columns of the points of a candidate's grid.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn cached(
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

    /// Finds effects one by one, after those of the description, which stand first, or after those `found` with rows that counted
    /// otherwise. `base` holds the nominal columns; `told` hears of every sweep and of the number of effects found by then; `renew` gives what columns are formed from once they
    /// are in.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn run(
        &mut self,
        base: &Fit,
        found: Option<Vec<Profile>>,
        renew: &dyn Fn(&[Profile]) -> Result<Source<'a>, DiagnoseError>,
        told: &mut dyn FnMut(usize, &[Profile]),
    ) -> Result<Vec<Profile>, DiagnoseError> {
        let mut chosen = match found {
            None => self.begun(base, renew)?,
            Some(mut found) => {
                self.renewed(renew(&found)?);
                self.refine_all(base, &mut found)?;
                self.standing(base, &mut found)?;
                found
            }
        };
        let trials = self.trials();
        let most = sorts(&chosen) + MOST_EFFECTS;
        let mut impossible: Vec<Candidate> = Vec::new();
        let mut stood: Vec<Vec<Profile>> = Vec::new();
        while sorts(&chosen) < most {
            let fit = with(base, &chosen, None);
            let present: Vec<Candidate> = chosen.iter().map(|p| p.candidate).collect();
            let profiles = self.sweep(&fit, &present, &impossible)?;
            let found = |p: &&Profile| !self.is_described(&p.candidate);
            told(chosen.iter().filter(found).count(), &profiles);
            let Some(best) = self.first_to_take(&fit, &profiles, trials) else {
                let together =
                    self.tried_together(base, &chosen, &profiles, trials, &impossible)?;
                if let Some(together) =
                    together.filter(|list| !stood.iter().any(|before| same(before, list)))
                {
                    stood.push(std::mem::replace(&mut chosen, together));
                    self.anew(base, &mut chosen, renew)?;
                    self.sides(base, &mut chosen, renew)?;
                    continue;
                }
                self.nearly = profiles.into_iter().find(|p| p.is_nearly_a_play(trials));
                break;
            };
            let best = self.plain_before_gear(base, &chosen, best, &profiles, trials)?;
            let best = self.richer_law_first(base, &chosen, best, &profiles, trials)?;
            let before = chosen.clone();
            let newcomer = best.candidate;
            chosen.push(best);
            let vanished = self.settle(base, &mut chosen, trials, &impossible)?;
            if vanished.contains(&newcomer) && !same(&before, &chosen) {
                // It has pushed others out that it cannot do without.
                impossible.push(newcomer);
                chosen = before;
                continue;
            }
            self.anew(base, &mut chosen, renew)?;
            self.sides(base, &mut chosen, renew)?;
            let place = chosen.iter().position(|p| p.candidate == newcomer);
            if let Some(i) = place
                && let Some(smaller) = self.smaller(base, &chosen, i, &profiles, trials)?
            {
                chosen[i] = smaller;
                self.refine_all(base, &mut chosen)?;
                chosen.retain(|profile| profile.vanished.is_none());
            }
            stood.push(before);
            if stood.iter().any(|before| same(before, &chosen)) {
                // It does not stand at its best shapes, or pushes out what pushes it out in turn; another that takes away less
                // may.
                if impossible.contains(&newcomer) {
                    break;
                }
                impossible.push(newcomer);
            }
        }
        for _ in 0..LAWS_ANEW {
            let other = self.other_laws(base, &mut chosen)?;
            if !self.springs(base, &mut chosen, trials)? && !other {
                break;
            }
            self.anew(base, &mut chosen, renew)?;
            self.sides(base, &mut chosen, renew)?;
        }
        chosen.sort_by_key(|profile| self.rank_of(&profile.candidate));
        self.dropped = impossible;
        Ok(chosen)
    }

    /// The effects once more by what the model predicts with them in: load and inertia, how far contacts are bent, and the columns
    /// that rest on them. What vanishes by that goes, and its part in them with it.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    fn anew(
        &mut self,
        base: &Fit,
        chosen: &mut Vec<Profile>,
        renew: &dyn Fn(&[Profile]) -> Result<Source<'a>, DiagnoseError>,
    ) -> Result<(), DiagnoseError> {
        let before = chosen.len();
        for _ in 0..2 {
            self.renewed(renew(chosen)?);
            self.refine_all(base, chosen)?;
        }
        chosen.retain(|profile| profile.vanished.is_none());
        if chosen.len() < before {
            self.renewed(renew(chosen)?);
            self.refine_all(base, chosen)?;
        }
        Ok(())
    }

    /// What would stand in the place of the `i`-th effect beside all others, best first; gears only where a gear or what is
    /// taken for one stands there.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn alternatives(
        &self,
        base: &Fit,
        chosen: &[Profile],
        i: usize,
    ) -> Result<Vec<Profile>, DiagnoseError> {
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

    /// What the last search had to drop although it takes away much beside `chosen`, all that it found.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn still_taking(
        &self,
        base: &Fit,
        chosen: &[Profile],
    ) -> Result<Vec<Profile>, DiagnoseError> {
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

    /// Places in the library of what excludes a candidate, but for itself: other laws under its name, other transmissions.
    fn laws_beside(&self, present: Candidate) -> impl Iterator<Item = (usize, &Candidate)> {
        let another = move |c: &Candidate| rivals(c, &present) && c.kind != present.kind;
        (self.library.iter().enumerate()).filter(move |(_, c)| another(c))
    }

    /// Another law under the same name where it does better: clearly, where it has more parameters to bend or the description states
    /// the law. Says whether there was one.
    fn other_laws(&self, base: &Fit, chosen: &mut [Profile]) -> Result<bool, DiagnoseError> {
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
                    && rival.vanished.is_none()
                    && rival.evidence.beyond(&chosen[i].evidence) > least
                {
                    chosen[i] = rival;
                    changed = true;
                }
            }
        }
        Ok(changed)
    }

    /// Refines all shapes together, drops what no longer stands by itself, exchanges what something else does better. Gives
    /// what has vanished.
    fn settle(
        &self,
        base: &Fit,
        chosen: &mut Vec<Profile>,
        trials: usize,
        impossible: &[Candidate],
    ) -> Result<Vec<Candidate>, DiagnoseError> {
        for _ in 0..2 {
            self.refine_all(base, chosen)?;
        }
        // Stand-ins go once the true effect is in.
        let vanished = self.standing(base, chosen)?;
        // Something else in the place of an effect that was taken before the last.
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
                    // A name that a description gave goes for a better one, not for another that does as well.
                    && !(self.is_described(&chosen[i].candidate) && equal(&chosen[i], &rival))
                {
                    chosen[i] = rival;
                    self.refine_all(base, chosen)?;
                }
            }
        }
        Ok(vanished)
    }

    /// What of effects is still possible where others have gone, refined.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn possible(
        &self,
        base: &Fit,
        mut chosen: Vec<Profile>,
    ) -> Result<Vec<Profile>, DiagnoseError> {
        self.refine_all(base, &mut chosen)?;
        chosen.retain(|profile| profile.vanished.is_none());
        Ok(chosen)
    }

    /// Each effect's shapes beside all others; its evidence beside all others.
    fn refine_all(&self, base: &Fit, chosen: &mut [Profile]) -> Result<(), DiagnoseError> {
        for i in 0..chosen.len() {
            let fit = with(base, chosen, Some(i));
            let c = self.place(&chosen[i].candidate);
            let Some(c) = c else { continue };
            let mut better = self.profile(&fit, c, Some(chosen[i].shapes))?;
            if better.is_none() && chosen[i].candidate.kind.is_presliding() {
                // Beside other friction than its shapes were found with, one of its elements may be below zero there.
                better = self.profile(&fit, c, None)?;
            }
            if let Some(mut better) = better {
                better.doubled = (chosen.iter()).any(|p| doubles(&p.candidate, &better.candidate));
                chosen[i] = better;
            } else {
                // No column of its own any more, or only with signs that cannot be.
                chosen[i].evidence.gain = 0.0;
                chosen[i].evidence.joint_gain = 0.0;
                chosen[i].evidence.p_value = 1.0;
                chosen[i].vanished = Some("gain");
            }
        }
        Ok(())
    }
}

/// Orders of a joint beyond those of the grids that the library's waves of its motor begin with.
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

/// How many effects there are, the orders of one wave counting once.
fn sorts(chosen: &[Profile]) -> usize {
    let sort = |p: &Profile| p.candidate.sort();
    let first = |k: &usize| !chosen[..*k].iter().any(|p| sort(p) == sort(&chosen[*k]));
    (0..chosen.len()).filter(first).count()
}

/// Whether they are the same effects.
pub(super) fn same(a: &[Profile], b: &[Profile]) -> bool {
    a.len() == b.len()
        && a.iter()
            .all(|p| b.iter().any(|q| q.candidate == p.candidate))
}

/// The nominal columns with those of the effects, but for one.
pub(super) fn with<'f>(base: &Fit<'f>, chosen: &[Profile], but: Option<usize>) -> Fit<'f> {
    let mut fit = base.clone();
    for (k, profile) in chosen.iter().enumerate() {
        if Some(k) == but {
            continue;
        }
        for column in profile.columns.iter() {
            if profile.followed.is_some() {
                fit.subtract(column);
            } else {
                fit.push(column);
            }
        }
    }
    fit
}

#[cfg(test)]
mod tests;
