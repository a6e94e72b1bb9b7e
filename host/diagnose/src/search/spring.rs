//! Test of a spring's stiffness apart from its preload.

use crate::fit::least_squares::Fit;
use crate::levels::SIGNIFICANT;
use crate::rows::regression::{Column, combined};
use crate::search::fitted_candidate::LEAST_SIGMAS;

/// Returns true if a spring's stiffness is significant. Preload alone is a constant, with its own names.
pub(crate) fn stiff(fit: &Fit, columns: &[Column]) -> bool {
    let (Some(stiffness), Some(preload)) = (about_its_middle(fit, columns), columns.get(1..))
    else {
        return false;
    };
    let mut beside = fit.clone();
    for column in preload {
        beside.push(column);
    }
    let evidence = (beside.distinct(std::slice::from_ref(&stiffness)))
        .and_then(|own| beside.evidence(&own, &[[0.0, f64::INFINITY]]));
    evidence.is_some_and(|e| e.corrected(1) < SIGNIFICANT && e.gain_sigmas >= LEAST_SIGMAS)
}

/// Returns the stiffness column orthogonal to the preload, independent of the zero of the coordinate.
pub(crate) fn about_its_middle(fit: &Fit, columns: &[Column]) -> Option<Column> {
    let (stiffness, preload) = columns.split_first()?;
    let mut rest = stiffness.clone();
    for column in preload {
        let [along, own] = [&rest, column].map(|c| fit.product(c, column));
        let own = own.max(f64::MIN_POSITIVE);
        rest = combined(column.len(), [(&rest, 1.0), (column, -along / own)]);
    }
    Some(rest)
}
