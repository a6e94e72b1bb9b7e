//! Regressor columns of the motor parameters, and the motors' part in the matrices of the dynamics.

use super::drives::{DriveKind, MOTOR_COLUMNS, motor_column};
use super::error::{TransmissionError, check};
use super::motors::{Motor, Transmission};
use crate::multibody::MAX_JOINTS;
use crate::scalar::Real;

impl<T: Real> Motor<T> {
    /// Writes the row along which the parameters act: r of a coupled drive, J of a varying one, zero of a simple one.
    #[inline(always)]
    fn direction(&self, q: &[T], out: &mut [T]) {
        match self.kind {
            DriveKind::Simple => out.fill(T::ZERO),
            DriveKind::Coupled => out.copy_from_slice(&self.shares),
            DriveKind::Varying => self.row(q, out),
        }
    }

    /// Returns the motor's inertia on the diagonal of joint `i` that `Ia<i>` describes.
    #[inline(always)]
    fn own_inertia(&self, motor: usize, i: usize, direction: &[T]) -> T {
        if self.kind == DriveKind::Coupled && i != motor {
            direction[i].squared()
        } else {
            T::ZERO
        }
    }

    /// Returns the same for viscous friction and `fv<i>`.
    #[inline(always)]
    fn own_viscosity(&self, i: usize, direction: &[T]) -> T {
        if self.kind == DriveKind::Coupled {
            direction[i].squared()
        } else {
            T::ZERO
        }
    }
}

/// Returns Σ a_j·b_j.
#[inline(always)]
fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    let mut sum = T::ZERO;
    for (&x, &y) in a.iter().zip(b) {
        sum += x * y;
    }
    sum
}

impl<T: Real> Transmission<T> {
    /// Writes the columns of the motor parameters in the differential model. `out` is n × 3n, row-major: entry (i, 3k +
    /// c) multiplies parameter c of motor k in the torque of joint i. See the [module](super) for the entries.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_columns(
        &self,
        q: &[T],
        qd: &[T],
        qdd: &[T],
        out: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        check("qdd", n, qdd.len())?;
        check("out", n * MOTOR_COLUMNS * n, out.len())?;
        let width = MOTOR_COLUMNS * n;
        let mut direction = [T::ZERO; MAX_JOINTS];
        let direction = &mut direction[..n];
        out.fill(T::ZERO);
        for (k, motor) in self.motors.iter().enumerate() {
            if motor.kind == DriveKind::Simple {
                continue;
            }
            motor.direction(q, direction);
            let speed = dot(direction, qd);
            let sign = speed.sgn();
            let acceleration = dot(direction, qdd) + motor.convective(q, qd);
            for (i, &along) in direction.iter().enumerate() {
                let start = i * width + MOTOR_COLUMNS * k;
                out[start + motor_column::INERTIA] =
                    along * acceleration - motor.own_inertia(k, i, direction) * qdd[i];
                out[start + motor_column::VISCOUS] =
                    along * speed - motor.own_viscosity(i, direction) * qd[i];
                out[start + motor_column::COULOMB] = along * sign;
            }
        }
        Ok(())
    }

    /// Computes the torques that inertia and friction of the motors take at the motors themselves, N·m, length n; zero
    /// for a simple drive. `parameters` has one row per motor. [`Self::motor_columns`] times `parameters` is Jᵀ times
    /// the result, less the [`Self::joint_parts`].
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn own_motor_torque(
        &self,
        parameters: &[[T; MOTOR_COLUMNS]],
        q: &[T],
        qd: &[T],
        qdd: &[T],
        out: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("parameters", n, parameters.len())?;
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        check("qdd", n, qdd.len())?;
        check("out", n, out.len())?;
        let mut direction = [T::ZERO; MAX_JOINTS];
        let direction = &mut direction[..n];
        for (k, (torque, motor)) in out.iter_mut().zip(&self.motors).enumerate() {
            motor.direction(q, direction);
            let speed = dot(direction, qd);
            let acceleration = dot(direction, qdd) + motor.convective(q, qd);
            let own = &parameters[k];
            let at_own_joint = own[motor_column::INERTIA] * acceleration
                + own[motor_column::VISCOUS] * speed
                + own[motor_column::COULOMB] * speed.sgn();
            *torque = match motor.kind {
                DriveKind::Simple => T::ZERO,
                DriveKind::Coupled => at_own_joint / motor.ratios[k],
                DriveKind::Varying => at_own_joint,
            };
        }
        Ok(())
    }

    /// Writes for each joint the parts of `Ia` and `fv` that describe coupled motors, length n: Σ_k r_i²·Iam_k (i ≠ k) and
    /// Σ_k r_i²·fvm_k. `parameters` has one row per motor.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn joint_parts(
        &self,
        parameters: &[[T; MOTOR_COLUMNS]],
        out: &mut [[T; 2]],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("parameters", n, parameters.len())?;
        check("out", n, out.len())?;
        out.fill([T::ZERO; 2]);
        for (k, (motor, own)) in self.motors.iter().zip(parameters).enumerate() {
            // Empty unless the drive is coupled.
            let direction = &motor.shares[..];
            for (i, [inertia, viscosity]) in out.iter_mut().enumerate().take(direction.len()) {
                *inertia += own[motor_column::INERTIA] * motor.own_inertia(k, i, direction);
                *viscosity += own[motor_column::VISCOUS] * motor.own_viscosity(i, direction);
            }
        }
        Ok(())
    }

    /// Writes the row of the motors' kinetic energy, length 3n, without the part in `Ia`: ½·(s² − Σ r_i²·q̇_i²) of a
    /// coupled drive (i ≠ k), ½·Ψ̇² of a varying one. Friction columns are 0.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_energy_columns(
        &self,
        q: &[T],
        qd: &[T],
        out: &mut [T],
    ) -> Result<(), TransmissionError> {
        self.rows(q, qd, out, |k, motor, direction, block| {
            let mut twice = dot(direction, qd).squared();
            for (i, speed) in qd.iter().enumerate() {
                twice -= motor.own_inertia(k, i, direction) * speed.squared();
            }
            block[motor_column::INERTIA] = T::from_f64(0.5) * twice;
        })
    }

    /// Writes the row of the motors' friction power, length 3n, without the part in `fv`: s² − Σ r_i²·q̇_i² and |s| of
    /// a coupled drive, Ψ̇² and |Ψ̇| of a varying one. Inertia columns are 0.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_power_columns(
        &self,
        q: &[T],
        qd: &[T],
        out: &mut [T],
    ) -> Result<(), TransmissionError> {
        self.rows(q, qd, out, |_, motor, direction, block| {
            let rate = dot(direction, qd);
            let mut power = rate.squared();
            for (i, speed) in qd.iter().enumerate() {
                power -= motor.own_viscosity(i, direction) * speed.squared();
            }
            block[motor_column::VISCOUS] = power;
            block[motor_column::COULOMB] = rate.abs();
        })
    }

    /// Writes the speeds that give the sign of the motors' Coulomb friction, length n: s of a coupled drive (joint
    /// units), Ψ̇ of a varying one (rad/s of the motor), 0 of a simple one.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_speeds(&self, q: &[T], qd: &[T], out: &mut [T]) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        check("out", n, out.len())?;
        let mut direction = [T::ZERO; MAX_JOINTS];
        let direction = &mut direction[..n];
        for (speed, motor) in out.iter_mut().zip(&self.motors) {
            motor.direction(q, direction);
            *speed = dot(direction, qd);
        }
        Ok(())
    }

    /// Writes the rows along which the motor parameters act, n × n row-major, one row per motor: r of a coupled drive,
    /// J of a varying one, zero of a simple one. Coulomb friction is `fcm`·row·sgn of [`Self::motor_speeds`].
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_directions(&self, q: &[T], out: &mut [T]) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("out", n * n, out.len())?;
        for (row, motor) in out.chunks_exact_mut(n).zip(&self.motors) {
            motor.direction(q, row);
        }
        Ok(())
    }

    /// Adds the motors' inertia to an inertia matrix A(q) of the joints (n × n, row-major). With the rest in `Ia` the
    /// result is A + Jᵀ·I_m·J. `parameters` has one row per motor.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn add_motor_inertia(
        &self,
        parameters: &[[T; MOTOR_COLUMNS]],
        q: &[T],
        matrix: &mut [T],
    ) -> Result<(), TransmissionError> {
        self.add(
            parameters,
            q,
            matrix,
            motor_column::INERTIA,
            |k, motor, i, direction| motor.own_inertia(k, i, direction),
        )
    }

    /// Adds the motors' viscous friction to that of the joints (n × n, row-major; `fv` on its diagonal).
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn add_motor_viscosity(
        &self,
        parameters: &[[T; MOTOR_COLUMNS]],
        q: &[T],
        matrix: &mut [T],
    ) -> Result<(), TransmissionError> {
        self.add(
            parameters,
            q,
            matrix,
            motor_column::VISCOUS,
            |_, motor, i, direction| motor.own_viscosity(i, direction),
        )
    }

    /// Adds value·(d·dᵀ − diag(own)) for every motor that is not simple.
    fn add(
        &self,
        parameters: &[[T; MOTOR_COLUMNS]],
        q: &[T],
        matrix: &mut [T],
        column: usize,
        own: impl Fn(usize, &Motor<T>, usize, &[T]) -> T,
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("parameters", n, parameters.len())?;
        check("q", n, q.len())?;
        check("matrix", n * n, matrix.len())?;
        let mut direction = [T::ZERO; MAX_JOINTS];
        let direction = &mut direction[..n];
        for (k, (motor, row)) in self.motors.iter().zip(parameters).enumerate() {
            if motor.kind == DriveKind::Simple {
                continue;
            }
            motor.direction(q, direction);
            let value = row[column];
            for i in 0..n {
                for j in 0..n {
                    matrix[i * n + j] += value * direction[i] * direction[j];
                }
                matrix[i * n + i] -= value * own(k, motor, i, direction);
            }
        }
        Ok(())
    }

    /// Fills a row of 3n entries, motor by motor.
    fn rows(
        &self,
        q: &[T],
        qd: &[T],
        out: &mut [T],
        fill: impl Fn(usize, &Motor<T>, &[T], &mut [T]),
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        check("out", MOTOR_COLUMNS * n, out.len())?;
        let mut direction = [T::ZERO; MAX_JOINTS];
        let direction = &mut direction[..n];
        out.fill(T::ZERO);
        for (k, (motor, block)) in self
            .motors
            .iter()
            .zip(out.chunks_exact_mut(MOTOR_COLUMNS))
            .enumerate()
        {
            if motor.kind != DriveKind::Simple {
                motor.direction(q, direction);
                fill(k, motor, direction, block);
            }
        }
        Ok(())
    }
}
