//! Motor positions, velocities and accelerations from those of the joints; joint torques from those of the motors.

use super::error::{TransmissionError, check};
use super::motors::{Motor, Screw, Transmission};
use crate::multibody::MAX_JOINTS;
use crate::scalar::Real;

/// A screw at an angle of its crank: length over lead (as motor angle) and its first two derivatives.
#[derive(Clone, Copy)]
pub(super) struct ScrewState<T> {
    pub(super) position: T,
    slope: T,
    curvature: T,
}

impl<T: Real> Screw<T> {
    #[inline(always)]
    pub(super) fn angle(&self, q: &[T]) -> T {
        weighted(&self.weights, q) + self.offset
    }

    /// Returns a value with the sign of the slope; it is zero at the dead centres.
    #[inline(always)]
    pub(super) fn slope_sign(&self, q: &[T]) -> T {
        let (sin, cos) = self.angle(q).sin_cos();
        -(self.cosine * sin + self.sine * cos)
    }

    /// Returns true if an angle of the crank gives this motor angle.
    pub(super) fn reaches(&self, position: T) -> T::Mask {
        let length = position / self.factor;
        let swing = (self.cosine.squared() + self.sine.squared()).sqrt();
        let off = (length.squared() - self.constant).abs();
        T::ZERO.le(length) & off.le(swing)
    }

    /// With L² = w = s + m·cos φ − n·sin φ: L' = w'/2L, L'' = (w''/2 − L'²)/L and w'' = s − w.
    #[inline(always)]
    pub(super) fn at(&self, angle: T) -> ScrewState<T> {
        let half = T::from_f64(0.5);
        let (sin, cos) = angle.sin_cos();
        let square = self.constant + self.cosine * cos - self.sine * sin;
        let length = square.sqrt();
        let slope = -half * (self.cosine * sin + self.sine * cos) / length;
        let curvature = (half * (self.constant - square) - slope.squared()) / length;
        ScrewState {
            position: self.factor * length,
            slope: self.factor * slope,
            curvature: self.factor * curvature,
        }
    }
}

#[inline(always)]
fn weighted<T: Real>(weights: &[T], values: &[T]) -> T {
    let mut sum = T::ZERO;
    for (&w, &v) in weights.iter().zip(values) {
        sum += w * v;
    }
    sum
}

impl<T: Real> Motor<T> {
    #[inline(always)]
    fn position(&self, q: &[T]) -> T {
        let linear = weighted(&self.ratios, q) + self.zero;
        match &self.screw {
            None => linear,
            Some(screw) => linear + screw.at(screw.angle(q)).position,
        }
    }

    /// Row of the Jacobian.
    #[inline(always)]
    pub(super) fn row(&self, q: &[T], out: &mut [T]) {
        out.copy_from_slice(&self.ratios);
        if let Some(screw) = &self.screw {
            let slope = screw.at(screw.angle(q)).slope;
            for (entry, &weight) in out.iter_mut().zip(&screw.weights) {
                *entry += slope * weight;
            }
        }
    }

    /// J̇·q̇ of this motor.
    #[inline(always)]
    pub(super) fn convective(&self, q: &[T], qd: &[T]) -> T {
        match &self.screw {
            None => T::ZERO,
            Some(screw) => {
                let rate = weighted(&screw.weights, qd);
                screw.at(screw.angle(q)).curvature * rate.squared()
            }
        }
    }
}

impl<T: Real> Transmission<T> {
    /// Computes motor positions Ψ = F(q), rad; `q` and `psi` have length n. The result is NaN where a screw cannot
    /// reach the crank.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_position(&self, q: &[T], psi: &mut [T]) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("psi", n, psi.len())?;
        for (out, motor) in psi.iter_mut().zip(&self.motors) {
            *out = motor.position(q);
        }
        Ok(())
    }

    /// Computes the Jacobian J = ∂F/∂q, n × n row-major, one row per motor: motor radians per joint radian (or metre).
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn jacobian(&self, q: &[T], out: &mut [T]) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("out", n * n, out.len())?;
        for (row, motor) in out.chunks_exact_mut(n).zip(&self.motors) {
            motor.row(q, row);
        }
        Ok(())
    }

    /// Computes the rate of the Jacobian J̇ along q̇, n × n row-major.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn jacobian_rate(&self, q: &[T], qd: &[T], out: &mut [T]) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        check("out", n * n, out.len())?;
        for (row, motor) in out.chunks_exact_mut(n).zip(&self.motors) {
            row.fill(T::ZERO);
            if let Some(screw) = &motor.screw {
                let rate = screw.at(screw.angle(q)).curvature * weighted(&screw.weights, qd);
                for (entry, &weight) in row.iter_mut().zip(&screw.weights) {
                    *entry = rate * weight;
                }
            }
        }
        Ok(())
    }

    /// Computes motor velocities Ψ̇ = J·q̇, rad/s.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_velocity(
        &self,
        q: &[T],
        qd: &[T],
        psid: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        check("psid", n, psid.len())?;
        let mut row = [T::ZERO; MAX_JOINTS];
        for (out, motor) in psid.iter_mut().zip(&self.motors) {
            motor.row(q, &mut row[..n]);
            *out = weighted(&row[..n], qd);
        }
        Ok(())
    }

    /// Computes motor accelerations Ψ̈ = J·q̈ + J̇·q̇, rad/s².
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn motor_acceleration(
        &self,
        q: &[T],
        qd: &[T],
        qdd: &[T],
        psidd: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        check("qdd", n, qdd.len())?;
        check("psidd", n, psidd.len())?;
        let mut row = [T::ZERO; MAX_JOINTS];
        for (out, motor) in psidd.iter_mut().zip(&self.motors) {
            motor.row(q, &mut row[..n]);
            *out = weighted(&row[..n], qdd) + motor.convective(q, qd);
        }
        Ok(())
    }

    /// Computes joint torques τ = Jᵀ·τ_motor, N·m or N.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn joint_torque(
        &self,
        q: &[T],
        tau_motor: &[T],
        tau: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.joint_count();
        check("q", n, q.len())?;
        check("tau_motor", n, tau_motor.len())?;
        check("tau", n, tau.len())?;
        tau.fill(T::ZERO);
        let mut row = [T::ZERO; MAX_JOINTS];
        for (&torque, motor) in tau_motor.iter().zip(&self.motors) {
            motor.row(q, &mut row[..n]);
            for (out, &ratio) in tau.iter_mut().zip(&row[..n]) {
                *out += ratio * torque;
            }
        }
        Ok(())
    }
}
