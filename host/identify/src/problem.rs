//! Input and output of every estimator beyond least squares.

use nalgebra::{DMatrix, DVector};

use super::base::{Base, Independent};
use super::covariance::Estimate;
use super::linear::spread;
use super::model::{Plan, Rows, each_rows};
use super::parts::{Parts, Refit};
use super::{IdentifyError, ModelKind, Options};
use rig_data::prepare::{PrepareError, Recording, Survey};
use rig_model::robot::Robot;

/// The weighted fit and its inputs.
pub(super) struct Problem<'a> {
    pub robot: &'a Robot,
    pub training: &'a [&'a dyn Recording],
    /// The same with all their columns.
    pub sources: &'a [&'a dyn Recording],
    pub surveys: &'a [Survey],
    pub plan: &'a Plan<'a>,
    pub options: &'a Options,
    pub base: &'a Base,
    pub data: &'a Independent,
    /// Per equation, one over the standard deviation of its residual.
    pub weights: &'a [f64],
    /// Weighted least squares: values of the identified combinations.
    pub start: &'a [f64],
    /// Number of instants over all training recordings.
    pub instants: u64,
}

impl Problem<'_> {
    /// Returns the values of the weighted fit over all base columns.
    pub(super) fn start_full(&self) -> Vec<f64> {
        spread(self.start, &self.data.kept, self.base.len())
    }

    /// Returns the factor for the rows of each training recording.
    pub(super) fn recording_weights(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.training.len()).map(|r| self.options.row_weight(r))
    }

    /// Visits every `step`-th instant of the training recordings: its rows of the differential model, its index in
    /// them, and the recording's weight.
    pub(super) fn each_instant(
        &self,
        step: u64,
        take: &mut dyn FnMut(&Rows, usize, f64) -> Result<(), PrepareError>,
    ) -> Result<(), IdentifyError> {
        let mut instant = 0;
        for (recording, weight) in self.training.iter().zip(self.recording_weights()) {
            each_rows(
                *recording,
                self.plan,
                ModelKind::Differential,
                &mut |rows| {
                    for i in 0..rows.t.len() {
                        instant += 1;
                        if instant % step == 0 {
                            take(rows, i, weight)?;
                        }
                    }
                    Ok(())
                },
            )?;
        }
        Ok(())
    }

    /// Returns weights in units of σ·√(correlation time), by which correlated rows count as fewer independent ones.
    pub(super) fn tempered(&self, parts: &Parts) -> Vec<f64> {
        self.weights
            .iter()
            .zip(&parts.memory)
            .map(|(w, m)| w / m.sqrt())
            .collect()
    }

    /// Returns the covariance of the identified combinations from that of all base columns.
    pub(super) fn identified_covariance(&self, full: &DMatrix<f64>) -> DMatrix<f64> {
        let k = &self.data.combination;
        k * full * k.transpose()
    }

    /// Returns the identified combinations for values of all base columns.
    pub(super) fn identified(&self, full: &[f64]) -> Vec<f64> {
        (&self.data.combination * DVector::from_column_slice(full))
            .as_slice()
            .to_vec()
    }
}

/// The result of an estimator.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
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
    pub warnings: Vec<String>,
    /// Reason to trust other estimates more, a clause (instruments only).
    pub doubtful: Option<String>,
}

impl Fitted {
    /// Returns the estimate with its covariance; `beside` is the contribution of terms beyond the description to the
    /// covariance of all base columns.
    pub(super) fn estimate(
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

/// Returns the error for a singular matrix.
pub(super) fn singular(what: &str) -> IdentifyError {
    IdentifyError::Singular {
        column: what.to_owned(),
    }
}
