//! Search for effects: fit of each candidate, stepwise selection.

pub(crate) mod chosen;
pub(crate) mod fitted_candidate;
pub(crate) mod refusal;
pub(crate) mod shape_bounds;
pub(crate) mod shape_fit;
pub(crate) mod shapes;
pub(crate) mod spring;
pub(crate) mod stepwise;
pub(crate) mod tried_candidate;
