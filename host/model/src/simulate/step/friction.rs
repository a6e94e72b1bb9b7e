//! Dry friction within a step: set-valued torques along directions.

use rig_shared::multibody::column;
use rig_shared::transmission::{DriveKind, motor_column};

use super::Stepper;
use crate::simulate::SimulateError;

/// Bound on the sweeps over the joints for the friction torques. They converge geometrically.
const SWEEPS: usize = 200;
/// Speed below which joints held by a stuck motor are at rest, rad/s or m/s: rounding of the friction torques.
const AT_REST: f64 = 1e-11;

impl Stepper<'_> {
    /// Refuses coupled drives that feed energy into some motion. Drives of changing ratio need only correct signs; the
    /// damping of the others is the same everywhere.
    pub(super) fn refuse_driving_friction(&self) -> Result<(), SimulateError> {
        let Some(motors) = &self.model.motors else {
            return Ok(());
        };
        let n = self.smooth.len();
        let mut constant = motors.parameters.clone();
        for (k, row) in constant.iter_mut().enumerate() {
            if motors.transmission.kind(k) == Some(DriveKind::Varying) {
                row[motor_column::VISCOUS] = 0.0;
            }
        }
        let mut damping = nalgebra::DMatrix::zeros(n, n);
        for i in 0..n {
            damping[(i, i)] = self.model.parameters[i][column::VISCOUS];
        }
        let origin = vec![0.0; n];
        motors
            .transmission
            .add_motor_viscosity(&constant, &origin, damping.as_mut_slice())?;
        let scale = damping.amax();
        let least = damping.symmetric_eigenvalues().min();
        // Rounding of the entries. A drive without friction has a damping of exactly zero.
        if least < -1e-9 * scale {
            return Err(SimulateError::DrivingFriction { least });
        }
        Ok(())
    }

    /// Computes the response to a unit of each friction torque: on the coordinates, and on the other directions.
    pub(super) fn respond(&mut self) {
        let n = self.free.len();
        let contacts = self.limits.len();
        for c in 0..contacts {
            for i in 0..n {
                self.response[c * n + i] = (0..n)
                    .map(|k| self.inverse[i * n + k] * self.along[c * n + k])
                    .sum();
            }
        }
        for c in 0..contacts {
            for d in 0..contacts {
                self.coupling[c * contacts + d] = (0..n)
                    .map(|k| self.along[c * n + k] * self.response[d * n + k])
                    .sum();
            }
        }
    }

    /// Solves the friction torques by projected Gauss–Seidel. Then `next` holds the velocities.
    pub(super) fn solve_friction(&mut self, dt: f64) {
        let n = self.free.len();
        let contacts = self.limits.len();
        for _ in 0..SWEEPS {
            let mut change = 0.0_f64;
            for c in 0..contacts {
                let [low, high] = self.limits[c];
                let limit = high.max(-low);
                let own = self.coupling[c * contacts + c];
                // A motor that moves only its own joint has no direction here: its friction is the joint's.
                if limit == 0.0 || own <= 0.0 {
                    self.friction[c] = 0.0;
                    continue;
                }
                let coupled: f64 = (0..contacts)
                    .map(|k| self.coupling[c * contacts + k] * self.friction[k])
                    .sum();
                let free: f64 = (0..n).map(|k| self.along[c * n + k] * self.free[k]).sum();
                let before = self.friction[c];
                let wanted = before + (free - dt * coupled) / (dt * own);
                self.friction[c] = wanted.clamp(low, high);
                change = change.max((self.friction[c] - before).abs() / limit);
            }
            // One joint is exact after one sweep; the comparison stops after the second.
            if change < 1e-12 {
                break;
            }
        }
        for i in 0..n {
            let coupled: f64 = (0..contacts)
                .map(|c| self.response[c * n + i] * self.friction[c])
                .sum();
            self.next[i] = self.free[i] - dt * coupled;
        }
        // Stuck coordinates are set exactly to rest. Otherwise rounding would add up to a drift over minutes.
        for c in 0..contacts {
            let [low, high] = self.limits[c];
            if self.friction[c] <= low || self.friction[c] >= high {
                continue;
            }
            let along = &self.along[c * n..(c + 1) * n];
            let touched = |i: usize| along[i] != 0.0;
            // The first directions are the coordinates.
            if c < n {
                self.next[c] = 0.0;
            } else if (0..n).all(|i| !touched(i) || self.next[i].abs() < AT_REST) {
                for i in 0..n {
                    if touched(i) {
                        self.next[i] = 0.0;
                    }
                }
            }
        }
    }
}
