//! Lists of fitted effects.

use crate::fit::least_squares::Fit;
use crate::search::fitted_candidate::FittedCandidate;

/// Returns true if both lists have the same effects.
pub(crate) fn same(a: &[FittedCandidate], b: &[FittedCandidate]) -> bool {
    a.len() == b.len()
        && a.iter()
            .all(|p| b.iter().any(|q| q.candidate == p.candidate))
}

/// Returns the fit with the columns of all effects except `but`.
pub(crate) fn with<'f>(base: &Fit<'f>, chosen: &[FittedCandidate], but: Option<usize>) -> Fit<'f> {
    let mut fit = base.clone();
    for (k, profile) in chosen.iter().enumerate() {
        if Some(k) == but {
            continue;
        }
        for column in profile.columns.iter() {
            if profile.followed.is_some() {
                fit.subtract(column);
            } else {
                fit.push(column);
            }
        }
    }
    fit
}

/// Returns the number of effects. The orders of one wave count once.
pub(crate) fn sorts(chosen: &[FittedCandidate]) -> usize {
    let sort = |p: &FittedCandidate| p.candidate.sort();
    let first = |k: &usize| !chosen[..*k].iter().any(|p| sort(p) == sort(&chosen[*k]));
    (0..chosen.len()).filter(first).count()
}
