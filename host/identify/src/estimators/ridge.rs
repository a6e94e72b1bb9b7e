//! Ridge regression towards the description: Bayesian estimate with the CAD values as prior
//! ([`crate::bodies::evidence`]).
//!
//! The relative uncertainty of the described inertial values is given, equal for all, or maximises the evidence. The
//! evidence makes it large if the data contradict the description. Correlated rows count as fewer independent ones, so
//! that repetition does not outweigh the prior. Intervals are those of the posterior.
//!
//! Limits: no physical consistency (use `consistent`).

use nalgebra::DVector;

use super::fitted::Fitted;
use super::linear::triangle;
use super::problem::Problem;
use crate::bodies::evidence::{Belief, CANDIDATES, Seen};
use crate::bodies::prior::Prior;
use crate::error::IdentifyError;
use crate::rows::factor::TriangularFactor;
use crate::uncertainty::jackknife::{LeaveOut, Refit};
use crate::uncertainty::parts::Parts;
use crate::warning::Warning;

/// Number of candidates of the relative uncertainty, evenly spaced in the logarithm.
const STEPS: usize = 17;

/// Fits by ridge regression.
pub(crate) fn ridge(
    problem: &Problem,
    parts: &Parts,
    prior: &Prior,
) -> Result<Fitted, IdentifyError> {
    let all = LeaveOut::of(&parts.weighted(&parts.tempered(problem.weights)));
    let belief = Belief::of(prior, &problem.base.combination);
    let data = Seen::of(&all.whole);
    let (deviation, s, why) = match problem.options.prior_uncertainty {
        Some(s) => (belief.even(s), s, "as given, the same for all"),
        None => {
            let likely = belief.most_likely(&data, STEPS)?;
            let why = if likely.s >= 0.99 * CANDIDATES[1] {
                "the largest tried: the data want nothing of it"
            } else {
                "what makes the data most likely; single values may be farther off"
            };
            (likely.deviation, likely.s, why)
        }
    };
    let fit = |factor: &TriangularFactor| {
        let found = belief.posterior(&Seen::of(factor), &deviation)?;
        Ok(found.standard.as_slice().to_vec())
    };
    let standard: Refit = all.refit(&fit)?;
    let found = belief.posterior(&data, &deviation)?;
    let combination = &belief.combination;
    let full = standard.map(&|pi| {
        (combination * DVector::from_column_slice(pi))
            .as_slice()
            .to_vec()
    });
    let kept = full.map(&|values| problem.identified(values));
    let covariance = found.base();
    let identified = problem.identified_covariance(&covariance);
    let mut warnings = Vec::new();
    if !prior.stated {
        warnings.push(Warning::StandIns);
    }
    Ok(Fitted {
        classical_std: (0..kept.whole.len())
            .map(|c| identified[(c, c)].max(0.0).sqrt())
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
        doubtful: None,
    })
}
