//! Input of every estimator beyond least squares.

use nalgebra::{DMatrix, DVector};

use super::linear::spread;
use crate::error::IdentifyError;
use crate::options::{ModelKind, Options};
use crate::rows::equation::Rows;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use crate::structure::base::Base;
use crate::structure::independent::Independent;
use rig_data::prepare::{PrepareError, Recording, Survey};
use rig_model::robot::Robot;

/// The weighted fit and its inputs.
pub(crate) struct Problem<'a> {
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
    pub(crate) fn start_full(&self) -> Vec<f64> {
        spread(self.start, &self.data.kept, self.base.len())
    }

    /// Returns the factor for the rows of each training recording.
    pub(crate) fn recording_weights(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.training.len()).map(|r| self.options.row_weight(r))
    }

    /// Visits every `step`-th instant of the training recordings: its rows of the differential model, its index in
    /// them, and the recording's weight.
    pub(crate) fn each_instant(
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

    /// Returns the covariance of the identified combinations from that of all base columns.
    pub(crate) fn identified_covariance(&self, full: &DMatrix<f64>) -> DMatrix<f64> {
        let k = &self.data.combination;
        k * full * k.transpose()
    }

    /// Returns the identified combinations for values of all base columns.
    pub(crate) fn identified(&self, full: &[f64]) -> Vec<f64> {
        (&self.data.combination * DVector::from_column_slice(full))
            .as_slice()
            .to_vec()
    }
}
