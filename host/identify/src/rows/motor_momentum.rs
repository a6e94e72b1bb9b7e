//! Momentum of the motors of coupled drives.

use rig_shared::transmission::{MOTOR_COLUMNS, Transmission, TransmissionError, motor_column};

/// Contribution of the motors to momentum and loss, each joint × motor column (3 per motor). Their columns at rest,
/// with q̇ as acceleration, are those of the momentum. Of Jᵢ·(J·q̈ + J̇·q̇) the derivative of Jᵢ·(J·q̇) leaves
/// −J̇ᵢ·(J·q̇), zero for constant ratios.
pub(crate) struct MotorMomentum {
    pub momentum: Vec<f64>,
    pub loss: Vec<f64>,
    rates: Vec<f64>,
    speeds: Vec<f64>,
    still: Vec<f64>,
}

impl MotorMomentum {
    pub(crate) fn new(n: usize) -> Self {
        Self {
            momentum: vec![0.0; n * n * MOTOR_COLUMNS],
            loss: vec![0.0; n * n * MOTOR_COLUMNS],
            rates: vec![0.0; n * n],
            speeds: vec![0.0; n],
            still: vec![0.0; n],
        }
    }

    /// Computes both at position `q` and velocity `qd`.
    pub(crate) fn at(
        &mut self,
        drives: &Transmission<f64>,
        q: &[f64],
        qd: &[f64],
    ) -> Result<(), TransmissionError> {
        let n = q.len();
        drives.motor_columns(q, &self.still, qd, &mut self.momentum)?;
        drives.motor_columns(q, qd, &self.still, &mut self.loss)?;
        drives.motor_velocity(q, qd, &mut self.speeds)?;
        drives.jacobian_rate(q, qd, &mut self.rates)?;
        for j in 0..n {
            for k in 0..n {
                let inertia = (j * n + k) * MOTOR_COLUMNS + motor_column::INERTIA;
                self.loss[inertia] = -self.rates[k * n + j] * self.speeds[k];
            }
        }
        Ok(())
    }
}
