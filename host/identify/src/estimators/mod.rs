//! The estimators and their common parts.

pub(crate) mod closed;
pub(crate) mod consistent_fit;
pub(crate) mod fit;
pub(crate) mod fitted;
pub(crate) mod instrumental;
pub(crate) mod least;
pub(crate) mod likelihood;
pub(crate) mod linear;
pub(crate) mod output_error;
pub(crate) mod problem;
pub(crate) mod ridge;
pub(crate) mod robust;
pub(crate) mod run;
pub(crate) mod simulated;
pub(crate) mod total;
pub(crate) mod twin;
