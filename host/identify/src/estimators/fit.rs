//! Fit of the base parameters to torques: all rows enter a triangular factor per equation, then the equations are
//! weighted.

use super::linear::{classical, least_squares, spread};
use super::robust::{reweighted, spread_of};
use crate::error::IdentifyError;
use crate::estimator::Estimator;
use crate::options::Options;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use crate::rows::tally::Tally;
use crate::structure::base::Base;
use crate::structure::excitation::excited;
use crate::structure::independent::Independent;
use rig_data::prepare::{Recording, each_of, threads};

/// Largest change of a parameter at the end of reweighting, as a share of its standard deviation.
const SETTLED: f64 = 1e-3;
/// Largest number of passes; a warning reports it.
pub(crate) const MOST_PASSES: usize = 30;

/// Base parameters by least squares, and their data.
pub(crate) struct Fit {
    /// Rows of each equation.
    pub factors: Vec<TriangularFactor>,
    /// Number of instants of all recordings.
    pub instants: u64,
    /// Counts of used and excluded rows.
    pub tally: Tally,
    /// Columns that are identifiable from the recordings.
    pub data: Independent,
    /// Weights: one over each equation's residual.
    pub by_noise: Vec<f64>,
    /// Values with these weights.
    pub weighted: Vec<f64>,
    /// Weights of the requested estimator.
    pub weights: Vec<f64>,
    /// Rows with the estimator's weights.
    pub factor: TriangularFactor,
    /// Values of the estimator.
    pub beta: Vec<f64>,
    /// Scale of each equation's residual, if rows were also weighted.
    pub scales: Option<Vec<f64>>,
    /// True if the values converged.
    pub converged: bool,
}

impl Fit {
    /// Fits `training`.
    ///
    /// # Errors
    /// [`IdentifyError`]: recordings that cannot be read, too few usable rows, a singular problem.
    pub(crate) fn of(
        training: &[&dyn Recording],
        plan: &Plan,
        options: &Options,
        base: &Base,
    ) -> Result<Self, IdentifyError> {
        let (p, equations) = (base.len(), plan.loudness.len());
        let rows = Collected::of(training, plan, options, p)?;
        let data = excited(base, &rows.combined(&rows.by_torque()));
        let mut weights = vec![1.0; equations];
        let mut beta = least_squares(&rows.combined(&weights), &data, base)?;
        let by_noise = rows.by_noise(&spread(&beta, &data.kept, p));
        let weighted = least_squares(&rows.combined(&by_noise), &data, base)?;
        if options.estimator != Estimator::Ols {
            weights.clone_from(&by_noise);
            beta.clone_from(&weighted);
        }
        let mut factor = rows.combined(&weights);
        let mut scales = None;
        let mut converged = true;
        if options.estimator == Estimator::Robust {
            let start = Weighted {
                base,
                data: &data,
                weights: &weights,
            };
            let last = start.reweighted(training, plan, options, beta)?;
            (beta, factor, converged) = (last.beta, last.factor, last.converged);
            scales = Some(last.scales);
        }
        Ok(Self {
            factors: rows.factors,
            instants: rows.instants,
            tally: rows.tally,
            data,
            by_noise,
            weighted,
            weights,
            factor,
            beta,
            scales,
            converged,
        })
    }

    /// Returns the values of all base columns, zero for columns that are not identifiable on their own.
    pub(crate) fn full(&self) -> Vec<f64> {
        spread(&self.beta, &self.data.kept, self.data.combination.ncols())
    }
}

/// The rows of all recordings.
struct Collected {
    /// Rows of each equation, with the weights of the recordings.
    factors: Vec<TriangularFactor>,
    /// Number of base columns.
    columns: usize,
    instants: u64,
    tally: Tally,
}

impl Collected {
    /// Passes once over the recordings; the rows have `p` columns.
    fn of(
        training: &[&dyn Recording],
        plan: &Plan,
        options: &Options,
        p: usize,
    ) -> Result<Self, IdentifyError> {
        let mut factors = vec![TriangularFactor::new(p); plan.loudness.len()];
        let mut instants = 0u64;
        let mut tally = Tally::default();
        for (r, recording) in training.iter().enumerate() {
            let weight = options.row_weight(r);
            let part = each_rows(*recording, plan, options.model, &mut |rows| {
                each_of(
                    threads(plan.treatment.threads),
                    &mut factors,
                    &|k, factor| {
                        let Some(equation) = rows.equations.get(k) else {
                            return;
                        };
                        for (i, keep) in equation.keep.iter().enumerate() {
                            if *keep {
                                factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], weight);
                            }
                        }
                    },
                );
                instants += rows.t.len() as u64;
                Ok(())
            })?;
            tally.add(&part);
        }
        if tally.used < 2 * p as u64 {
            return Err(IdentifyError::NothingLeft {
                used: tally.used,
                unknown: p,
                slow: tally.slow.iter().sum(),
                saturated: tally.saturated.iter().sum(),
                unsettled: tally.unsettled.iter().sum(),
            });
        }
        Ok(Self {
            factors,
            columns: p,
            instants,
            tally,
        })
    }

    /// Returns all rows, with a weight per equation.
    fn combined(&self, weights: &[f64]) -> TriangularFactor {
        let mut all = TriangularFactor::new(self.columns);
        for (factor, weight) in self.factors.iter().zip(weights) {
            all.merge(factor, *weight);
        }
        all
    }

    /// Returns weights by the torque of each equation, so that strong joints do not hide weak ones when excitation is
    /// judged.
    fn by_torque(&self) -> Vec<f64> {
        self.factors
            .iter()
            .map(|f| {
                let rms = (f.right_side_squares() / f.rows().max(1) as f64).sqrt();
                if rms > 0.0 { 1.0 / rms } else { 1.0 }
            })
            .collect()
    }

    /// Returns weights of one over the residual of each equation, for values of all base columns.
    fn by_noise(&self, full: &[f64]) -> Vec<f64> {
        let equations = self.factors.len() as u64;
        self.factors
            .iter()
            .map(|factor| {
                let freedom = factor
                    .rows()
                    .saturating_sub(self.columns as u64 / equations)
                    .max(1);
                let sigma = (factor.residual_squares(full) / freedom as f64).sqrt();
                if sigma > 0.0 { 1.0 / sigma } else { 1.0 }
            })
            .collect()
    }
}

/// What a robust fit starts from.
struct Weighted<'a> {
    base: &'a Base,
    data: &'a Independent,
    weights: &'a [f64],
}

/// The last pass of a robust fit.
struct Reweighted {
    beta: Vec<f64>,
    factor: TriangularFactor,
    /// Scale of each equation's residual.
    scales: Vec<f64>,
    converged: bool,
}

impl Weighted<'_> {
    /// Reweights the rows by their residuals until the values settle, starting from `beta`.
    fn reweighted(
        &self,
        training: &[&dyn Recording],
        plan: &Plan,
        options: &Options,
        beta: Vec<f64>,
    ) -> Result<Reweighted, IdentifyError> {
        let Self {
            base,
            data,
            weights,
        } = *self;
        let full = |beta: &[f64]| spread(beta, &data.kept, base.len());
        let scales = spread_of(training, plan, options, &full(&beta), weights.len())?;
        let mut last = Reweighted {
            factor: TriangularFactor::new(base.len()),
            beta,
            scales,
            converged: false,
        };
        let mut passes = 0;
        while passes < MOST_PASSES && !last.converged {
            let (factor, scales) = reweighted(
                training,
                plan,
                options,
                &full(&last.beta),
                weights,
                &last.scales,
            )?;
            let beta = least_squares(&factor, data, base)?;
            let (std, _) = classical(&factor, data, &beta)?;
            let converged = beta
                .iter()
                .zip(&last.beta)
                .zip(&std)
                .all(|((a, b), s)| (a - b).abs() <= SETTLED * s);
            last = Reweighted {
                beta,
                factor,
                scales,
                converged,
            };
            passes += 1;
        }
        Ok(last)
    }
}
