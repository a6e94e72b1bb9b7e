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
        let p = base.len();
        let equations = plan.loudness.len();
        let mut factors = vec![TriangularFactor::new(p); equations];
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
            });
        }
        let combine = |weights: &[f64]| {
            let mut all = TriangularFactor::new(p);
            for (factor, weight) in factors.iter().zip(weights) {
                all.merge(factor, *weight);
            }
            all
        };
        // Scaled by torque, so that strong joints do not hide weak ones when excitation is judged.
        let by_torque: Vec<f64> = factors
            .iter()
            .map(|f| {
                let rms = (f.right_side_squares() / f.rows().max(1) as f64).sqrt();
                if rms > 0.0 { 1.0 / rms } else { 1.0 }
            })
            .collect();
        let data = excited(base, &combine(&by_torque));

        let mut weights = vec![1.0; equations];
        let mut beta = least_squares(&combine(&weights), &data, base)?;
        let by_noise: Vec<f64> = {
            let full = spread(&beta, &data.kept, p);
            factors
                .iter()
                .map(|factor| {
                    let freedom = factor
                        .rows()
                        .saturating_sub(p as u64 / equations as u64)
                        .max(1);
                    let sigma = (factor.residual_squares(&full) / freedom as f64).sqrt();
                    if sigma > 0.0 { 1.0 / sigma } else { 1.0 }
                })
                .collect()
        };
        let weighted = least_squares(&combine(&by_noise), &data, base)?;
        if options.estimator != Estimator::Ols {
            weights.clone_from(&by_noise);
            beta.clone_from(&weighted);
        }
        let mut factor = combine(&weights);
        let mut scales = None;
        let mut passes = 0;
        let mut converged = true;
        if options.estimator == Estimator::Robust {
            let mut scale = spread_of(
                training,
                plan,
                options,
                &spread(&beta, &data.kept, p),
                equations,
            )?;
            converged = false;
            while passes < MOST_PASSES && !converged {
                let (next_factor, next_scale) = reweighted(
                    training,
                    plan,
                    options,
                    &spread(&beta, &data.kept, p),
                    &weights,
                    &scale,
                )?;
                let next = least_squares(&next_factor, &data, base)?;
                let (std, _) = classical(&next_factor, &data, &next)?;
                converged = next
                    .iter()
                    .zip(&beta)
                    .zip(&std)
                    .all(|((a, b), s)| (a - b).abs() <= SETTLED * s);
                (beta, factor, scale) = (next, next_factor, next_scale);
                passes += 1;
            }
            scales = Some(scale);
        }
        Ok(Self {
            factors,
            instants,
            tally,
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
