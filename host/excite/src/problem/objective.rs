//! The objective of the optimiser: criterion and penalties, with the gradient.

use nalgebra::{DMatrix, DVector};

use super::penalty::Pass;
use super::state::Problem;
use crate::ExciteError;
use crate::optimise::{Objective, Round};

impl Problem<'_> {
    /// Returns the sum of all penalties, and adds their derivative by the motion or renews the multipliers.
    fn penalties(&mut self, pass: Pass) -> Result<f64, ExciteError> {
        let kinematic = self.kinematic(pass) + self.cranks(pass) + self.motor_motion(pass)?;
        Ok(kinematic + self.torque_and_rows(pass)? + self.cartesian(pass)?)
    }

    /// Returns the criterion and the penalties, and sets their derivative by the motion.
    fn objective(&mut self, x: &DVector<f64>) -> Result<f64, ExciteError> {
        self.place(x);
        for table in &mut self.adjoint {
            table.fill(0.0);
        }
        self.fill_rows()?;
        let criterion = self.criterion(true);
        if !criterion.is_finite() {
            return Ok(f64::INFINITY);
        }
        Ok(criterion + self.penalties(Pass::Penalise)?)
    }
}

impl Objective for Problem<'_> {
    fn value(&mut self, x: &DVector<f64>, gradient: &mut DVector<f64>) -> f64 {
        // Only wrong lengths give errors, and the lengths are the frame's own.
        let Ok(value) = self.objective(x) else {
            return f64::INFINITY;
        };
        let (n, block) = (self.joints(), self.block());
        let mut sums = DMatrix::zeros(block - 1, n);
        for order in 0..3 {
            sums.gemm(
                1.0,
                &self.basis.transposed[order],
                &self.adjoint[order],
                1.0,
            );
        }
        for j in 0..n {
            gradient[j * block] = if self.frame.fixed.is_some() {
                0.0
            } else {
                self.adjoint[0].column(j).sum() * self.unit(j, 0)
            };
            for c in 1..block {
                gradient[j * block + c] = sums[(c - 1, j)] * self.unit(j, c);
            }
        }
        value
    }

    fn update(&mut self, x: &DVector<f64>, next: &Round) {
        self.place(x);
        if self.weight > 0.0 {
            // An error leaves the multipliers unchanged; `value` then returns a value that is not finite.
            let _ = self.penalties(Pass::Renew);
        }
        self.weight = next.weight;
        self.smoothing = next.smoothing;
    }
}

#[cfg(test)]
impl Problem<'_> {
    /// Activates every constraint, so that a test of the gradient covers all of them.
    pub(crate) fn press(&mut self, multiplier: f64) {
        for list in &mut self.multipliers {
            list.fill([multiplier, 0.7 * multiplier]);
        }
        for list in &mut self.motor_multipliers {
            list.fill([multiplier, 0.7 * multiplier]);
        }
        self.plane_multipliers.fill(multiplier);
        self.crank_multipliers.fill([multiplier, 0.7 * multiplier]);
    }
}
