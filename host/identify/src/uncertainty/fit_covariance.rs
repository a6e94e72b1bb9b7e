//! Covariance of a fit, from a pass over its rows.

use nalgebra::{DMatrix, DVector};

use super::estimate::Estimate;
use super::groups::Groups;
use super::memory::Memory;
use crate::error::IdentifyError;
use crate::estimator::Loss;
use crate::estimators::linear::{classical, kept_columns, product, spread};
use crate::options::Options;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use crate::structure::independent::Independent;
use rig_data::prepare::Recording;

/// Returns the estimate with its covariance, from one pass over the fitted rows. `beside` is added to the covariance of
/// the identified combinations.
pub(crate) fn covariance(
    training: &[&dyn Recording],
    plan: &Plan,
    options: &Options,
    factor: &TriangularFactor,
    data: &Independent,
    beta: &[f64],
    weights: &[f64],
    loss: Option<(Loss, &[f64])>,
    instants: u64,
    beside: Option<&DMatrix<f64>>,
) -> Result<Estimate, IdentifyError> {
    let (classical_std, inverse) = classical(factor, data, beta)?;
    let full = spread(beta, &data.kept, factor.columns());
    let (p, size) = (full.len(), beta.len());
    let mut groups = Groups::new(size, instants);
    let mut memories = vec![Memory::default(); weights.len()];
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
                    let e = equation.y[i] - product(x, &full);
                    memories[k].push(e);
                    let mut weight = options.row_weight(r) * weights[k];
                    if let Some((loss, scale)) = loss {
                        weight *= loss.weight(e / scale[k].max(f64::MIN_POSITIVE)).sqrt();
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
    let memory = memories.iter().map(Memory::length).fold(1.0, f64::max);
    let rows: u64 = memories.iter().map(Memory::seen).sum();
    let (white, count) = groups.jackknife(memory).ok_or_else(|| {
        let seconds = training.len() as f64
            * instants as f64
            * plan.treatment.decimation as f64
            * plan.treatment.dt();
        IdentifyError::TooShortForIntervals {
            rows,
            memory,
            needed: (2.0 * seconds).ceil() as u64,
        }
    })?;
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
