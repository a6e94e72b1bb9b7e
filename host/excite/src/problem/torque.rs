//! Penalties of the torque, and the backward sweep from all rows to the motion.

use rig_shared::lanes::Lanes;
use rig_shared::multibody::{COLUMNS, column, inverse_dynamics, regressor_gradient};
use rig_shared::scalar::Real;
use rig_shared::transmission::MOTOR_COLUMNS;

use super::penalty::{Pass, both_sides};
use super::state::Problem;
use crate::ExciteError;
use crate::frame::Frame;
use crate::lanes::{L, LANES};
use crate::sign::{soft_sign, soft_sign_slope};

/// Prior parameters, if torque is limited.
struct Prior {
    /// Parameters of each joint without Coulomb friction.
    rows: Vec<[L; COLUMNS]>,
    /// Coulomb friction of each joint.
    coulomb: Vec<f64>,
}

impl Prior {
    /// Returns the prior parameters; none if they are unknown or no torque is limited, neither of a joint nor of a motor.
    fn of(frame: &Frame, of_motors: bool) -> Option<Self> {
        let limited = of_motors || frame.bounds.iter().any(|b| b.torque.is_some());
        let parameters = frame.parameters.as_ref().filter(|_| limited)?;
        let sliding = |row: &[f64; COLUMNS]| {
            let mut row = row.map(L::splat);
            row[column::COULOMB] = L::ZERO;
            row
        };
        Some(Self {
            rows: parameters.iter().map(sliding).collect(),
            coulomb: parameters.iter().map(|row| row[column::COULOMB]).collect(),
        })
    }
}

/// Samples that are computed side by side.
struct Group {
    /// The first of them.
    first: usize,
    /// Position, velocity and acceleration of each joint.
    state: [Vec<L>; 3],
}

impl Problem<'_> {
    /// Returns the penalties of the torque, and adds the derivatives of penalties and criterion by the motion.
    pub(super) fn torque_and_rows(&mut self, pass: Pass) -> Result<f64, ExciteError> {
        let prior = Prior::of(self.frame, self.limits_motor_torque());
        let mut sum = 0.0;
        for first in (0..self.basis.samples()).step_by(LANES) {
            let within = first < self.basis.whole && pass == Pass::Penalise;
            if !within && prior.is_none() {
                break;
            }
            let group = Group {
                first,
                state: [0, 1, 2].map(|order| self.state(order, first)),
            };
            let pushed = match &prior {
                Some(prior) => self
                    .torque_penalties(prior, &group, pass, &mut sum)?
                    .map(|forces| (prior, forces)),
                None => None,
            };
            if let (Some(wrist), true) = (&self.frame.wrist, within) {
                self.sweep_wrench_back(wrist, first, &group.state)?;
            }
            let within = within && self.frame.wrist.is_none();
            if !within && pushed.is_none() {
                continue;
            }
            self.weigh_entries(&group, within, pushed.as_ref());
            self.sweep_back(&group)?;
        }
        Ok(sum)
    }

    /// Adds the torque penalties of a group to `sum`. Returns their derivative by the torque of each joint; none if it
    /// is zero.
    fn torque_penalties(
        &mut self,
        prior: &Prior,
        group: &Group,
        pass: Pass,
        sum: &mut f64,
    ) -> Result<Option<Vec<L>>, ExciteError> {
        let (n, frame, samples) = (self.joints(), self.frame, self.basis.samples());
        let [q, qd, qdd] = &group.state;
        let mut forces = vec![L::ZERO; n];
        let mut pushed = false;
        let mut tau = vec![L::ZERO; n];
        inverse_dynamics(&frame.lanes, &prior.rows, q, qd, qdd, &mut tau)?;
        if let Some(drives) = &frame.drives {
            drives.columns([q, qd, qdd], &mut self.motors)?;
            let width = n * MOTOR_COLUMNS;
            for (t, row) in tau.iter_mut().zip(self.motors.chunks_exact(width)) {
                for (column, value) in row.iter().zip(&drives.parameters) {
                    *t += *column * L::splat(*value);
                }
            }
        }
        for j in 0..n {
            let sign = soft_sign(qd[j], frame.bounds[j].velocity);
            tau[j] += L::splat(prior.coulomb[j]) * sign;
            let Some(limit) = frame.bounds[j].torque else {
                continue;
            };
            for k in 0..LANES {
                let multipliers = &mut self.multipliers[3][j * samples + group.first + k];
                let share = tau[j].0[k] / limit;
                let (value, force) = both_sides(share, multipliers, self.weight, pass);
                *sum += value;
                forces[j].0[k] = force / limit;
                pushed |= force != 0.0;
            }
        }
        if self.limits_motor_torque() {
            pushed |= self.motor_torques(group.first, &tau, pass, sum, &mut forces)?;
        }
        Ok(pushed.then_some(forces))
    }

    /// Sets the weights on the entries of the regressor, of the criterion and of the torque penalties, and adds the
    /// derivative through the sign of the velocity.
    fn weigh_entries(&mut self, group: &Group, within: bool, pushed: Option<&(&Prior, Vec<L>)>) {
        self.out.fill(L::ZERO);
        self.motors.fill(L::ZERO);
        for j in 0..self.joints() {
            let mut coulomb = L::ZERO;
            if within {
                coulomb = self.weigh_criterion(j, group.first);
            }
            if let Some((prior, forces)) = pushed {
                self.weigh_torque(j, forces[j], prior);
                coulomb += forces[j] * L::splat(prior.coulomb[j]);
            }
            let slope = coulomb * soft_sign_slope(group.state[1][j], self.frame.bounds[j].velocity);
            for k in 0..LANES {
                self.adjoint[1][(group.first + k, j)] += slope.0[k];
            }
        }
    }

    /// Sets the weights of the criterion on the row of joint `j`. Returns the weight on its Coulomb entry.
    fn weigh_criterion(&mut self, j: usize, s: usize) -> L {
        let (n, frame, first) = (self.joints(), self.frame, self.first[j]);
        let width = frame.plain.parameter_count();
        let mut coulomb = L::ZERO;
        for (c, source) in frame.columns.iter().enumerate().skip(first) {
            let factor = frame.weights[j] / frame.sizes[c];
            let pull = Lanes(core::array::from_fn(|k| {
                factor * self.pulls[j][(c - first, s + k)]
            }));
            if let Some(motor) = source.checked_sub(width) {
                self.motors[j * n * MOTOR_COLUMNS + motor] = pull;
            } else if *source == j * COLUMNS + column::COULOMB {
                coulomb += pull;
            } else {
                self.out[j * width + source] = pull;
            }
        }
        coulomb
    }

    /// Adds the weights of a torque penalty to the row of joint `j`, except that on its Coulomb entry.
    fn weigh_torque(&mut self, j: usize, force: L, prior: &Prior) {
        let n = self.joints();
        let width = self.frame.plain.parameter_count();
        // Links before the joint do not load it, unless its drive moves axes before it too.
        let first = if self.frame.plain.has_followers() {
            0
        } else {
            j
        };
        for (i, row) in prior.rows.iter().enumerate().skip(first) {
            let start = j * width + i * COLUMNS;
            let weights = &mut self.out[start..start + COLUMNS];
            for (weight, parameter) in weights.iter_mut().zip(row) {
                *weight += force * *parameter;
            }
        }
        if let Some(drives) = &self.frame.drives {
            let width = n * MOTOR_COLUMNS;
            let weights = &mut self.motors[j * width..(j + 1) * width];
            for (weight, value) in weights.iter_mut().zip(&drives.parameters) {
                *weight += force * L::splat(*value);
            }
        }
    }

    /// Adds the derivatives of the weighted entries by the motion.
    fn sweep_back(&mut self, group: &Group) -> Result<(), ExciteError> {
        let (n, frame) = (self.joints(), self.frame);
        let [q, qd, qdd] = &group.state;
        let mut by = [(); 3].map(|()| vec![L::ZERO; n]);
        let [by_q, by_qd, by_qdd] = &mut by;
        regressor_gradient(&frame.lanes, q, qd, qdd, &self.out, by_q, by_qd, by_qdd)?;
        if let Some(drives) = &frame.drives {
            drives.add_gradient([q, qd, qdd], &self.motors, &mut by)?;
        }
        self.add_derivatives(group.first, &by);
        Ok(())
    }
}
