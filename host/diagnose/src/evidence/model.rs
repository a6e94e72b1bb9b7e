//! A model of one joint: effects, and coordinates along which an unknown torque is allowed.

use rig_numerics::vector::axpy;

use super::discrepancy::Along;
use super::joint::{Entry, JointColumns};
use super::posterior::Posterior;
use crate::DiagnoseError;
use crate::columns::kinds::is_gear;
use crate::search::fitted_candidate::FittedCandidate;

/// Prior log odds against an effect of the library: 150 to 1.
const AGAINST_EFFECT: f64 = 5.0;
/// Prior log odds against an unknown dependence on a coordinate: known physics is preferred at equal evidence.
const AGAINST_UNKNOWN: f64 = 12.0;
/// Discrepancy along a coordinate that every model may have, over the noise: filters, numerical differentiation and
/// law forms leave it on rigs without hidden effects.
const DISCREPANCY: f64 = 0.15;
/// The same for derivatives of the torque, which the filters distort.
const OF_FILTERS: f64 = 0.5;
/// Least torque of an effect beside the nominal model, over the noise: the discrepancy along a few coordinates together.
const LEAST: f64 = 0.3;
/// The same, over the torque of the other effects of the joint: how far the form of a law may be from the true one.
const LAW_FORM: f64 = 0.05;
/// First spread of an unknown torque, over the noise.
const FIRST: f64 = 0.5;
/// Least spread of a discrepancy, over the noise.
const SMALLEST: f64 = 1e-4;

/// A model and its fit.
#[derive(Clone)]
pub(crate) struct Model {
    /// Entries of the library.
    pub(crate) effects: Vec<usize>,
    /// Families whose torque may be of any size.
    pub(crate) open: Vec<usize>,
    /// Variance of the discrepancy, family by family.
    pub(crate) spread: Vec<f64>,
    /// Log evidence with the prior odds.
    pub(crate) score: f64,
    /// Coefficients of the nominal columns.
    pub(crate) nominal: Vec<f64>,
    /// Gains, effect by effect.
    pub(crate) gains: Vec<Vec<f64>>,
    /// Weights of the families.
    pub(crate) weights: Vec<Vec<f64>>,
    /// True if all gains are within their bounds and no effect vanishes.
    pub(crate) possible: bool,
}

/// Returns the least torque over the noise that is more than the discrepancy beside effects, from the sum of their squares.
fn least_beside(squares: f64) -> f64 {
    LEAST.hypot(LAW_FORM * squares.sqrt())
}

impl JointColumns<'_> {
    /// Largest variance of a family that is not open.
    fn most(&self, family: usize) -> f64 {
        let share = match self.families[family].along {
            along if along.is_about_reversals() => return f64::INFINITY,
            Along::Filters => OF_FILTERS,
            _ => DISCREPANCY,
        };
        (share * self.noise.deviation).powi(2)
    }

    /// Returns columns and prior variances of a model, and the place of its first family.
    fn layout(&self, effects: &[usize], spread: &[f64]) -> (Vec<usize>, Vec<f64>, usize) {
        let (mut columns, mut variances): (Vec<usize>, Vec<f64>) =
            self.nominal.iter().copied().unzip();
        for entry in effects.iter().map(|e| &self.entries[*e]) {
            columns.extend(&entry.columns);
            variances.extend(&entry.variances);
        }
        let first = columns.len();
        for (family, spread) in self.families.iter().zip(spread) {
            columns.extend(&family.columns);
            variances.extend(family.columns.iter().map(|_| spread));
        }
        (columns, variances, first)
    }

    /// Returns the place of the gear among the effects of a model.
    pub(crate) fn gear(&self, model: &Model) -> Option<usize> {
        (model.effects.iter()).position(|e| is_gear(self.entries[*e].candidate.kind))
    }

    /// Returns the effects of a model as other stages take them, with their gains.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn fitted_candidates(
        &self,
        model: &Model,
    ) -> Result<Vec<(FittedCandidate, Vec<f64>)>, DiagnoseError> {
        let of = |(entry, gains): (&usize, &Vec<f64>)| {
            let Entry {
                candidate, shapes, ..
            } = self.entries[*entry];
            let columns = self.search.source.columns(&candidate, &shapes)?;
            let own = FittedCandidate::unjudged(candidate, shapes, columns);
            Ok((own, gains.clone()))
        };
        model.effects.iter().zip(&model.gains).map(of).collect()
    }

    /// Returns the posterior of a model.
    pub(crate) fn posterior(&self, effects: &[usize], spread: &[f64]) -> Option<Posterior> {
        let (columns, variances, _) = self.layout(effects, spread);
        Posterior::of(&self.products, columns, &variances)
    }

    /// Fits a model, with `rounds` of the fixed-point iteration of the spreads (MacKay 1992, Neural Computation 4:415)
    /// from a start. None if rounding makes it singular.
    pub(crate) fn fit(
        &self,
        effects: &[usize],
        open: &[usize],
        start: Option<&[f64]>,
        rounds: usize,
    ) -> Option<Model> {
        let first = (FIRST * self.noise.deviation).powi(2);
        let least = (SMALLEST * self.noise.deviation).powi(2);
        let mut spread: Vec<f64> = (0..self.families.len())
            .map(|f| {
                let from = start.map_or(0.36 * first, |s| s[f]);
                if open.contains(&f) {
                    from.max(first)
                } else {
                    from.min(self.most(f))
                }
            })
            .collect();
        let mut posterior = self.posterior(effects, &spread)?;
        let (_, _, families) = self.layout(effects, &spread);
        for _ in 0..rounds {
            let mut place = families;
            for (f, family) in self.families.iter().enumerate() {
                let n = family.columns.len();
                let squares: f64 = posterior.means[place..place + n]
                    .iter()
                    .map(|w| w * w)
                    .sum();
                let kept: f64 = (place..place + n).map(|k| posterior.variance(k)).sum();
                let known = n as f64 - kept / spread[f];
                let new = (squares / known.max(1e-9)).max(least);
                spread[f] = if open.contains(&f) {
                    new
                } else {
                    new.min(self.most(f))
                };
                place += n;
            }
            posterior = self.posterior(effects, &spread)?;
        }
        Some(self.model(effects, open, spread, &posterior))
    }

    fn model(
        &self,
        effects: &[usize],
        open: &[usize],
        spread: Vec<f64>,
        posterior: &Posterior,
    ) -> Model {
        let mut place = 0;
        let mut take = |n: usize| {
            place += n;
            posterior.means[place - n..place].to_vec()
        };
        let nominal = take(self.nominal.len());
        let gains: Vec<Vec<f64>> = effects
            .iter()
            .map(|e| take(self.entries[*e].columns.len()))
            .collect();
        let weights = self
            .families
            .iter()
            .map(|f| take(f.columns.len()))
            .collect();
        let possible = (effects.iter().zip(&gains))
            .all(|(e, gains)| !self.entries[*e].vanishes && self.entries[*e].allows(gains));
        let against: f64 = (effects.iter())
            .map(|e| AGAINST_EFFECT + (self.entries[*e].grid.max(1) as f64).ln())
            .sum();
        Model {
            effects: effects.to_vec(),
            open: open.to_vec(),
            spread,
            nominal,
            score: posterior.log - against - AGAINST_UNKNOWN * open.len() as f64,
            gains,
            weights,
            possible,
        }
    }

    /// Returns true if the torque of each effect is more than the discrepancy that every model may have.
    pub(crate) fn is_large(&self, model: &Model) -> bool {
        let sizes = self.sizes(model);
        let squares: f64 = sizes.iter().map(|s| s * s).sum();
        (sizes.iter()).all(|own| *own >= least_beside((squares - own * own).max(0.0)))
    }

    /// Returns the torque over the noise that a model leaves beyond the noise of repeated runs, along no coordinate. None
    /// without a repeated run, and if it is no more than the discrepancy that every model may have.
    pub(crate) fn left(&self, model: &Model) -> Option<f64> {
        let over = self.noise.beyond_repeats(&self.innovations(model))?;
        let left = over.max(0.0).sqrt();
        let squares = self.sizes(model).iter().map(|s| s * s).sum();
        (left > least_beside(squares)).then_some(left)
    }

    fn sizes(&self, model: &Model) -> Vec<f64> {
        (model.effects.iter().zip(&model.gains))
            .map(|(e, gains)| self.size(*e, gains))
            .collect()
    }

    /// Returns the root of the mean square torque of an effect beside the nominal model, over the noise.
    pub(crate) fn size(&self, entry: usize, gains: &[f64]) -> f64 {
        let columns = &self.entries[entry].columns;
        self.size_of(columns, gains)
    }

    /// Returns the same for the discrepancy along a coordinate.
    pub(crate) fn size_of_family(&self, family: usize, weights: &[f64]) -> f64 {
        self.size_of(&self.families[family].columns, weights)
    }

    /// Returns the averaged residual of a model.
    pub(crate) fn residual(&self, model: &Model) -> Vec<f64> {
        self.noise.coloured(&self.innovations(model))
    }

    /// Returns the whitened residual of a model.
    fn innovations(&self, model: &Model) -> Vec<f64> {
        let (columns, ..) = self.layout(&model.effects, &model.spread);
        let values = [
            &model.nominal,
            &model.gains.concat(),
            &model.weights.concat(),
        ];
        let mut residual = self.products.column(0).to_vec();
        for (column, value) in columns.iter().zip(values.into_iter().flatten()) {
            axpy(-value, self.products.column(*column), &mut residual);
        }
        residual
    }

    fn size_of(&self, columns: &[usize], gains: &[f64]) -> f64 {
        let with = |column: usize| -> f64 {
            (columns.iter().zip(gains))
                .map(|(own, gain)| gain * self.products.of(*own, column))
                .sum()
        };
        let whole: f64 = (columns.iter().zip(gains))
            .map(|(own, gain)| gain * with(*own))
            .sum();
        // What the nominal columns could take over is not the effect's own.
        let taken = self
            .posterior(&[], &[])
            .map_or(0.0, |nominal| nominal.explained(with));
        ((whole - taken).max(0.0) / self.products.rows() as f64).sqrt()
    }
}
