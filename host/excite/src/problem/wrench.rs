//! Rows of a wrist sensor, and the backward sweep from them to the motion.

use rig_shared::lanes::Lanes;
use rig_shared::multibody::INERTIAL_PARAMETERS;
use rig_shared::scalar::Real;

use super::state::Problem;
use crate::ExciteError;
use crate::lanes::{L, LANES};
use crate::wrist_chain::{AXES, WristChain};

impl Problem<'_> {
    /// Computes the scaled rows of the sensor over the whole period, without their means: the biases are unknown.
    pub(super) fn fill_wrench_rows(&mut self, wrist: &WristChain) -> Result<(), ExciteError> {
        let frame = self.frame;
        for s in (0..self.basis.whole).step_by(LANES) {
            let [q, qd, qdd] = [0, 1, 2].map(|order| self.state(order, s));
            let entries = wrist.lane_rows([&q, &qd, &qdd])?;
            for (axis, own) in entries.chunks_exact(INERTIAL_PARAMETERS).enumerate() {
                for (c, source) in frame.columns.iter().enumerate() {
                    let factor = frame.weights[axis] / frame.sizes[c];
                    for k in 0..LANES {
                        self.rows[axis][(c, s + k)] = factor * own[*source].0[k];
                    }
                }
            }
        }
        for rows in &mut self.rows {
            for mut row in rows.row_iter_mut() {
                let mean = row.mean();
                row.add_scalar_mut(-mean);
            }
        }
        Ok(())
    }

    /// Adds the derivatives of the criterion by the motion at the samples from `first` on, whose `state` is given. The
    /// derivatives by rows without means are those by the rows themselves: they have no mean either.
    pub(super) fn sweep_wrench_back(
        &mut self,
        wrist: &WristChain,
        first: usize,
        state: &[Vec<L>; 3],
    ) -> Result<(), ExciteError> {
        let frame = self.frame;
        let mut weights = [L::ZERO; AXES * INERTIAL_PARAMETERS];
        for (axis, own) in weights.chunks_exact_mut(INERTIAL_PARAMETERS).enumerate() {
            for (c, source) in frame.columns.iter().enumerate() {
                let factor = frame.weights[axis] / frame.sizes[c];
                own[*source] = Lanes(core::array::from_fn(|k| {
                    factor * self.pulls[axis][(c, first + k)]
                }));
            }
        }
        let [q, qd, qdd] = state;
        let by = wrist.gradient([q, qd, qdd], &weights)?;
        self.add_derivatives(first, &by);
        Ok(())
    }
}
