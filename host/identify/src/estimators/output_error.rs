//! Closed-loop output error, DIDIM (Gautier, Janot & Vandanjon 2013): only the measured torque is fitted.
//!
//! The torque of the simulated closed loop is τs = X(qs, q̇s, q̈s)·β along the simulated motion. Each pass is a
//! Gauss–Newton step that neglects the dependence of the motion on β, as DIDIM does; a controller that tracks well
//! makes it small. The measured position is used only for masks and the first state. So its noise does no harm, and the
//! fit neither filters nor differentiates it.
//!
//! Limits: the Jacobian lacks the neglected part; the controller's gains are not identified.

use super::closed::{Source, nearest};
use super::fitted::Fitted;
use super::least::from_factors;
use super::linear::spread;
use super::problem::Problem;
use super::simulated::{Drift, each_simulated};
use crate::bodies::prior::Prior;
use crate::error::IdentifyError;
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::jackknife::{LeaveOut, PARTS, joined, part_of};
use crate::uncertainty::parts::Parts;
use crate::warning::{Unsettled, Warning};

/// Largest change of a parameter at convergence, as a share of its standard deviation.
const SETTLED: f64 = 0.02;
/// Largest number of passes; a warning reports it.
const MOST_PASSES: usize = 15;

/// Fits the simulated torque to the measured one.
///
/// # Errors
/// Those of [`Source::closed_loop`].
pub(crate) fn output_error(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    let (source, words) = Source::closed_loop(problem)?;
    let data = problem.data;
    let p = problem.base.len();
    let tempered = LeaveOut::of(&parts.weighted(&parts.tempered(problem.weights))).whole;
    let weights: Vec<f64> = problem.recording_weights().collect();
    let mut values = problem.start.to_vec();
    let mut passes = 0;
    loop {
        let full = spread(&values, &data.kept, p);
        let standard = nearest(problem, &tempered, prior, &full)?;
        let mut factors = vec![TriangularFactor::new(p); PARTS];
        let mut index = 0;
        let mut drift = Drift::new(problem.robot.joints.len());
        each_simulated(
            problem,
            &source,
            &standard,
            &mut |r, measured, simulated| {
                drift.push(measured, simulated);
                for i in 0..measured.t.len() {
                    let factor = &mut factors[part_of(index, problem.instants)];
                    for (k, (own, other)) in measured
                        .equations
                        .iter()
                        .zip(&simulated.equations)
                        .enumerate()
                    {
                        if own.keep[i] {
                            let weight = weights[r] * problem.weights[k];
                            factor.push(&other.x[i * p..(i + 1) * p], own.y[i], weight);
                        }
                    }
                    index += 1;
                }
            },
        )?;
        let all = LeaveOut::of(&joined(factors, parts.count));
        let mut fitted = from_factors(problem, &all)?;
        passes += 1;
        let covariance = fitted.kept.covariance();
        let moved = (0..values.len())
            .map(|k| {
                (fitted.kept.whole[k] - values[k]).abs()
                    / covariance[(k, k)].sqrt().max(f64::MIN_POSITIVE)
            })
            .fold(0.0, f64::max);
        values.clone_from(&fitted.kept.whole);
        if moved <= SETTLED || passes == MOST_PASSES {
            if moved > SETTLED {
                fitted.warnings.push(Warning::Unsettled {
                    by: Unsettled::OutputError,
                    passes: MOST_PASSES,
                    moved: Some(moved),
                });
            }
            fitted
                .said
                .push(format!("Torque of {words}; {passes} passes."));
            fitted.said.push(drift.words(problem));
            return Ok(fitted);
        }
    }
}
