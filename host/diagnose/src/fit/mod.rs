//! Least squares over nominal parameters and effects, with covariance.

pub(crate) mod collinear;
pub(crate) mod evidence;
pub(crate) mod folded;
pub(crate) mod least_squares;
pub(crate) mod open_parameters;
pub(crate) mod refit;
pub(crate) mod solution;
pub(crate) mod systematic_uncertainty;
