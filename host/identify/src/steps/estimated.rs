//! The estimate of the requested estimator.

use nalgebra::DMatrix;

use super::own::{Own, own};
use crate::error::IdentifyError;
use crate::estimators::fit::Fit;
use crate::estimators::problem::Problem;
use crate::uncertainty::estimate::Estimate;
use crate::uncertainty::fit_covariance::covariance;

/// An estimate with its covariance.
pub(crate) struct Estimated {
    /// The fit of an estimator beyond least squares.
    pub own: Option<Own>,
    /// The estimate.
    pub estimate: Estimate,
    /// Values of all base columns.
    pub full: Vec<f64>,
}

impl Estimated {
    /// Estimates with the requested estimator. `beside` is the covariance of all base columns added by terms beyond the
    /// description.
    ///
    /// # Errors
    /// [`IdentifyError`]: reading errors; a fit that is singular, does not converge or is too short for intervals.
    pub(crate) fn of(
        problem: &Problem,
        fit: &Fit,
        beside: Option<&DMatrix<f64>>,
    ) -> Result<Self, IdentifyError> {
        let own = own(problem, beside)?;
        let (estimate, full) = match &own {
            Some(own) => (own.estimate.clone(), own.fitted.full.whole.clone()),
            // Second pass: residuals of the fitted equations, for the covariance.
            None => {
                let beside = beside.map(|full| problem.identified_covariance(full));
                let estimate = covariance(problem, fit, beside.as_ref())?;
                (estimate, fit.full())
            }
        };
        Ok(Self {
            own,
            estimate,
            full,
        })
    }
}
