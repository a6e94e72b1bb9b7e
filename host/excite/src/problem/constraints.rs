//! Limits as penalties, and the derivatives by the motion.

use rig_shared::lanes::Lanes;
use rig_shared::multibody::{
    COLUMNS, column, inverse_dynamics, point_position, regressor_gradient,
};
use rig_shared::scalar::Real;
use rig_shared::transmission::MOTOR_COLUMNS;

use super::state::Problem;
use crate::ExciteError;
use crate::lanes::{L, LANES};
use crate::sign::{soft_sign, soft_sign_slope};

/// Share of each limit that the optimiser keeps free for peaks between its samples. With 48 samples per period of the
/// fastest harmonic, such a peak adds at most (π/48)²/2 = 0.2 % of that harmonic's amplitude.
const MARGIN: f64 = 0.003;
/// Purpose of a pass over the constraints.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Pass {
    /// Adds penalties and their derivatives.
    Penalise,
    /// Updates the multipliers.
    Renew,
}

/// Returns the penalty of one constraint c ≤ 0 with its multiplier, and its derivative by c.
fn penalty(c: f64, multiplier: &mut f64, weight: f64, pass: Pass) -> (f64, f64) {
    if pass == Pass::Renew {
        *multiplier = (*multiplier + weight * c).max(0.0);
        return (0.0, 0.0);
    }
    let idle = -0.5 * *multiplier * *multiplier / weight;
    let active = c + *multiplier / weight;
    if active > 0.0 {
        (idle + 0.5 * weight * active * active, weight * active)
    } else {
        (idle, 0.0)
    }
}

/// Penalises both sides of |away| ≤ limit·keep.
fn both_sides(share: f64, multipliers: &mut [f64; 2], weight: f64, pass: Pass) -> (f64, f64) {
    let keep = 1.0 - MARGIN;
    let [above, below] = multipliers;
    let (up, force_up) = penalty(share - keep, above, weight, pass);
    let (down, force_down) = penalty(-share - keep, below, weight, pass);
    (up + down, force_up - force_down)
}

impl Problem<'_> {
    /// Returns the penalties of position, velocity and acceleration.
    fn kinematic(&mut self, pass: Pass) -> f64 {
        let mut sum = 0.0;
        let samples = self.basis.samples();
        for order in 0..3 {
            for (j, bounds) in self.frame.bounds.iter().enumerate() {
                let (middle, limit) = match order {
                    0 => (bounds.middle(), bounds.half()),
                    1 => (0.0, bounds.velocity),
                    _ => match bounds.acceleration {
                        Some(limit) => (0.0, limit),
                        None => continue,
                    },
                };
                let multipliers = &mut self.multipliers[order][j * samples..(j + 1) * samples];
                let motion = self.motion[order].column(j);
                let mut adjoint = self.adjoint[order].column_mut(j);
                for s in 0..samples {
                    let share = (motion[s] - middle) / limit;
                    let (value, force) = both_sides(share, &mut multipliers[s], self.weight, pass);
                    sum += value;
                    adjoint[s] += force / limit;
                }
            }
        }
        sum
    }

    /// Returns the penalties of the cranks' ranges.
    fn cranks(&mut self, pass: Pass) -> f64 {
        let (n, samples) = (self.joints(), self.basis.samples());
        let mut sum = 0.0;
        for (number, limit) in self.frame.combined.iter().enumerate() {
            for s in 0..samples {
                let angle = limit.at((0..n).map(|j| self.motion[0][(s, j)]));
                let share = (angle - limit.middle()) / limit.half();
                let multipliers = &mut self.crank_multipliers[number * samples + s];
                let (value, force) = both_sides(share, multipliers, self.weight, pass);
                sum += value;
                for (j, weight) in limit.weights.iter().enumerate() {
                    self.adjoint[0][(s, j)] += force * weight / limit.half();
                }
            }
        }
        sum
    }

    /// Returns the penalties of the torque, and adds the derivatives of penalties and criterion by the motion.
    fn torque_and_rows(&mut self, pass: Pass) -> Result<f64, ExciteError> {
        let (n, frame, samples) = (self.joints(), self.frame, self.basis.samples());
        let width = n * COLUMNS;
        let limited = frame.bounds.iter().any(|b| b.torque.is_some());
        let prior: Option<Vec<[L; COLUMNS]>> = match &frame.parameters {
            Some(rows) if limited => Some(
                rows.iter()
                    .map(|row| {
                        let mut row = row.map(L::splat);
                        row[column::COULOMB] = L::ZERO;
                        row
                    })
                    .collect(),
            ),
            _ => None,
        };
        let mut sum = 0.0;
        let mut tau = vec![L::ZERO; n];
        let mut by = [(); 3].map(|()| vec![L::ZERO; n]);
        let motor_width = n * MOTOR_COLUMNS;
        for s in (0..samples).step_by(LANES) {
            let within = s < self.basis.whole && pass == Pass::Penalise;
            if !within && prior.is_none() {
                break;
            }
            let [q, qd, qdd] = [0, 1, 2].map(|order| self.state(order, s));
            let mut forces = vec![L::ZERO; n];
            let mut pushed = false;
            if let (Some(prior), Some(parameters)) = (&prior, &frame.parameters) {
                inverse_dynamics(&frame.lanes, prior, &q, &qd, &qdd, &mut tau)?;
                if let Some(drives) = &frame.drives {
                    drives.columns([&q, &qd, &qdd], &mut self.motors)?;
                    for (t, row) in tau.iter_mut().zip(self.motors.chunks_exact(motor_width)) {
                        for (column, value) in row.iter().zip(&drives.parameters) {
                            *t += *column * L::splat(*value);
                        }
                    }
                }
                for j in 0..n {
                    let Some(limit) = frame.bounds[j].torque else {
                        continue;
                    };
                    let coulomb = parameters[j][column::COULOMB];
                    let total =
                        tau[j] + L::splat(coulomb) * soft_sign(qd[j], frame.bounds[j].velocity);
                    for k in 0..LANES {
                        let multipliers = &mut self.multipliers[3][j * samples + s + k];
                        let (value, force) =
                            both_sides(total.0[k] / limit, multipliers, self.weight, pass);
                        sum += value;
                        forces[j].0[k] = force / limit;
                        pushed |= force != 0.0;
                    }
                }
            }
            if !within && !pushed {
                continue;
            }
            // Weights on the entries of the regressor.
            self.out.fill(L::ZERO);
            self.motors.fill(L::ZERO);
            for j in 0..n {
                let velocity = frame.bounds[j].velocity;
                let mut coulomb = L::ZERO;
                if within {
                    let first = self.first[j];
                    for (c, source) in frame.columns.iter().enumerate().skip(first) {
                        let factor = frame.weights[j] / frame.sizes[c];
                        let pull = Lanes(core::array::from_fn(|k| {
                            factor * self.pulls[j][(c - first, s + k)]
                        }));
                        if let Some(motor) = source.checked_sub(width) {
                            self.motors[j * motor_width + motor] = pull;
                        } else if *source == j * COLUMNS + column::COULOMB {
                            coulomb += pull;
                        } else {
                            self.out[j * width + source] = pull;
                        }
                    }
                }
                if let (true, Some(prior), Some(parameters)) = (pushed, &prior, &frame.parameters) {
                    for (i, row) in prior.iter().enumerate().skip(j) {
                        let start = j * width + i * COLUMNS;
                        let weights = &mut self.out[start..start + COLUMNS];
                        for (weight, parameter) in weights.iter_mut().zip(row) {
                            *weight += forces[j] * *parameter;
                        }
                    }
                    coulomb += forces[j] * L::splat(parameters[j][column::COULOMB]);
                    if let Some(drives) = &frame.drives {
                        let weights = &mut self.motors[j * motor_width..(j + 1) * motor_width];
                        for (weight, value) in weights.iter_mut().zip(&drives.parameters) {
                            *weight += forces[j] * L::splat(*value);
                        }
                    }
                }
                let slope = coulomb * soft_sign_slope(qd[j], velocity);
                for k in 0..LANES {
                    self.adjoint[1][(s + k, j)] += slope.0[k];
                }
            }
            let [by_q, by_qd, by_qdd] = &mut by;
            regressor_gradient(&frame.lanes, &q, &qd, &qdd, &self.out, by_q, by_qd, by_qdd)?;
            if let Some(drives) = &frame.drives {
                drives.add_gradient([&q, &qd, &qdd], &self.motors, &mut by)?;
            }
            for (adjoint, by) in self.adjoint.iter_mut().zip(&by) {
                for j in 0..n {
                    for k in 0..LANES {
                        adjoint[(s + k, j)] += by[j].0[k];
                    }
                }
            }
        }
        Ok(sum)
    }

    /// Returns the penalties of the points that must stay within planes.
    fn cartesian(&mut self, pass: Pass) -> Result<f64, ExciteError> {
        let (n, samples) = (self.joints(), self.basis.samples());
        let mut sum = 0.0;
        let mut jacobian = vec![[0.0; 3]; n];
        for (number, plane) in self.frame.planes.iter().enumerate() {
            for s in 0..samples {
                let q: Vec<f64> = (0..n).map(|j| self.motion[0][(s, j)]).collect();
                let at = point_position(
                    &self.frame.plain,
                    &q,
                    plane.link,
                    plane.point,
                    &mut jacobian,
                )?;
                let c = (plane.least - plane.height(at)) / plane.reach + MARGIN;
                let multiplier = &mut self.plane_multipliers[number * samples + s];
                let (value, force) = penalty(c, multiplier, self.weight, pass);
                sum += value;
                if force != 0.0 {
                    for (j, column) in jacobian.iter().enumerate() {
                        self.adjoint[0][(s, j)] -= force * plane.height(*column) / plane.reach;
                    }
                }
            }
        }
        Ok(sum)
    }

    pub(super) fn penalties(&mut self, pass: Pass) -> Result<f64, ExciteError> {
        let kinematic = self.kinematic(pass) + self.cranks(pass);
        Ok(kinematic + self.torque_and_rows(pass)? + self.cartesian(pass)?)
    }
}
