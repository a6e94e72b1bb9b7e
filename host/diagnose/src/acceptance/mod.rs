//! Tests that an effect must pass, and what stays unexplained.

pub(crate) mod coordinates;
pub(crate) mod credibility;
pub(crate) mod judge;
pub(crate) mod lack_of_fit;
pub(crate) mod law_mismatch;
pub(crate) mod model_check;
pub(crate) mod plausibility;
pub(crate) mod residual_dependence;
pub(crate) mod trial;
pub(crate) mod unexplained;
