//! The result of an estimator.

use nalgebra::DMatrix;

use super::problem::Problem;
use crate::uncertainty::estimate::Estimate;
use crate::uncertainty::jackknife::Refit;
use crate::uncertainty::parts::Parts;
use crate::warning::Warning;

/// The result of an estimator.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    /// Values of all base columns, from all data and with one segment left out at a time.
    pub full: Refit,
    /// Values of the identified combinations, likewise.
    pub kept: Refit,
    /// Full standard parameters, if the estimator gives them.
    pub standard: Option<Vec<f64>>,
    /// Standard deviations from the estimator's own theory for white residuals.
    pub classical_std: Vec<f64>,
    /// Covariance of all base columns from the estimator's own theory, if the jackknife does not apply.
    pub covariance: Option<DMatrix<f64>>,
    /// Upper triangle of the fitted regressor, for condition numbers.
    pub regressor: DMatrix<f64>,
    /// Remarks on the fit, sentences for the report.
    pub said: Vec<String>,
    /// What the reader must know.
    pub warnings: Vec<Warning>,
    /// Reason to trust other estimates more, a clause (instruments only).
    pub doubtful: Option<String>,
}

impl Fitted {
    /// Returns the estimate with its covariance; `beside` is the contribution of terms beyond the description to the
    /// covariance of all base columns.
    pub(crate) fn estimate(
        &self,
        parts: &Parts,
        problem: &Problem,
        beside: Option<&DMatrix<f64>>,
    ) -> Estimate {
        let size = self.kept.whole.len();
        let memory = parts.memory.iter().copied().fold(1.0, f64::max);
        let (mut covariance, freedom) = match &self.covariance {
            Some(own) => {
                let rows = parts.rows as f64 / memory;
                (
                    problem.identified_covariance(own),
                    (rows as usize).saturating_sub(size).max(1),
                )
            }
            None => (self.kept.covariance(), self.kept.without.len() - 1),
        };
        if let Some(beside) = beside {
            covariance += problem.identified_covariance(beside);
        }
        Estimate::of(
            &self.kept.whole,
            &covariance,
            freedom,
            self.classical_std.clone(),
            &self.regressor,
            parts.rows,
            memory,
        )
    }
}
