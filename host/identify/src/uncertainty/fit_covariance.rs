//! Covariance of a fit, from a pass over its rows.

use nalgebra::{DMatrix, DVector};

use super::estimate::Estimate;
use super::groups::Groups;
use crate::error::IdentifyError;
use crate::estimators::fit::Fit;
use crate::estimators::linear::{classical, kept_columns, spread};
use crate::estimators::problem::Problem;
use crate::rows::stream::each_rows;
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::vector::dot_in_order;

/// Returns the least-squares estimate with its covariance, from one pass over the fitted rows. `beside` is added to the
/// covariance of the identified combinations.
pub(crate) fn covariance(
    problem: &Problem,
    fit: &Fit,
    beside: Option<&DMatrix<f64>>,
) -> Result<Estimate, IdentifyError> {
    let Problem {
        training,
        plan,
        options,
        ..
    } = *problem;
    let Fit {
        factor,
        data,
        beta,
        weights,
        instants,
        ..
    } = fit;
    let (classical_std, inverse) = classical(factor, data, beta)?;
    let full = spread(beta, &data.kept, factor.columns());
    let (p, size) = (full.len(), beta.len());
    let mut groups = Groups::new(size, *instants);
    let mut memories = vec![Autocorrelation::default(); weights.len()];
    let mut index = 0u64;
    let whiten = inverse.transpose();
    let mut x_kept = DVector::zeros(size);
    let mut z = DVector::zeros(size);
    for (r, recording) in training.iter().enumerate() {
        each_rows(*recording, plan, options.model, &mut |rows| {
            for i in 0..rows.t.len() {
                for (k, equation) in rows.equations.iter().enumerate() {
                    if !equation.keep[i] {
                        continue;
                    }
                    let x = &equation.x[i * p..(i + 1) * p];
                    let e = equation.y[i] - dot_in_order(x, &full);
                    memories[k].push(e);
                    let mut weight = options.row_weight(r) * weights[k];
                    if let Some(scale) = &fit.scales {
                        weight *= options
                            .loss
                            .weight(e / scale[k].max(f64::MIN_POSITIVE))
                            .sqrt();
                    }
                    for (to, &c) in x_kept.iter_mut().zip(&data.kept) {
                        *to = weight * x[c];
                    }
                    z.gemv(1.0, &whiten, &x_kept, 0.0);
                    groups.push(index, &z, weight * e);
                }
                index += 1;
            }
            Ok(())
        })?;
    }
    let memory = memories
        .iter()
        .map(Autocorrelation::correlation_time)
        .fold(1.0, f64::max);
    let rows: u64 = memories.iter().map(Autocorrelation::seen).sum();
    let (white, count) = groups
        .jackknife(memory)
        .ok_or_else(|| too_short(problem, *instants, rows, memory))?;
    let mut covariance = &inverse * white * inverse.transpose();
    if let Some(beside) = beside {
        covariance += beside;
    }
    let (regressor, _) = kept_columns(factor, data);
    Ok(Estimate::of(
        beta,
        &covariance,
        count - 1,
        classical_std,
        &regressor,
        rows,
        memory,
    ))
}

/// Returns the error for `instants` instants of `rows` rows whose residuals have a correlation time of `memory` rows.
fn too_short(problem: &Problem, instants: u64, rows: u64, memory: f64) -> IdentifyError {
    let treatment = problem.plan.treatment;
    let seconds = problem.training.len() as f64
        * instants as f64
        * treatment.decimation as f64
        * treatment.dt();
    IdentifyError::TooShortForIntervals {
        rows,
        memory,
        needed: (2.0 * seconds).ceil() as u64,
    }
}
