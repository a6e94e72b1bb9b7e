//! Ridge regression towards the description: Bayes' estimate with the CAD values as prior.
//!
//! π ~ N(π₀, diag(s·scale)²), data of unit noise: π̂ = π₀ + P·KᵀRᵀ·(R·K·P·KᵀRᵀ + 1)⁻¹·(z − R·K·π₀). The relative
//! uncertainty s of the description's inertial values is given, or the one that makes the data most likely (evidence;
//! MacKay 1992): large where the data contradict the description. Rows count as what they are worth when the residual
//! remembers its past, so the prior is not outvoted by repetition. Intervals are those of the posterior.
//!
//! Leaves out: uncertainty of s itself; that inertial values are those of a body (`consistent` does that).

use nalgebra::{DMatrix, DVector};

use super::IdentifyError;
use super::factor::TriangularFactor;
use super::least::triangle;
use super::parts::{LeaveOut, Parts, Refit};
use super::prior::{Prior, Rule};
use super::problem::{Fitted, Problem, singular};

/// Candidates of s, from 0.1 % to 1000 %.
const CANDIDATES: [f64; 2] = [1e-3, 10.0];
/// How many of them, evenly spaced in the logarithm.
const STEPS: usize = 81;
/// Relative uncertainty of what the description does not state: no opinion.
const BROAD: f64 = 100.0;

/// Prior standard deviations for a relative uncertainty `s` of stated values.
fn deviations(prior: &Prior, s: f64) -> DVector<f64> {
    DVector::from_fn(prior.centre.len(), |c, _| {
        let relative = match prior.rules[c] {
            Rule::Inertial(_) => s,
            _ if prior.uncertainty[c].is_finite() => s,
            _ => BROAD,
        };
        relative * prior.scale[c]
    })
}

struct Posterior {
    standard: DVector<f64>,
    /// Covariance of the base columns' values.
    base: DMatrix<f64>,
}

/// Logarithm of the evidence but for a constant, and the posterior.
fn posterior(
    factor: &TriangularFactor,
    combination: &DMatrix<f64>,
    prior: &Prior,
    s: f64,
) -> Result<(f64, Posterior), IdentifyError> {
    let (r, z) = factor.system();
    let deviation = deviations(prior, s);
    let centre = DVector::from_column_slice(&prior.centre);
    let mut spread = combination.clone();
    for (c, mut column) in spread.column_iter_mut().enumerate() {
        column *= deviation[c];
    }
    let seen = &r * &spread;
    // In the basis of its singular vectors the data's covariance is diagonal: nothing is squared.
    let svd = seen.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Err(singular("of the ridge problem"));
    };
    let surprise = u.transpose() * (z - &r * (combination * &centre));
    let gains = &svd.singular_values;
    let evidence = -0.5
        * gains
            .iter()
            .zip(surprise.iter())
            .map(|(d, e)| (1.0 + d * d).ln() + e * e / (1.0 + d * d))
            .sum::<f64>();
    let step = DVector::from_fn(gains.len(), |k, _| {
        gains[k] / (1.0 + gains[k] * gains[k]) * surprise[k]
    });
    let standard = &centre + (v_t.transpose() * step).component_mul(&deviation);
    // What the data see of K·P·Kᵀ shrinks by 1/(1 + d²), the rest stays; no difference of large numbers is taken.
    let along = &spread * v_t.transpose();
    let rest = &spread - &along * &v_t;
    let mut base = &rest * rest.transpose();
    for k in 0..gains.len() {
        let column = along.column(k).into_owned();
        base.ger(1.0 / (1.0 + gains[k] * gains[k]), &column, &column, 1.0);
    }
    Ok((evidence, Posterior { standard, base }))
}

/// Fits by ridge regression.
pub(super) fn ridge(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    let all = LeaveOut::of(&parts.weighted(&problem.tempered(parts)));
    let combination = &prior.own(&problem.base.combination);
    let (s, why) = match problem.options.prior_uncertainty {
        Some(s) => (s, "as given".to_owned()),
        None => {
            let mut best = (f64::NEG_INFINITY, 1.0);
            for k in 0..STEPS {
                let share = k as f64 / (STEPS - 1) as f64;
                let s = CANDIDATES[0] * (CANDIDATES[1] / CANDIDATES[0]).powf(share);
                let (evidence, _) = posterior(&all.whole, combination, prior, s)?;
                if evidence > best.0 {
                    best = (evidence, s);
                }
            }
            let why = if best.1 >= 0.99 * CANDIDATES[1] {
                "the largest tried: the data want nothing of it"
            } else {
                "what makes the data most likely"
            };
            (best.1, why.to_owned())
        }
    };
    let fit = |factor: &TriangularFactor| {
        Ok(posterior(factor, combination, prior, s)?
            .1
            .standard
            .as_slice()
            .to_vec())
    };
    let standard: Refit = all.refit(&fit)?;
    let (_, found) = posterior(&all.whole, combination, prior, s)?;
    let full = standard.map(&|pi| {
        (combination * DVector::from_column_slice(pi))
            .as_slice()
            .to_vec()
    });
    let kept = full.map(&|values| problem.identified(values));
    let k = &problem.data.combination;
    let covariance = k * &found.base * k.transpose();
    let mut warnings = Vec::new();
    if !prior.stated {
        warnings.push("The prior rests on stand-ins for what the description does not state; values that the data do not determine are guesses.".to_owned());
    }
    Ok(Fitted {
        classical_std: (0..kept.whole.len())
            .map(|c| covariance[(c, c)].max(0.0).sqrt())
            .collect(),
        standard: Some(prior.standard(&DVector::from_column_slice(&standard.whole))),
        full,
        kept,
        covariance: Some(covariance),
        regressor: triangle(&all.whole, problem.data),
        said: vec![format!(
            "Relative uncertainty of the description's inertial values: {:.3} %, {why}. Intervals are those of the posterior.",
            100.0 * s
        )],
        warnings,
        doubtful: false,
    })
}
