//! One time step of a chain with dry friction that really sticks.
//!
//! Midpoint time-stepping after Moreau (1988; Jean 1999): positions advance by half a step, velocities by a
//! whole one, positions by the other half. Coulomb friction is a set-valued torque: within a step it is
//! whatever value in [−fc, fc] brings the joint to rest, or ±fc if that is not enough. Nothing is smoothed,
//! so a joint below breakaway stands still exactly. Second order in the step while no joint starts or stops.
//!
//! Leaves out: every friction beyond Coulomb and viscous, elasticity, end stops.

use rig_shared::multibody::{COLUMNS, bias_torque, column, inertia_matrix};

use super::{Model, SimulateError};

/// Passes over velocity-dependent terms; the second makes the step second order.
const PASSES: usize = 2;
/// Bound on the sweeps over the joints for the friction torques; they converge geometrically.
const SWEEPS: usize = 200;

/// Steps a model; owns every buffer, so that a step allocates nothing.
pub struct Stepper<'a> {
    model: &'a Model,
    /// The parameters without friction and offset, which the step treats itself.
    smooth: Vec<[f64; COLUMNS]>,
    mass: Vec<f64>,
    factor: Vec<f64>,
    inverse: Vec<f64>,
    bias: Vec<f64>,
    middle: Vec<f64>,
    mean_velocity: Vec<f64>,
    free: Vec<f64>,
    friction: Vec<f64>,
    next: Vec<f64>,
}

impl<'a> Stepper<'a> {
    /// Prepares to step a model.
    ///
    /// # Errors
    /// [`SimulateError::NegativeFriction`] where a joint's friction would feed energy in.
    pub fn new(model: &'a Model) -> Result<Self, SimulateError> {
        let n = model.parameters.len();
        let mut smooth = model.parameters.clone();
        for (joint, row) in smooth.iter_mut().enumerate() {
            for (place, name) in [(column::VISCOUS, "fv"), (column::COULOMB, "fc")] {
                // `!(>=)`: NaN is refused as well.
                if row[place].is_nan() || row[place] < 0.0 {
                    return Err(SimulateError::NegativeFriction {
                        parameter: format!("{name}{}", joint + 1),
                        value: row[place],
                    });
                }
            }
            row[column::VISCOUS] = 0.0;
            row[column::COULOMB] = 0.0;
            row[column::OFFSET] = 0.0;
        }
        Ok(Self {
            model,
            smooth,
            mass: vec![0.0; n * n],
            factor: vec![0.0; n * n],
            inverse: vec![0.0; n * n],
            bias: vec![0.0; n],
            middle: vec![0.0; n],
            mean_velocity: vec![0.0; n],
            free: vec![0.0; n],
            friction: vec![0.0; n],
            next: vec![0.0; n],
        })
    }

    /// Advances positions `q` and velocities `v` (length n) by `dt` under the joint torques `torque`.
    ///
    /// # Errors
    /// [`SimulateError::Multibody`] where the inertia matrix is not positive definite.
    pub fn step(
        &mut self,
        q: &mut [f64],
        v: &mut [f64],
        torque: &[f64],
        dt: f64,
    ) -> Result<(), SimulateError> {
        let n = q.len();
        for i in 0..n {
            self.middle[i] = q[i] + 0.5 * dt * v[i];
        }
        inertia_matrix(
            &self.model.chain,
            &self.smooth,
            &self.middle,
            &mut self.mass,
        )?;
        // Viscous friction acts on the mean velocity of the step: half of it belongs to the unknown.
        self.factor.copy_from_slice(&self.mass);
        for i in 0..n {
            self.factor[i * n + i] += 0.5 * dt * self.model.parameters[i][column::VISCOUS];
        }
        invert(&mut self.factor, &mut self.inverse, n)?;
        self.mean_velocity.copy_from_slice(v);
        for _ in 0..PASSES {
            bias_torque(
                &self.model.chain,
                &self.smooth,
                &self.middle,
                &self.mean_velocity,
                &mut self.bias,
            )?;
            for i in 0..n {
                let own = &self.model.parameters[i];
                let driving = torque[i]
                    - self.bias[i]
                    - own[column::OFFSET]
                    - 0.5 * own[column::VISCOUS] * v[i];
                let momentum: f64 = (0..n).map(|k| self.mass[i * n + k] * v[k]).sum();
                self.next[i] = momentum + dt * driving;
            }
            for i in 0..n {
                self.free[i] = (0..n).map(|k| self.inverse[i * n + k] * self.next[k]).sum();
            }
            self.solve_friction(dt);
            for i in 0..n {
                self.mean_velocity[i] = 0.5 * (v[i] + self.next[i]);
            }
        }
        for i in 0..n {
            q[i] = self.middle[i] + 0.5 * dt * self.next[i];
            v[i] = self.next[i];
        }
        Ok(())
    }

    /// Projected Gauss–Seidel on the friction torques: afterwards `next` holds the velocities.
    fn solve_friction(&mut self, dt: f64) {
        let n = self.free.len();
        for _ in 0..SWEEPS {
            let mut change = 0.0_f64;
            for i in 0..n {
                let coupled: f64 = (0..n)
                    .map(|k| self.inverse[i * n + k] * self.friction[k])
                    .sum();
                let velocity = self.free[i] - dt * coupled;
                let limit = self.model.parameters[i][column::COULOMB];
                let before = self.friction[i];
                let wanted = before + velocity / (dt * self.inverse[i * n + i]);
                self.friction[i] = wanted.clamp(-limit, limit);
                change =
                    change.max((self.friction[i] - before).abs() / limit.max(f64::MIN_POSITIVE));
            }
            // A single joint is exact after one sweep; the comparison ends it after the second.
            if change < 1e-12 {
                break;
            }
        }
        for i in 0..n {
            let coupled: f64 = (0..n)
                .map(|k| self.inverse[i * n + k] * self.friction[k])
                .sum();
            let velocity = self.free[i] - dt * coupled;
            // A stuck joint is at rest exactly, not to rounding: drift over minutes would otherwise add up.
            let stuck = self.friction[i].abs() < self.model.parameters[i][column::COULOMB];
            self.next[i] = if stuck { 0.0 } else { velocity };
        }
    }
}

/// Inverse of a symmetric positive definite matrix by Cholesky; the factor replaces the input.
fn invert(a: &mut [f64], inverse: &mut [f64], n: usize) -> Result<(), SimulateError> {
    for j in 0..n {
        let pivot = a[j * n + j] - (0..j).map(|k| a[j * n + k] * a[j * n + k]).sum::<f64>();
        if pivot.is_nan() || pivot <= 0.0 {
            return Err(SimulateError::NotPositiveDefinite { joint: j + 1 });
        }
        let root = pivot.sqrt();
        a[j * n + j] = root;
        for i in j + 1..n {
            let rest: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            a[i * n + j] = (a[i * n + j] - rest) / root;
        }
    }
    for c in 0..n {
        for i in 0..n {
            let rest: f64 = (0..i).map(|k| a[i * n + k] * inverse[k * n + c]).sum();
            inverse[i * n + c] = (f64::from(u8::from(i == c)) - rest) / a[i * n + i];
        }
        for i in (0..n).rev() {
            let rest: f64 = (i + 1..n).map(|k| a[k * n + i] * inverse[k * n + c]).sum();
            inverse[i * n + c] = (inverse[i * n + c] - rest) / a[i * n + i];
        }
    }
    Ok(())
}
