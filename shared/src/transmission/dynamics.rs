//! The equations of motion in motor coordinates.

use super::error::{TransmissionError, check};
use super::motors::Transmission;
use super::solve::Factors;
use crate::multibody::MAX_JOINTS;
use crate::scalar::Real;

/// The change from joint to motor coordinates at one position and velocity:
///
/// τ = A·q̈ + b becomes τ_motor = A_Ψ·Ψ̈ + b_Ψ with A_Ψ = J⁻ᵀ·A·J⁻¹ and b_Ψ = J⁻ᵀ·(b − A·J⁻¹·J̇·q̇)
///
/// (Kozłowski 1998: the models of the IRp-6 in Ψ and in φ). The kinetic energy is the same in both.
pub struct MotorSpace<T> {
    factors: Factors<T>,
    convective: [T; MAX_JOINTS],
    n: usize,
}

impl<T: Real> MotorSpace<T> {
    /// Returns the change at `q` and `qd` (length n).
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`], [`TransmissionError::Singular`].
    pub fn at(
        transmission: &Transmission<T>,
        q: &[T],
        qd: &[T],
    ) -> Result<Self, TransmissionError> {
        let n = transmission.joint_count();
        check("q", n, q.len())?;
        check("qd", n, qd.len())?;
        let factors = transmission.factored_jacobian(q)?;
        let mut convective = [T::ZERO; MAX_JOINTS];
        for (entry, motor) in convective.iter_mut().zip(&transmission.motors) {
            *entry = motor.convective(q, qd);
        }
        Ok(Self {
            factors,
            convective,
            n,
        })
    }

    /// Computes A_Ψ (n × n, row-major, kg·m² at the motors) from the joints' inertia matrix A.
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn inertia_matrix(&self, joint: &[T], out: &mut [T]) -> Result<(), TransmissionError> {
        let n = self.n;
        check("joint", n * n, joint.len())?;
        check("out", n * n, out.len())?;
        // J⁻ᵀ on the columns of the symmetric A, then on the rows of the result.
        let mut column = [T::ZERO; MAX_JOINTS];
        let column = &mut column[..n];
        for c in 0..n {
            for r in 0..n {
                column[r] = joint[r * n + c];
            }
            self.factors.solve_transposed(column);
            for r in 0..n {
                out[r * n + c] = column[r];
            }
        }
        for row in out.chunks_exact_mut(n) {
            self.factors.solve_transposed(row);
        }
        Ok(())
    }

    /// Computes b_Ψ (length n, N·m at the motors) from the joints' inertia matrix A and bias torque b (Coriolis,
    /// gravity, friction; [`crate::multibody::bias_torque`]).
    ///
    /// # Errors
    /// [`TransmissionError::WrongLength`].
    pub fn bias_torque(
        &self,
        joint_inertia: &[T],
        joint_bias: &[T],
        out: &mut [T],
    ) -> Result<(), TransmissionError> {
        let n = self.n;
        check("joint_inertia", n * n, joint_inertia.len())?;
        check("joint_bias", n, joint_bias.len())?;
        check("out", n, out.len())?;
        let mut shift = self.convective;
        self.factors.solve(&mut shift[..n]);
        for (i, entry) in out.iter_mut().enumerate() {
            let mut value = joint_bias[i];
            for j in 0..n {
                value -= joint_inertia[i * n + j] * shift[j];
            }
            *entry = value;
        }
        self.factors.solve_transposed(out);
        Ok(())
    }
}
