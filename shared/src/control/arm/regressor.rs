//! The regressor of passivity-based laws.

use super::fault::{ControlFault, check};
use crate::multibody::{COLUMNS, Chain, MAX_JOINTS, column, differential_regressor};
use crate::precompensation;
use crate::scalar::Real;
use crate::transmission::{MOTOR_COLUMNS, Transmission, motor_column};

/// Computes Y with Y·π = A(q)·v̇ + C(q, q̇)·v + g(q) + off + fv·v + fc·dir(v), for a reference velocity v other than q̇.
///
/// C is the matrix of Christoffel symbols, for which Ȧ − 2C is skew-symmetric. C(q, a)·b is symmetric in a and b, so it is
/// a difference of two regressors: C(q, a)·b = c((a + b)/2) − c((a − b)/2) with c(v) = C(q, v)·v. The same holds for the
/// motors' inertia Jᵀ·I·J̇. Columns are those of the standard parameters, 14 a link, then 3 a motor with coupled drives.
#[derive(Clone, Copy, Debug)]
pub struct PassiveRegressor<'a, T> {
    /// Geometry and gravity.
    pub chain: &'a Chain<T>,
    /// Coupled drives; `None` if there are none.
    pub transmission: Option<&'a Transmission<T>>,
    /// Speed below which the direction of a joint is blended, rad/s or m/s
    /// ([`precompensation::direction`]); times the motor's ratio for a motor.
    pub velocity_threshold: T,
}

impl<T: Real> PassiveRegressor<'_, T> {
    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        let n = self.chain.joint_count();
        let motors = self.transmission.map_or(0, |_| MOTOR_COLUMNS * n);
        self.chain.parameter_count() + motors
    }

    /// Returns the length of the workspace of [`Self::evaluate`].
    pub fn workspace_length(&self) -> usize {
        let n = self.chain.joint_count();
        n * (self.chain.parameter_count() + MOTOR_COLUMNS * n)
    }

    /// Computes Y into `out` (n × [`Self::width`]): the block of the links first, n × 14 for each link, then the n × 3n block
    /// of the motors, both row-major. `workspace` has the length [`Self::workspace_length`].
    ///
    /// # Errors
    /// [`ControlFault`] on wrong lengths.
    pub fn evaluate(
        &self,
        q: &[T],
        qd: &[T],
        [v, vd]: [&[T]; 2],
        workspace: &mut [T],
        out: &mut [T],
    ) -> Result<(), ControlFault> {
        let n = self.chain.joint_count();
        check("qd", n, qd.len())?;
        check("v", n, v.len())?;
        check("workspace", self.workspace_length(), workspace.len())?;
        check("out", n * self.width(), out.len())?;
        let half = T::from_f64(0.5);
        let (mut mean, mut off) = ([T::ZERO; MAX_JOINTS], [T::ZERO; MAX_JOINTS]);
        for j in 0..n {
            mean[j] = half * (qd[j] + v[j]);
            off[j] = half * (qd[j] - v[j]);
        }
        let (mean, off) = (&mean[..n], &off[..n]);
        let still = [T::ZERO; MAX_JOINTS];
        let still = &still[..n];
        let width = self.chain.parameter_count();
        let (links, motors) = out.split_at_mut(n * width);
        let (other, other_motors) = workspace.split_at_mut(n * width);
        differential_regressor(self.chain, q, mean, vd, links)?;
        differential_regressor(self.chain, q, off, still, other)?;
        subtract(links, other);
        differential_regressor(self.chain, q, still, still, other)?;
        for (own, &more) in links.iter_mut().zip(&*other) {
            *own += more;
        }
        for j in 0..n {
            let own = j * width + j * COLUMNS;
            let direction = precompensation::direction(v[j], T::ZERO, self.velocity_threshold);
            links[own + column::DRIVE_INERTIA] = vd[j];
            links[own + column::VISCOUS] = v[j];
            links[own + column::COULOMB] = direction;
            links[own + column::OFFSET] = T::ONE;
        }
        let Some(t) = self.transmission else {
            return Ok(());
        };
        t.motor_columns(q, mean, vd, motors)?;
        t.motor_columns(q, off, still, other_motors)?;
        subtract(motors, other_motors);
        // Viscous columns are linear in the velocity: those at v, at rest otherwise.
        t.motor_columns(q, v, still, other_motors)?;
        let mut along = [T::ZERO; MAX_JOINTS * MAX_JOINTS];
        let along = &mut along[..n * n];
        let mut speeds = [T::ZERO; MAX_JOINTS];
        t.motor_directions(q, along)?;
        t.motor_speeds(q, v, &mut speeds[..n])?;
        for i in 0..n {
            for (k, row) in along.chunks_exact(n).enumerate() {
                let place = i * n * MOTOR_COLUMNS + k * MOTOR_COLUMNS;
                let threshold = self.velocity_threshold * row[k].abs();
                let direction = precompensation::direction(speeds[k], T::ZERO, threshold);
                motors[place + motor_column::VISCOUS] = other_motors[place + motor_column::VISCOUS];
                motors[place + motor_column::COULOMB] = row[i] * direction;
            }
        }
        Ok(())
    }

    /// Returns the entry of `out` of [`Self::evaluate`] for joint `joint` and standard column `column`.
    #[inline(always)]
    pub fn entry(&self, out: &[T], joint: usize, column: usize) -> T {
        let n = self.chain.joint_count();
        let links = self.chain.parameter_count();
        match column.checked_sub(links) {
            None => out[joint * links + column],
            Some(motor) => out[n * links + joint * MOTOR_COLUMNS * n + motor],
        }
    }
}

fn subtract<T: Real>(from: &mut [T], what: &[T]) {
    for (own, &less) in from.iter_mut().zip(what) {
        *own -= less;
    }
}
