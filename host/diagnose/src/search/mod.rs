//! Search for effects: fit of each candidate, stepwise selection.

pub(crate) mod fitted_candidate;
pub(crate) mod stepwise;
