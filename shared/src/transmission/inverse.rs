//! From motors to joints.

use super::error::{TransmissionError, check};
use super::motors::Transmission;
use super::solve::Factors;
use crate::multibody::MAX_JOINTS;
use crate::scalar::{Mask, Real};

/// Maximum number of Newton steps of [`Transmission::joint_position`]. Two or three suffice from a neighbouring sample.
pub const MAX_NEWTON_STEPS: usize = 60;

/// Maximum number of halvings of a Newton step that leaves the screws' reach or does not reduce the error.
const MAX_HALVINGS: usize = 30;

/// Tolerance of the motor positions, in units of the type's rounding times the largest position or ratio.
const TOLERANCE_ROUNDINGS: f64 = 64.0;

impl<T: Real> Transmission<T> {
    /// Returns the motor torques for the joint torques τ: τ_motor = J⁻ᵀ·τ.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`], [`TransmissionError::Singular`].
    pub fn motor_torque(
        &self,
        q: &[T],
        tau: &[T],
        tau_motor: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("tau", n, tau.len())?;
        check("tau_motor", n, tau_motor.len())?;
        let factors = self.factored_jacobian(q)?;
        tau_motor.copy_from_slice(tau);
        factors.solve_transposed(tau_motor);
        Ok(())
    }

    /// Returns the joint velocities q̇ = J⁻¹·Ψ̇.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`], [`TransmissionError::Singular`].
    pub fn joint_velocity(
        &self,
        q: &[T],
        psid: &[T],
        qd: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("psid", n, psid.len())?;
        check("qd", n, qd.len())?;
        let factors = self.factored_jacobian(q)?;
        qd.copy_from_slice(psid);
        factors.solve(qd);
        Ok(())
    }

    /// Returns the joint accelerations q̈ = J⁻¹·(Ψ̈ − J̇·q̇).
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`], [`TransmissionError::Singular`].
    pub fn joint_acceleration(
        &self,
        q: &[T],
        qd: &[T],
        psidd: &[T],
        qdd: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("qd", n, qd.len())?;
        check("psidd", n, psidd.len())?;
        check("qdd", n, qdd.len())?;
        let factors = self.factored_jacobian(q)?;
        for ((out, motor), &acceleration) in qdd.iter_mut().zip(&self.motors).zip(psidd) {
            *out = acceleration - motor.convective(q, qd);
        }
        factors.solve(qdd);
        Ok(())
    }

    /// Finds the joint position with F(q) = Ψ by Newton's method. `q` holds the start on entry (the previous sample)
    /// and the result on return, accurate to rounding of the motor positions. Two angles of a crank give the same
    /// length of its screw. The result is on the side of the start: a step that would cross the dead centre, where the
    /// slope changes sign, is shortened.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`], [`TransmissionError::Singular`] (also at a dead centre of a crank),
    /// [`TransmissionError::OutOfReach`], [`TransmissionError::NotFound`]. `q` is then untouched.
    pub fn joint_position(&self, psi: &[T], q: &mut [T]) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("psi", n, psi.len())?;
        check("q", n, q.len())?;
        self.check_reach(psi)?;
        let mut at = [T::ZERO; MAX_JOINTS];
        at[..n].copy_from_slice(q);
        let mut error_vector = [T::ZERO; MAX_JOINTS];
        self.residual(psi, &at[..n], &mut error_vector[..n])?;
        let mut previous_error = max_abs(&error_vector[..n]);
        let scale = self.scale(psi);
        let tolerance = T::from_f64(TOLERANCE_ROUNDINGS) * machine_epsilon::<T>() * scale;
        for _ in 0..MAX_NEWTON_STEPS {
            let factors = self.factored_jacobian(&at[..n])?;
            let mut step = error_vector;
            factors.solve(&mut step[..n]);
            if previous_error.le(tolerance).all() {
                // One more step is cheap and updates the derivatives of dual numbers.
                for (out, (&position, &last)) in q.iter_mut().zip(at.iter().zip(&step)) {
                    *out = position + last;
                }
                return Ok(());
            }
            let mut step_scale = T::ONE;
            let mut next = at;
            for halving in 0..=MAX_HALVINGS {
                for j in 0..n {
                    next[j] = at[j] + step_scale * step[j];
                }
                self.residual(psi, &next[..n], &mut error_vector[..n])?;
                let error = max_abs(&error_vector[..n]);
                // Each lane shortens its own step. A screw out of reach gives NaN, which never counts as nearer.
                let improved = error.lt(previous_error) | error.le(tolerance);
                let accepted = improved & self.same_side(&at[..n], &next[..n]);
                if accepted.all() {
                    previous_error = error;
                    break;
                }
                if halving == MAX_HALVINGS {
                    return Err(self.worst_motor(psi, &at[..n]));
                }
                step_scale = T::select(accepted, step_scale, T::from_f64(0.5) * step_scale);
            }
            at = next;
        }
        Err(self.worst_motor(psi, &at[..n]))
    }

    /// Returns the factored Jacobian.
    pub(super) fn factored_jacobian(&self, q: &[T]) -> Result<Factors<T>, TransmissionError> {
        let n = self.joint_count();
        let mut square = [[T::ZERO; MAX_JOINTS]; MAX_JOINTS];
        let matrix = &mut square.as_flattened_mut()[..n * n];
        self.jacobian(q, matrix)?;
        Factors::of(matrix, n).ok_or_else(|| TransmissionError::Singular {
            motor: self.dependent_motor(q, matrix),
        })
    }

    /// Returns the motor whose row of a singular Jacobian depends most on the rows before it (Gram and Schmidt).
    fn dependent_motor(&self, q: &[T], jacobian: &mut [T]) -> usize {
        let n = self.joint_count();
        let mut worst = (n - 1, T::from_f64(f64::INFINITY));
        for (k, motor) in self.motors.iter().enumerate() {
            let (previous_rows, remaining_rows) = jacobian.split_at_mut(k * n);
            let row = &mut remaining_rows[..n];
            // Size of the row at the best angle of its crank.
            let reach = motor
                .screw
                .as_ref()
                .map_or(T::ZERO, |s| s.at(s.angle(q)).position.abs());
            let length = norm(row).max(reach);
            for _ in 0..2 {
                for unit in previous_rows.chunks_exact(n) {
                    let mut projection = T::ZERO;
                    for (&u, &r) in unit.iter().zip(row.iter()) {
                        projection += u * r;
                    }
                    for (&u, r) in unit.iter().zip(row.iter_mut()) {
                        *r -= projection * u;
                    }
                }
            }
            let remaining = norm(row);
            let independent_share = remaining / length;
            if independent_share.lt(worst.1).any() {
                worst = (k, independent_share);
            }
            let divisor = remaining.max(T::from_f64(f64::MIN_POSITIVE.sqrt()));
            for entry in row {
                *entry /= divisor;
            }
        }
        worst.0
    }

    /// Computes Ψ − F(q).
    fn residual(&self, psi: &[T], q: &[T], out: &mut [T]) -> Result<(), TransmissionError> {
        self.motor_position(q, out)?;
        for (entry, &target) in out.iter_mut().zip(psi) {
            *entry = target - *entry;
        }
        Ok(())
    }

    /// Returns true if every screw's slope has the same sign at both positions.
    fn same_side(&self, from: &[T], to: &[T]) -> T::Mask {
        let mut all = T::ZERO.le(T::ZERO);
        for screw in self.motors.iter().filter_map(|m| m.screw.as_ref()) {
            let slope = |q: &[T]| screw.slope_sign(q);
            all = all & T::ZERO.lt(slope(from) * slope(to));
        }
        all
    }

    /// Refuses positions that a screw, which depends on its crank alone, cannot reach at any angle.
    fn check_reach(&self, psi: &[T]) -> Result<(), TransmissionError> {
        for (motor, (m, &target)) in self.motors.iter().zip(psi).enumerate() {
            let Some(screw) = &m.screw else { continue };
            let crank_only = m.ratios.iter().all(|r| r.abs().le(T::ZERO).all());
            if crank_only && !screw.reaches(target - m.zero).all() {
                return Err(TransmissionError::OutOfReach { motor });
            }
        }
        Ok(())
    }

    /// Returns the largest of 1 rad, the motor positions and the terms of their functions, rad.
    fn scale(&self, psi: &[T]) -> T {
        let mut scale = T::ONE;
        for (m, &target) in self.motors.iter().zip(psi) {
            scale = scale.max(target.abs()).max(m.zero.abs());
            for &ratio in &m.ratios {
                scale = scale.max(ratio.abs());
            }
            if let Some(screw) = &m.screw {
                scale = scale.max((screw.factor * screw.constant.abs().sqrt()).abs());
            }
        }
        scale
    }

    /// Returns the motor with the largest position error, as an error.
    fn worst_motor(&self, psi: &[T], q: &[T]) -> TransmissionError {
        let n = self.joint_count();
        let mut error_vector = [T::ZERO; MAX_JOINTS];
        if let Err(error) = self.residual(psi, q, &mut error_vector[..n]) {
            return error;
        }
        let mut motor = 0;
        for k in 1..n {
            if error_vector[motor].abs().lt(error_vector[k].abs()).any() {
                motor = k;
            }
        }
        TransmissionError::NotFound { motor }
    }
}

/// Returns the Euclidean length.
fn norm<T: Real>(values: &[T]) -> T {
    let mut sum = T::ZERO;
    for value in values {
        sum += value.squared();
    }
    sum.sqrt()
}

/// Returns the largest absolute entry; NaN if any entry is NaN.
fn max_abs<T: Real>(values: &[T]) -> T {
    let mut largest = T::ZERO;
    for &value in values {
        largest = largest.max(value.abs());
    }
    // 0, or NaN if any entry is not finite: comparisons alone would miss it.
    let mut nothing = T::ZERO;
    for &value in values {
        nothing += T::ZERO * value;
    }
    largest + nothing
}

/// Returns the distance from 1 to the next number of the type, by the textbook loop.
fn machine_epsilon<T: Real>() -> T {
    let half = T::from_f64(0.5);
    let mut step = T::ONE;
    while T::ONE.lt(T::ONE + half * step).any() {
        step *= half;
    }
    step
}
