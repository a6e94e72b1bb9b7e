//! Least squares over nominal parameters and effects, with covariance.

pub(crate) mod collinear;
pub(crate) mod least_squares;
pub(crate) mod refit;
pub(crate) mod simplex;
pub(crate) mod solution;
pub(crate) mod systematic_uncertainty;
