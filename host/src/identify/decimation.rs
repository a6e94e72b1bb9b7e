//! How many rows are kept, judged by how well stretches that were left out are predicted.
//!
//! Noise of the position passes into the acceleration with the square of the frequency, and least squares, which takes its columns
//! for exact, then finds inertias too small (errors in variables; Söderström 2018, ch. 2). Torque and regressor pass one low-pass
//! before rows are dropped: a narrower band drops that noise and, with it, part of what a lively motion says of inertia. Which of
//! the two weighs more is for the data to say: each band is fitted without a stretch of time, and predicts that stretch in the
//! narrowest band, in which noise of the position bends the comparison least.
//!
//! Leaves out: a band for each joint; noise below the narrowest band.

use super::IdentifyError;
use super::cutoff::{Beginning, TRIAL_SECONDS};
use super::left_out::{BETTER, Stretches};
use super::model::Plan;
use crate::prepare::{PrepareError, Recording, Treatment};

/// Ratio of neighbouring bands.
const STEP: f64 = std::f64::consts::SQRT_2;
/// The narrowest band as a multiple of the frequency of the joints' swings: it holds the swing and its torque.
const HEADROOM: f64 = 4.0;

/// Treatments of narrower and narrower bands, from `first` on. `narrowed` gives that of a band in Hz, or the widest possible one.
///
/// # Errors
/// What `narrowed` gives.
pub(super) fn candidates(
    first: Treatment,
    narrowed: &dyn Fn(f64) -> Result<Treatment, PrepareError>,
) -> Result<Vec<Treatment>, PrepareError> {
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

/// Which of `plans`, from the widest band to the narrowest, predicts best what it was not fitted to; the widest one of equals.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be read.
pub(super) fn best(training: &[&dyn Recording], plans: &[Plan]) -> Result<usize, IdentifyError> {
    let Some(narrowest) = plans.last().filter(|_| plans.len() > 1) else {
        return Ok(0);
    };
    let rows = (TRIAL_SECONDS * narrowest.treatment.sample_rate) as usize / training.len().max(1);
    let beginnings: Vec<Beginning> = training
        .iter()
        .map(|&recording| Beginning { recording, rows })
        .collect();
    let beginnings: Vec<&dyn Recording> = beginnings.iter().map(|b| b as _).collect();
    let sorted = |plan: &Plan| Stretches::of(&beginnings, plan, &|_, _, _| true);
    let judge = sorted(narrowest)?;
    let mut errors = Vec::with_capacity(plans.len());
    for plan in plans {
        errors.push(sorted(plan)?.error(&judge));
    }
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    Ok(errors
        .iter()
        .position(|e| *e <= least + BETTER)
        .unwrap_or(0))
}
