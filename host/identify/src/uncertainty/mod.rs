//! Residuals of an estimate and its uncertainty.

pub(crate) mod estimate;
pub(crate) mod fit_covariance;
pub(crate) mod groups;
pub(crate) mod jackknife;
pub(crate) mod parts;
pub(crate) mod relative_error;
pub(crate) mod residual;
pub(crate) mod torque_residuals;
