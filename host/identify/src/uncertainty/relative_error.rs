//! Residuals on accumulated rows, relative to the torque.

use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;
use crate::rows::planned::Planned;

/// Returns, per joint, the RMS residual of `full` on the rows of `factors` over the RMS torque. Uses the torque `whole`
/// if the rows do not contain all of the torque.
pub(crate) fn relative_errors(
    factors: &[TriangularFactor],
    full: &[f64],
    whole: Option<&[f64]>,
) -> Vec<f64> {
    let one = |(j, factor): (usize, &TriangularFactor)| {
        if factor.rows() == 0 {
            return f64::NAN;
        }
        let rows = factor.rows() as f64;
        let torque = whole.map_or_else(
            || (factor.right_side_squares() / rows).sqrt(),
            |torque| torque[j],
        );
        (factor.residual_squares(full) / rows).sqrt() / torque.max(f64::MIN_POSITIVE)
    };
    factors.iter().enumerate().map(one).collect()
}

/// Returns one factor per joint of the hold-out, torque against motion; none for an empty hold-out.
pub(crate) fn judge(
    problem: &Problem,
    holdout: &[Planned],
) -> Result<Option<Vec<TriangularFactor>>, IdentifyError> {
    if holdout.is_empty() {
        return Ok(None);
    }
    let p = problem.base.len();
    let mut factors = vec![TriangularFactor::new(p); problem.robot.joints.len()];
    for recording in holdout {
        recording.each_rows(&mut |rows| {
            for (factor, equation) in factors.iter_mut().zip(&rows.equations) {
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], 1.0);
                }
            }
            Ok(())
        })?;
    }
    Ok(Some(factors))
}

/// Returns the geometric mean of the relative errors over the joints that have one, so that all joints count equally.
pub(crate) fn geometric_mean(errors: &[f64]) -> f64 {
    let judged = errors.iter().filter(|e| !e.is_nan());
    let (sum, count) = judged.fold((0.0, 0usize), |(sum, count), e| {
        (sum + e.max(f64::MIN_POSITIVE).ln(), count + 1)
    });
    (sum / count.max(1) as f64).exp()
}
