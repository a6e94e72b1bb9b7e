//! Choice of the decimation, by how well left-out segments are predicted.
//!
//! Position noise passes into the acceleration with the square of the frequency. Least squares assumes an exact
//! regressor and then underestimates inertias (errors in variables; Söderström 2018, ch. 2). Torque and regressor pass
//! one low-pass before rows are dropped. A narrower band removes this noise, but also part of the information of a fast
//! motion about inertia. The data decide: each band is fitted without one time segment and predicts that segment in the
//! narrowest band, where position noise biases the comparison least.
//!
//! Limits: one band for all joints; noise below the narrowest band remains.

use super::left_out::{BETTER, Stretches};
use super::trial_rows::beginnings;
use super::trial_rows::kept;
use crate::error::IdentifyError;
use crate::rows::plan::Plan;
use rig_data::prepare::{PrepareError, PreprocessingPlan, Recording};

/// Ratio of neighbouring bands.
const STEP: f64 = std::f64::consts::SQRT_2;
/// The narrowest band as a multiple of the joints' main motion frequency: it contains the motion and its torque.
const HEADROOM: f64 = 4.0;

/// Returns treatments of ever narrower bands, starting with `first`. `narrowed` treats a band in Hz, or the widest one.
///
/// # Errors
/// Errors of `narrowed`.
pub(crate) fn candidates(
    first: PreprocessingPlan,
    narrowed: &dyn Fn(f64) -> Result<PreprocessingPlan, PrepareError>,
) -> Result<Vec<PreprocessingPlan>, PrepareError> {
    let swing = (first.spectra.iter())
        .map(|s| s.swing())
        .fold(0.0, f64::max);
    let mut band = 0.4 * first.kept_rate() / STEP;
    let mut list = vec![first];
    while band > HEADROOM * swing {
        let next = narrowed(band)?;
        if next.decimation > list[list.len() - 1].decimation {
            list.push(next);
        }
        band /= STEP;
    }
    Ok(list)
}

/// Returns the treatment of the plan with the smallest prediction error; of equals, the widest band. `plans` are in
/// order from the widest to the narrowest band.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be read.
pub(crate) fn best(
    training: &[&dyn Recording],
    widest: &PreprocessingPlan,
    plans: &[Plan],
) -> Result<PreprocessingPlan, IdentifyError> {
    if plans.len() < 2 {
        return Ok(widest.clone());
    }
    let beginnings = beginnings(training, widest);
    let beginnings: Vec<&dyn Recording> = beginnings.iter().map(|b| b as _).collect();
    let sorted = (plans.iter())
        .map(|plan| Stretches::of(&beginnings, plan, &kept))
        .collect::<Result<Vec<_>, _>>()?;
    // The last plan has the narrowest band.
    let errors: Vec<f64> = (sorted.iter())
        .map(|own| sorted.last().map_or(f64::NAN, |judge| own.error(judge)))
        .collect();
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let best = errors.iter().position(|e| *e <= least + BETTER);
    let Some(k) = best.filter(|k| *k > 0) else {
        return Ok(widest.clone());
    };
    let mut treatment = plans[k].treatment.clone();
    treatment.decimation_reason = format!(
        "One row in {}: of {} bands, the low-pass before it up to {:.3} Hz predicts what is left out of the fit best. With one row in {} it is {:.0} % further off.",
        treatment.decimation,
        plans.len(),
        treatment.parallel_edge,
        widest.decimation,
        100.0 * (errors[0] - errors[k]).exp_m1(),
    );
    Ok(treatment)
}
