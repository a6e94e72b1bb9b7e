//! Residuals of an estimate and its uncertainty.

pub(crate) mod covariance;
pub(crate) mod fit_covariance;
pub(crate) mod jackknife;
pub(crate) mod parts;
pub(crate) mod relative_error;
pub(crate) mod residual;
pub(crate) mod torque_residuals;
