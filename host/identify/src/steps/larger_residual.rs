//! Warning about an estimator that leaves much more than the weighted fit.

use super::outcome::Outcome;
use crate::comparison::compared::Comparison;
use crate::estimator::Estimator;
use crate::estimators::problem::Problem;

/// Ratio of a residual to that of the weighted fit above which a warning is given.
const MUCH_MORE: f64 = 1.2;

/// Explains a much larger residual than that of the weighted fit; `trusted` if the comparison recommends the estimator.
fn what_it_means(estimator: Estimator, trusted: bool) -> &'static str {
    match estimator {
        Estimator::Consistent => {
            "The weighted fit is free to follow what the model lacks with values that no body has, and another motion need not bear them out."
        }
        Estimator::Ridge => {
            "The weighted fit is free to follow what the model lacks with values far from the description's, and another motion need not bear them out."
        }
        _ if trusted => "Noise in the motion hides as much from the weighted fit.",
        _ => {
            "What it assumes of the noise does not hold here, so do not take its values for better ones."
        }
    }
}

/// Returns a warning if the requested estimator leaves much more of the training torque of a joint than the weighted
/// fit; none if it does not.
pub(crate) fn larger_residual(
    problem: &Problem,
    result: &Outcome,
    comparison: Option<&Comparison>,
) -> Option<String> {
    let estimator = problem.options.estimator;
    let plain = problem.start_full();
    let squares = |full: &[f64]| -> Vec<f64> {
        result
            .factors
            .iter()
            .map(|f| f.residual_squares(full).sqrt())
            .collect()
    };
    let mut more: Vec<String> = Vec::new();
    for (k, (own, plain)) in squares(result.full).iter().zip(squares(&plain)).enumerate() {
        if *own > MUCH_MORE * plain {
            let joint = problem.robot.joints.get(k).map_or("", |j| j.name.as_str());
            more.push(format!("{:.1} times at joint {joint}", own / plain));
        }
    }
    if more.is_empty() {
        return None;
    }
    let trusted = comparison.is_some_and(|compared| compared.recommended == estimator);
    Some(format!(
        "On the training data {} leaves more than the weighted fit: {}. {}",
        estimator.name(),
        more.join(", "),
        what_it_means(estimator, trusted)
    ))
}
