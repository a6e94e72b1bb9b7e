//! Comparison of estimators and the recommended result.

pub(crate) mod compare;
pub(crate) mod compared;
pub(crate) mod endogeneity;
pub(crate) mod held;
pub(crate) mod recommend;
pub(crate) mod repeat;
