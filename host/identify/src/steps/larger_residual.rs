//! Warning about an estimator that leaves much more than the weighted fit.

use super::outcome::Outcome;
use crate::comparison::compared::Comparison;
use crate::estimators::problem::Problem;
use crate::uncertainty::residual::LEAST_ERROR;
use crate::warning::Warning;

/// Ratio of a residual to that of the weighted fit above which a warning is given.
const MUCH_MORE: f64 = 1.2;

/// Returns a warning if the requested estimator leaves much more of the training torque of a joint than the weighted
/// fit; none if it does not.
pub(crate) fn larger_residual(
    problem: &Problem,
    result: &Outcome,
    comparison: Option<&Comparison>,
) -> Option<Warning> {
    let estimator = problem.options.estimator;
    let plain = problem.start_full();
    let squares = |full: &[f64]| -> Vec<f64> {
        result
            .factors
            .iter()
            .map(|f| f.residual_squares(full).sqrt())
            .collect()
    };
    let mut more: Vec<(String, f64)> = Vec::new();
    let torque = squares(&vec![0.0; plain.len()]);
    for (k, (own, plain)) in squares(result.full).iter().zip(squares(&plain)).enumerate() {
        if *own > MUCH_MORE * plain && *own > LEAST_ERROR * torque[k] {
            let joint = problem.robot.joints.get(k).map_or("", |j| j.name.as_str());
            more.push((joint.to_owned(), own / plain));
        }
    }
    if more.is_empty() {
        return None;
    }
    let trusted = comparison.is_some_and(|compared| compared.recommended == estimator);
    Some(Warning::LargerResidual {
        estimator,
        joints: more,
        trusted,
    })
}
