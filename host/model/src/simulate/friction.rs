//! Dry friction within a step: set-valued torques along directions.

use rig_shared::multibody::column;
use rig_shared::transmission::{DriveKind, motor_column};

use super::elastic::Elastic;
use super::error::SimulateError;
use super::model::Model;

/// Bound on the sweeps over the joints for the friction torques. They converge geometrically.
const SWEEPS: usize = 200;
/// Speed below which joints held by a stuck motor are at rest, rad/s or m/s: rounding of the friction torques.
const AT_REST: f64 = 1e-11;

/// The directions in which dry friction acts, and its torques along them.
pub(super) struct DryFriction {
    /// Directions of Coulomb friction, one row each: the coordinates, then the motors of coupled drives.
    pub along: Vec<f64>,
    /// Coulomb friction along them.
    pub coulomb: Vec<f64>,
    /// Bounds of the friction torques.
    pub limits: Vec<[f64; 2]>,
    torques: Vec<f64>,
    /// Response of the velocities to a unit of each friction (n columns a row), and of the speeds along all directions.
    response: Vec<f64>,
    coupling: Vec<f64>,
}

impl DryFriction {
    /// Returns friction of the sizes `coulomb` along the `n` coordinates, then along directions that are still 0.
    pub(super) fn new(coulomb: Vec<f64>, n: usize) -> Self {
        let contacts = coulomb.len();
        let mut along = vec![0.0; contacts * n];
        // A joint with an elastic gear has two coordinates, each with its own friction.
        for i in 0..n {
            along[i * n + i] = 1.0;
        }
        Self {
            along,
            limits: coulomb.iter().map(|fc| [-fc, *fc]).collect(),
            coulomb,
            torques: vec![0.0; contacts],
            response: vec![0.0; contacts * n],
            coupling: vec![0.0; contacts * contacts],
        }
    }

    /// Computes the response to a unit of each friction torque: on the coordinates, and on the other directions.
    pub(super) fn respond(&mut self, inverse: &[f64], n: usize) {
        let contacts = self.limits.len();
        for c in 0..contacts {
            for i in 0..n {
                self.response[c * n + i] = (0..n)
                    .map(|k| inverse[i * n + k] * self.along[c * n + k])
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

    /// Solves the friction torques of a step of `dt` by projected Gauss–Seidel, from the velocities without friction,
    /// `free`. Then `next` holds the velocities.
    pub(super) fn solve(&mut self, free: &[f64], dt: f64, next: &mut [f64]) {
        let n = free.len();
        let contacts = self.limits.len();
        for _ in 0..SWEEPS {
            let mut change = 0.0_f64;
            for c in 0..contacts {
                let [low, high] = self.limits[c];
                let limit = high.max(-low);
                let own = self.coupling[c * contacts + c];
                // A motor that moves only its own joint has no direction here: its friction is the joint's.
                if limit == 0.0 || own <= 0.0 {
                    self.torques[c] = 0.0;
                    continue;
                }
                let coupled: f64 = (0..contacts)
                    .map(|k| self.coupling[c * contacts + k] * self.torques[k])
                    .sum();
                let own_free: f64 = (0..n).map(|k| self.along[c * n + k] * free[k]).sum();
                let before = self.torques[c];
                let wanted = before + (own_free - dt * coupled) / (dt * own);
                self.torques[c] = wanted.clamp(low, high);
                change = change.max((self.torques[c] - before).abs() / limit);
            }
            // One joint is exact after one sweep; the comparison stops after the second.
            if change < 1e-12 {
                break;
            }
        }
        for i in 0..n {
            let coupled: f64 = (0..contacts)
                .map(|c| self.response[c * n + i] * self.torques[c])
                .sum();
            next[i] = free[i] - dt * coupled;
        }
        // Stuck coordinates are set exactly to rest. Otherwise rounding would add up to a drift over minutes.
        for c in 0..contacts {
            let [low, high] = self.limits[c];
            if self.torques[c] <= low || self.torques[c] >= high {
                continue;
            }
            let along = &self.along[c * n..(c + 1) * n];
            let touched = |i: usize| along[i] != 0.0;
            // The first directions are the coordinates.
            if c < n {
                next[c] = 0.0;
            } else if (0..n).all(|i| !touched(i) || next[i].abs() < AT_REST) {
                for i in 0..n {
                    if touched(i) {
                        next[i] = 0.0;
                    }
                }
            }
        }
    }
}

/// Refuses coupled drives that feed energy into some motion. Drives of changing ratio need only correct signs; the
/// damping of the others is the same everywhere. Friction behind an elastic gear does not brake the motors.
pub(super) fn refuse_driving_friction(
    model: &Model,
    elastic: &Elastic,
) -> Result<(), SimulateError> {
    let n = model.joint_count();
    let Some(motors) = &model.motors else {
        return Ok(());
    };
    let mut constant = motors.parameters.clone();
    for (k, row) in constant.iter_mut().enumerate() {
        if motors.transmission.kind(k) == Some(DriveKind::Varying) {
            row[motor_column::VISCOUS] = 0.0;
        }
    }
    let mut damping = nalgebra::DMatrix::zeros(n, n);
    for i in 0..n {
        damping[(i, i)] = (1.0 - elastic.link_friction(i)) * model.parameters[i][column::VISCOUS];
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
