//! Penalties of the limits of motors that move several joints, or one at a changing ratio.
//!
//! The motors' angles are Ψ = F(q) with the Jacobian J. F has symmetric second derivatives, so that the derivative of
//! J·u by q at a constant u is the rate of J along u.

use rig_shared::scalar::Real;

use super::penalty::{Pass, both_sides};
use super::state::Problem;
use crate::ExciteError;
use crate::drives::Drives;
use crate::lanes::{L, LANES};
use rig_model::simulate::SimulateError;
use rig_shared::transmission::TransmissionError;

fn wrong(e: TransmissionError) -> ExciteError {
    SimulateError::from(e).into()
}

impl Problem<'_> {
    /// Returns the drives if a motor has limits.
    fn limited_drives(&self) -> Option<&'_ Drives> {
        self.frame
            .drives
            .as_deref()
            .filter(|d| !d.limits.is_empty())
    }

    /// Returns the penalties of the motors' angles and speeds.
    pub(super) fn motor_motion(&mut self, pass: Pass) -> Result<f64, ExciteError> {
        let (n, samples, frame) = (self.joints(), self.basis.samples(), self.frame);
        let Some(drives) = frame.drives.as_ref().filter(|d| !d.limits.is_empty()) else {
            return Ok(0.0);
        };
        let mut sum = 0.0;
        let [mut psi, mut psid] = [(); 2].map(|()| vec![0.0; n]);
        let [mut jacobian, mut rate] = [(); 2].map(|()| vec![0.0; n * n]);
        for s in 0..samples {
            let [q, qd] = [0, 1]
                .map(|order| -> Vec<f64> { (0..n).map(|j| self.motion[order][(s, j)]).collect() });
            let t = &drives.plain;
            t.motor_position(&q, &mut psi).map_err(wrong)?;
            t.motor_velocity(&q, &qd, &mut psid).map_err(wrong)?;
            t.jacobian(&q, &mut jacobian).map_err(wrong)?;
            t.jacobian_rate(&q, &qd, &mut rate).map_err(wrong)?;
            for (k, limit) in drives.limits.iter().enumerate() {
                let rows = k * n..(k + 1) * n;
                if let Some([middle, half]) = limit.middle_and_half() {
                    let multipliers = &mut self.motor_multipliers[0][k * samples + s];
                    let share = (psi[k] - middle) / half;
                    let (value, force) = both_sides(share, multipliers, self.weight, pass);
                    sum += value;
                    for (j, ratio) in jacobian[rows.clone()].iter().enumerate() {
                        self.adjoint[0][(s, j)] += force / half * ratio;
                    }
                }
                if limit.velocity.is_finite() {
                    let multipliers = &mut self.motor_multipliers[1][k * samples + s];
                    let share = psid[k] / limit.velocity;
                    let (value, force) = both_sides(share, multipliers, self.weight, pass);
                    sum += value;
                    let force = force / limit.velocity;
                    for j in 0..n {
                        self.adjoint[1][(s, j)] += force * jacobian[k * n + j];
                        self.adjoint[0][(s, j)] += force * rate[k * n + j];
                    }
                }
            }
        }
        Ok(sum)
    }

    /// Returns true if the torque of a motor is limited.
    pub(super) fn limits_motor_torque(&self) -> bool {
        let limited = |d: &Drives| d.limits.iter().any(|m| m.torque.is_finite());
        self.limited_drives().is_some_and(limited)
    }

    /// Adds the penalties of the motors' torques to `sum`, from the joint torques `tau` of the samples from `first` on.
    /// Adds their derivative by the joint torques to `forces`, and that by the ratios to the motion's. Returns true if
    /// they are not zero.
    pub(super) fn motor_torques(
        &mut self,
        first: usize,
        tau: &[L],
        pass: Pass,
        sum: &mut f64,
        forces: &mut [L],
    ) -> Result<bool, ExciteError> {
        let (n, samples, frame) = (self.joints(), self.basis.samples(), self.frame);
        let Some(drives) = &frame.drives else {
            return Ok(false);
        };
        let q = self.state(0, first);
        let mut motor = vec![L::ZERO; n];
        let t = &drives.lanes;
        t.motor_torque(&q, tau, &mut motor).map_err(wrong)?;
        let mut push = vec![L::ZERO; n];
        let mut pushed = false;
        for (k, limit) in drives.limits.iter().enumerate() {
            if !limit.torque.is_finite() {
                continue;
            }
            for lane in 0..LANES {
                let place = k * samples + first + lane;
                let multipliers = &mut self.motor_multipliers[2][place];
                let share = motor[k].0[lane] / limit.torque;
                let (value, force) = both_sides(share, multipliers, self.weight, pass);
                *sum += value;
                push[k].0[lane] = force / limit.torque;
                pushed |= force != 0.0;
            }
        }
        if !pushed {
            return Ok(false);
        }
        // τ_motor = J⁻ᵀ·τ: with u = J⁻¹·push the derivatives are u by τ, and −τ_motorᵀ·∂(J·u)/∂q by q.
        let mut u = vec![L::ZERO; n];
        t.joint_velocity(&q, &push, &mut u).map_err(wrong)?;
        let mut rate = vec![L::ZERO; n * n];
        t.jacobian_rate(&q, &u, &mut rate).map_err(wrong)?;
        for (j, own) in u.iter().enumerate() {
            forces[j] += *own;
            let mut by = L::ZERO;
            for (k, torque) in motor.iter().enumerate() {
                by += *torque * rate[k * n + j];
            }
            for lane in 0..LANES {
                self.adjoint[0][(first + lane, j)] -= by.0[lane];
            }
        }
        Ok(true)
    }
}
