//! Rows of the regressor, and the criterion that they give.

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{COLUMNS, column, differential_regressor};
use rig_shared::transmission::MOTOR_COLUMNS;

use super::state::Problem;
use crate::ExciteError;
use crate::criterion::criterion_of;
use crate::lanes::LANES;
use crate::sign::soft_sign;

impl Problem<'_> {
    /// Returns the criterion alone, at `x`; not finite if undefined.
    pub(crate) fn judge(&mut self, x: &DVector<f64>) -> f64 {
        self.place(x);
        match self.fill_rows() {
            Ok(()) => self.criterion(false),
            Err(_) => f64::INFINITY,
        }
    }

    /// Computes the regressor rows of the whole period.
    pub(super) fn fill_rows(&mut self) -> Result<(), ExciteError> {
        match &self.frame.wrist {
            Some(wrist) => self.fill_wrench_rows(wrist),
            None => self.fill_torque_rows(),
        }
    }

    fn fill_torque_rows(&mut self) -> Result<(), ExciteError> {
        let n = self.joints();
        let frame = self.frame;
        let width = frame.plain.parameter_count();
        for s in (0..self.basis.whole).step_by(LANES) {
            let [q, qd, qdd] = [0, 1, 2].map(|order| self.state(order, s));
            differential_regressor(&frame.lanes, &q, &qd, &qdd, &mut self.out)?;
            if let Some(drives) = &frame.drives {
                drives.columns([&q, &qd, &qdd], &mut self.motors)?;
            }
            for j in 0..n {
                self.out[j * width + j * COLUMNS + column::COULOMB] =
                    soft_sign(qd[j], frame.bounds[j].velocity);
                let first = self.first[j];
                for (c, source) in frame.columns.iter().enumerate().skip(first) {
                    let factor = frame.weights[j] / frame.sizes[c];
                    let entry = match source.checked_sub(width) {
                        Some(motor) => self.motors[j * n * MOTOR_COLUMNS + motor].0,
                        None => self.out[j * width + source].0,
                    };
                    for k in 0..LANES {
                        self.rows[j][(c - first, s + k)] = factor * entry[k];
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the criterion of the rows; with `pull` also computes its derivative by them.
    pub(super) fn criterion(&mut self, pull: bool) -> f64 {
        let p = self.frame.columns.len();
        let samples = self.basis.whole as f64;
        let mut information = DMatrix::zeros(p, p);
        for (rows, &first) in self.rows.iter().zip(&self.first) {
            let size = p - first;
            // Transposed explicitly, so that the product uses the fast kernel.
            let transposed = rows.transpose();
            information.view_mut((first, first), (size, size)).gemm(
                1.0 / samples,
                rows,
                &transposed,
                1.0,
            );
        }
        let (value, slope) = criterion_of(&information, self.frame.criterion, self.smoothing);
        if pull && value.is_finite() {
            // d tr(G·YᵀY)/S = 2/S·⟨Y·G, dY⟩
            for j in 0..self.rows.len() {
                let (first, size) = (self.first[j], p - self.first[j]);
                let block = slope.view((first, first), (size, size)).into_owned();
                self.pulls[j].gemm(2.0 / samples, &block, &self.rows[j], 0.0);
            }
        }
        value
    }
}
