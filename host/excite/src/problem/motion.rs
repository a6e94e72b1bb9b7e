//! The variables of the optimiser as a motion, and back.

use nalgebra::{DMatrix, DVector};

use super::state::Problem;
use crate::schedule::JointMotion;

impl Problem<'_> {
    /// Returns the motion of the variables.
    pub(crate) fn decode(&self, x: &DVector<f64>) -> Vec<JointMotion> {
        let block = self.block();
        (0..self.joints())
            .map(|j| {
                let base = match &self.frame.fixed {
                    Some(fixed) => fixed[j],
                    None => self.frame.bounds[j].middle() + self.unit(j, 0) * x[j * block],
                };
                let coefficients = (1..block)
                    .map(|c| self.unit(j, c) * x[j * block + c])
                    .collect();
                JointMotion { base, coefficients }
            })
            .collect()
    }

    /// Converts a motion to variables; also used to scale a start to its limits.
    pub(crate) fn encode(&self, motions: &[JointMotion]) -> DVector<f64> {
        let block = self.block();
        let mut x = DVector::zeros(self.size());
        for (j, motion) in motions.iter().enumerate() {
            let middle = self.frame.bounds[j].middle();
            x[j * block] = (motion.base - middle) / self.unit(j, 0);
            for (c, value) in motion.coefficients.iter().enumerate() {
                x[j * block + 1 + c] = value / self.unit(j, c + 1);
            }
        }
        x
    }

    /// Sets the motion at the samples.
    pub(super) fn place(&mut self, x: &DVector<f64>) {
        let motions = self.decode(x);
        let width = self.block() - 1;
        let coefficients =
            DMatrix::from_fn(width, motions.len(), |c, j| motions[j].coefficients[c]);
        for order in 0..3 {
            self.motion[order].gemm(1.0, &self.basis.tables[order], &coefficients, 0.0);
        }
        for (j, motion) in motions.iter().enumerate() {
            self.motion[0].column_mut(j).add_scalar_mut(motion.base);
        }
    }

    /// Returns the factor that scales a motion about its start so that position, velocity and acceleration fit.
    fn room(&mut self, x: &DVector<f64>) -> f64 {
        self.place(x);
        let mut room = f64::INFINITY;
        let motions = self.decode(x);
        for limit in &self.frame.combined {
            let start = limit.at(motions.iter().map(|m| m.base));
            for s in 0..self.basis.samples() {
                let away = limit.at((0..motions.len()).map(|j| self.motion[0][(s, j)])) - start;
                if away != 0.0 {
                    let edge = if away > 0.0 { limit.high } else { limit.low };
                    room = room.min((edge - start) / away);
                }
            }
        }
        for (j, motion) in motions.iter().enumerate() {
            let bounds = &self.frame.bounds[j];
            let (up, down) = (bounds.high - motion.base, bounds.low - motion.base);
            for s in 0..self.basis.samples() {
                let away = self.motion[0][(s, j)] - motion.base;
                // At its start and end the deviation is zero.
                if away != 0.0 {
                    room = room.min(if away > 0.0 { up / away } else { down / away });
                }
                room = room.min(bounds.velocity / self.motion[1][(s, j)].abs());
                if let Some(limit) = bounds.acceleration {
                    room = room.min(limit / self.motion[2][(s, j)].abs());
                }
            }
        }
        room
    }

    /// Scales the motion about its start to `share` of the limits of position, velocity and acceleration; a share of
    /// one only reduces a motion that exceeds them.
    pub(crate) fn shrunk(&mut self, x: &DVector<f64>, share: f64) -> DVector<f64> {
        let factor = share * self.room(x);
        let factor = if share < 1.0 { factor } else { factor.min(1.0) };
        let mut motions = self.decode(x);
        for motion in &mut motions {
            for c in &mut motion.coefficients {
                *c *= factor;
            }
        }
        self.encode(&motions)
    }
}
