//! Search for the model with the largest evidence: add, drop, replace, reshape.

use rig_numerics::optimise::golden_section::golden_section;
use rig_numerics::vector::dot;
use rig_shared::effects::{SHAPES, Scale};

use super::joint::JointColumns;
use super::model::Model;
use crate::DiagnoseError;
use crate::columns::kinds::rivals;
use crate::search::shapes::{coordinate, spacing, value_at};

/// Candidates of a sweep that are fitted with all hyperparameters.
const FITTED: usize = 6;
/// Rounds of the spreads for a comparison, and for a result.
const ROUNDS: [usize; 2] = [5, 20];
/// Gain in log evidence below which the search does not move.
const STEP: f64 = 0.3;
/// Steps of the refinement of a shape.
const REFINEMENTS: usize = 10;
/// Most effects of a joint.
const MOST: usize = 8;

/// Log odds of an effect against the best model without it, and the names of effects that could replace it.
pub(crate) type Odds = (f64, Vec<&'static str>);

/// An effect beside a model, with its gain in log evidence at the model's spreads.
struct Beside {
    entry: usize,
    gain: f64,
}

impl JointColumns<'_> {
    /// Returns the model with the largest evidence that the search finds, from a start.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn best(&mut self, start: &[usize]) -> Result<Model, DiagnoseError> {
        let mut model = self.fitted(start, &[], None, ROUNDS[1])?;
        if !start.is_empty() {
            model = self.reshaped(model)?;
            model = self.settled(model)?;
        }
        while model.effects.len() < MOST {
            let Some(better) = self.grown(&model)? else {
                break;
            };
            model = self.settled(better)?;
        }
        self.fitted(&model.effects, &model.open, Some(&model.spread), ROUNDS[1])
    }

    fn fitted(
        &self,
        effects: &[usize],
        open: &[usize],
        start: Option<&[f64]>,
        rounds: usize,
    ) -> Result<Model, DiagnoseError> {
        self.fit(effects, open, start, rounds).ok_or_else(|| {
            DiagnoseError::Model("its columns are collinear along this motion.".into())
        })
    }

    /// Returns the best model with one effect or one unknown dependence more; None if none is better.
    fn grown(&mut self, model: &Model) -> Result<Option<Model>, DiagnoseError> {
        let mut best: Option<Model> = None;
        for beside in self.sweep(model, FITTED) {
            let effects = [model.effects.as_slice(), &[beside.entry]].concat();
            self.keep_better(&mut best, &effects, &model.open, &model.spread);
        }
        for family in self.closed(model) {
            let open = [model.open.as_slice(), &[family]].concat();
            self.keep_better(&mut best, &model.effects, &open, &model.spread);
        }
        match best.filter(|best| best.score > model.score + STEP) {
            Some(best) => Ok(Some(self.reshaped(best)?)),
            None => Ok(None),
        }
    }

    /// Returns the families that a model could open.
    fn closed(&self, model: &Model) -> Vec<usize> {
        (0..self.families.len())
            .filter(|f| !self.families[*f].along.is_about_reversals() && !model.open.contains(f))
            .collect()
    }

    /// Keeps a model in `best` if it is possible and better.
    fn keep_better(
        &self,
        best: &mut Option<Model>,
        effects: &[usize],
        open: &[usize],
        start: &[f64],
    ) {
        let Some(model) = self.fit(effects, open, Some(start), ROUNDS[0]) else {
            return;
        };
        if model.possible
            && self.is_large(&model)
            && best.as_ref().is_none_or(|b| model.score > b.score)
        {
            *best = Some(model);
        }
    }

    /// Drops and replaces effects and unknown dependences of a model while that is better.
    fn settled(&mut self, mut model: Model) -> Result<Model, DiagnoseError> {
        for _ in 0..4 {
            let before = model.score;
            for k in (0..model.open.len()).rev() {
                let mut open = model.open.clone();
                open.remove(k);
                let effects = model.effects.clone();
                model = self.without(model, &effects, &open)?;
            }
            for k in (0..model.effects.len()).rev() {
                if k < model.effects.len() {
                    let mut effects = model.effects.clone();
                    effects.remove(k);
                    let open = model.open.clone();
                    model = self.without(model, &effects, &open)?;
                }
            }
            if model.score < before + STEP {
                break;
            }
        }
        Ok(model)
    }

    /// Returns the best of a model, a smaller one, and the smaller one with another effect or unknown dependence.
    fn without(
        &mut self,
        model: Model,
        effects: &[usize],
        open: &[usize],
    ) -> Result<Model, DiagnoseError> {
        let Some(rest) = self.fit(effects, open, Some(&model.spread), ROUNDS[0]) else {
            return Ok(model);
        };
        if rest.possible && (rest.score > model.score || !model.possible) {
            return Ok(rest);
        }
        match self.grown(&rest)? {
            Some(other) if other.score > model.score + STEP => Ok(other),
            _ => Ok(model),
        }
    }

    /// Returns the best shape of each effect beside a model, best effects first.
    fn sweep(&self, model: &Model, most: usize) -> Vec<Beside> {
        let Some(posterior) = self.posterior(&model.effects, &model.spread) else {
            return Vec::new();
        };
        let present: Vec<_> = (model.effects.iter())
            .map(|e| self.entries[*e].candidate.shaped(&self.entries[*e].shapes))
            .collect();
        let mut best: Vec<Beside> = Vec::new();
        for (entry, own) in self.entries.iter().enumerate() {
            let candidate = own.candidate.shaped(&own.shapes);
            if own.vanishes || present.iter().any(|p| rivals(p, &candidate)) {
                continue;
            }
            let with = |i: usize, column: usize| self.products.of(own.columns[i], column);
            let among = |i: usize, j: usize| with(i, own.columns[j]);
            let Some((gain, means)) = posterior.beside(with, among, &own.variances) else {
                continue;
            };
            if !own.allows(&means) {
                continue;
            }
            let beside = Beside { entry, gain };
            let same = |b: &&mut Beside| self.entries[b.entry].candidate == own.candidate;
            match best.iter_mut().find(same) {
                Some(known) if known.gain >= gain => {}
                Some(known) => *known = beside,
                None => best.push(beside),
            }
        }
        best.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        best.truncate(most);
        best
    }

    /// Refines the shapes of a model's effects, the last first.
    fn reshaped(&mut self, mut model: Model) -> Result<Model, DiagnoseError> {
        for k in (0..model.effects.len()).rev() {
            let entry = model.effects[k];
            if self.entries[entry].fixed {
                continue;
            }
            let mut rest = model.effects.clone();
            rest.remove(k);
            let Some(shapes) = self.better_shapes(&rest, &model.spread, entry)? else {
                continue;
            };
            let candidate = self.entries[entry].candidate;
            let Some(new) = self.add_at(&candidate, shapes)? else {
                continue;
            };
            let mut effects = model.effects.clone();
            effects[k] = new;
            if let Some(other) = self.fit(&effects, &model.open, Some(&model.spread), ROUNDS[0])
                && other.possible
                && other.score > model.score
            {
                model = other;
            }
        }
        Ok(model)
    }

    /// Returns the shapes of an entry with the largest evidence beside `rest`, if they are better than its own.
    fn better_shapes(
        &self,
        rest: &[usize],
        spread: &[f64],
        entry: usize,
    ) -> Result<Option<[f64; SHAPES]>, DiagnoseError> {
        let own = &self.entries[entry];
        let scales = own.candidate.kind.about().shapes;
        let Some(posterior) = self.posterior(rest, spread) else {
            return Ok(None);
        };
        let reach = self.reach(&own.candidate);
        let gain_at = |shapes: &[f64; SHAPES]| -> Result<f64, DiagnoseError> {
            let Some((columns, variances)) = self.columns_at(&own.candidate, shapes)? else {
                return Ok(f64::NEG_INFINITY);
            };
            let products: Vec<Vec<f64>> =
                columns.iter().map(|c| self.products.with_all(c)).collect();
            let with = |i: usize, column: usize| products[i][column];
            let among = |i: usize, j: usize| dot(&columns[i], &columns[j]);
            Ok((posterior.beside(with, among, &variances))
                .filter(|(_, means)| own.allows(means))
                .map_or(f64::NEG_INFINITY, |(gain, _)| gain))
        };
        let mut best = (gain_at(&own.shapes)?, own.shapes);
        let first = best.0;
        for (place, shape) in scales.iter().enumerate() {
            if shape.scale == Scale::Whole {
                continue;
            }
            let [step, fine] = spacing(shape, scales.len());
            let middle = coordinate(shape, best.1[place]);
            let [least, most] = reach[place].map(|bound| coordinate(shape, bound));
            let (low, high) = ((middle - step).max(least), (middle + step).min(most));
            if low >= high {
                continue;
            }
            let start = best.1;
            golden_section([low, high], REFINEMENTS, fine, |x| {
                let mut shapes = start;
                shapes[place] = value_at(shape, x);
                let gain = gain_at(&shapes)?;
                if gain > best.0 {
                    best = (gain, shapes);
                }
                Ok::<f64, DiagnoseError>(gain)
            })?;
        }
        Ok((best.0 > first).then_some(best.1))
    }

    /// Returns the odds of each effect of a model; names count as equal within the log odds `equal`.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn odds(&mut self, model: &Model, equal: f64) -> Result<Vec<Odds>, DiagnoseError> {
        let mut list = Vec::new();
        for k in 0..model.effects.len() {
            let mut effects = model.effects.clone();
            let own = effects.remove(k);
            let rest = self.fitted(&effects, &model.open, Some(&model.spread), ROUNDS[1])?;
            let mut odds = model.score - rest.score;
            let mut set = Vec::new();
            for beside in self.sweep(&rest, FITTED) {
                let kind = self.entries[beside.entry].candidate.kind;
                if kind.about().name == self.entries[own].candidate.kind.about().name {
                    continue;
                }
                let with = [effects.as_slice(), &[beside.entry]].concat();
                if let Some(other) = self.fit(&with, &model.open, Some(&rest.spread), ROUNDS[0])
                    && other.possible
                {
                    let other = self.reshaped(other)?;
                    let name = kind.about().name;
                    if other.score > model.score - equal && !set.contains(&name) {
                        set.push(name);
                    }
                }
            }
            for family in self.closed(&rest) {
                let open = [rest.open.as_slice(), &[family]].concat();
                if let Some(other) = self.fit(&effects, &open, Some(&rest.spread), ROUNDS[0]) {
                    odds = odds.min(model.score - other.score);
                }
            }
            list.push((odds, set));
        }
        Ok(list)
    }
}
