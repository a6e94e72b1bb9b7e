//! The model of an arm that a law uses.

use super::fault::ControlFault;
use crate::multibody::{COLUMNS, Chain, MAX_JOINTS, column, inertia_matrix, inverse_dynamics};
use crate::scalar::Real;
use crate::transmission::{MOTOR_COLUMNS, Transmission, motor_column};

/// Coupled drives of an arm.
#[derive(Clone, Copy, Debug)]
pub struct ArmMotors<'a, T> {
    /// Motor positions as functions of the joint positions.
    pub transmission: &'a Transmission<T>,
    /// Parameters, one row a motor.
    pub parameters: &'a [[T; MOTOR_COLUMNS]],
}

/// The model of an arm: the geometry of its chain, one row of parameters a link, and its coupled drives.
#[derive(Clone, Copy, Debug)]
pub struct ArmModel<'a, T> {
    /// Geometry and gravity.
    pub chain: &'a Chain<T>,
    /// Parameters, one row a link: joints first, then axes that follow.
    pub parameters: &'a [[T; COLUMNS]],
    /// Drives that move several joints or have a changing ratio; `None` if there is no such drive.
    pub motors: Option<ArmMotors<'a, T>>,
}

impl<T: Real> ArmModel<'_, T> {
    /// Returns the number of joints n.
    pub fn joint_count(&self) -> usize {
        self.chain.joint_count()
    }

    /// Computes the inertia matrix at `q`, n × n row-major, with drives and motors.
    ///
    /// # Errors
    /// [`ControlFault`] on wrong lengths.
    pub fn inertia_matrix(&self, q: &[T], out: &mut [T]) -> Result<(), ControlFault> {
        inertia_matrix(self.chain, self.parameters, q, out)?;
        if let Some(motors) = &self.motors {
            let t = motors.transmission;
            t.add_motor_inertia(motors.parameters, q, out)?;
        }
        Ok(())
    }

    /// Computes the torques of a motion without friction: inertia, Coriolis, gravity, motors and constant torques.
    ///
    /// # Errors
    /// [`ControlFault`] on wrong lengths.
    pub fn rigid_torque(
        &self,
        q: &[T],
        qd: &[T],
        qdd: &[T],
        tau: &mut [T],
    ) -> Result<(), ControlFault> {
        inverse_dynamics(self.chain, self.parameters, q, qd, qdd, tau)?;
        for ((own, row), &v) in tau.iter_mut().zip(self.parameters).zip(qd) {
            *own -= row[column::VISCOUS] * v + row[column::COULOMB] * v.sgn();
        }
        let Some(motors) = &self.motors else {
            return Ok(());
        };
        let n = tau.len();
        let width = n * MOTOR_COLUMNS;
        let mut columns = [T::ZERO; MAX_JOINTS * MAX_JOINTS * MOTOR_COLUMNS];
        let columns = &mut columns[..n * width];
        motors.transmission.motor_columns(q, qd, qdd, columns)?;
        for (own, row) in tau.iter_mut().zip(columns.chunks_exact(width)) {
            for (block, parameters) in row.chunks_exact(MOTOR_COLUMNS).zip(motors.parameters) {
                *own += block[motor_column::INERTIA] * parameters[motor_column::INERTIA];
            }
        }
        Ok(())
    }

    /// Adds the viscous friction of joints and motors at velocities `qd`, N·m or N.
    ///
    /// # Errors
    /// [`ControlFault`] on wrong lengths.
    pub fn add_viscous_torque(&self, q: &[T], qd: &[T], tau: &mut [T]) -> Result<(), ControlFault> {
        for ((own, row), &v) in tau.iter_mut().zip(self.parameters).zip(qd) {
            *own += row[column::VISCOUS] * v;
        }
        let Some(motors) = &self.motors else {
            return Ok(());
        };
        let n = tau.len();
        let mut damping = [T::ZERO; MAX_JOINTS * MAX_JOINTS];
        let damping = &mut damping[..n * n];
        let t = motors.transmission;
        t.add_motor_viscosity(motors.parameters, q, damping)?;
        for (own, row) in tau.iter_mut().zip(damping.chunks_exact(n)) {
            for (&d, &v) in row.iter().zip(qd) {
                *own += d * v;
            }
        }
        Ok(())
    }

    /// Computes the torques of the motors for joint torques: τ_motor = J⁻ᵀ·τ. Without coupled drives they are the
    /// joint torques.
    ///
    /// # Errors
    /// [`ControlFault::Transmission`] at a dead centre of a crank.
    pub fn motor_torque(&self, q: &[T], tau: &[T], out: &mut [T]) -> Result<(), ControlFault> {
        match &self.motors {
            Some(motors) => motors.transmission.motor_torque(q, tau, out)?,
            None => out.copy_from_slice(tau),
        }
        Ok(())
    }
}
