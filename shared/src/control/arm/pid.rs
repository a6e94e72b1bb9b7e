//! Independent PID of each motor, with compensation of gravity and friction.
//!
//! With coupled drives the loops close about the motors, as on the IRp-6: e = F(q_r) − F(q), ė = J·(q̇_r − q̇), and
//! τ = Jᵀ·(kp·e + kd·ė + ∫ki·e dt) + g(q) + off + viscous friction at q̇_r + dry friction. Without them J is one.
//! Gravity is taken at the measured position (Takegaki & Arimoto 1981).
//!
//! Anti-windup is back-calculation: the integral follows the torque that the limit has cut off, with the tracking time
//! √(kd/ki) (Åström & Hägglund 1995, sec. 3.5).
//!
//! Leaves out: inertia and Coriolis torques, which the feedback has to overcome.

use super::fault::{ControlFault, check};
use super::friction::add_dry_friction;
use super::input::{Inputs, Law, Limited, limit};
use super::model::ArmModel;
use crate::multibody::MAX_JOINTS;
use crate::precompensation::PrecompensationSettings;
use crate::scalar::Real;

/// Gains of one motor; in motor coordinates with coupled drives, otherwise joint-side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PidGains<T> {
    /// N·m/rad
    pub proportional: T,
    /// N·m/(rad·s)
    pub integral: T,
    /// N·m·s/rad, above 0 if the integral gain is.
    pub derivative: T,
}

impl<T: Real> PidGains<T> {
    /// Returns gains for an inertia: kp = J·ω², kd = 2ζ·J·ω with ω = 2π·`bandwidth` (Hz), ki = kp·ω/10. The integral is a
    /// tenth as fast as the loop, so that it takes less than 6° of phase at ω.
    pub fn design(inertia: T, bandwidth: T, damping: T) -> Self {
        let omega = T::from_f64(core::f64::consts::TAU) * bandwidth;
        let proportional = inertia * omega.squared();
        Self {
            proportional,
            integral: T::from_f64(0.1) * proportional * omega,
            derivative: T::from_f64(2.0) * damping * inertia * omega,
        }
    }
}

/// Constants of the law.
#[derive(Clone, Copy, Debug)]
pub struct Config<'a, T> {
    /// Model for gravity and friction.
    pub model: ArmModel<'a, T>,
    /// Gains, one a motor.
    pub gains: &'a [PidGains<T>],
    /// Settings of the compensation of dry friction.
    pub friction: PrecompensationSettings<T>,
    /// Highest torque of each joint, N·m or N.
    pub torque_limit: &'a [T],
    /// Time between two steps, s.
    pub period: T,
}

/// State of the law: the integrals, N·m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    integral: [T; MAX_JOINTS],
}

impl<T: Real<Mask = bool>> Config<'_, T> {
    /// Computes the errors of the motors (of the joints without coupled drives), and the Jacobian of the motors.
    fn errors(
        &self,
        input: &Inputs<'_, T>,
        [error, rate]: [&mut [T]; 2],
        jacobian: &mut [T],
    ) -> Result<(), ControlFault> {
        let n = error.len();
        let mut wanted = [T::ZERO; MAX_JOINTS];
        for (own, reference) in wanted.iter_mut().zip(input.reference) {
            *own = reference.position;
        }
        let Some(motors) = &self.model.motors else {
            for j in 0..n {
                error[j] = wanted[j] - input.position[j];
                rate[j] = input.reference[j].velocity - input.velocity[j];
                jacobian[j * n + j] = T::ONE;
            }
            return Ok(());
        };
        let mut now = [T::ZERO; MAX_JOINTS];
        motors.transmission.motor_position(&wanted[..n], error)?;
        motors
            .transmission
            .motor_position(input.position, &mut now[..n])?;
        motors.transmission.jacobian(input.position, jacobian)?;
        for (k, row) in jacobian.chunks_exact(n).enumerate() {
            error[k] -= now[k];
            rate[k] = T::ZERO;
            for (j, &ratio) in row.iter().enumerate() {
                rate[k] += ratio * (input.reference[j].velocity - input.velocity[j]);
            }
        }
        Ok(())
    }
}

impl<T: Real<Mask = bool>> Law<T> for Config<'_, T> {
    type State = State<T>;

    fn step(
        &self,
        state: &mut State<T>,
        input: &Inputs<'_, T>,
        torque: &mut [T],
    ) -> Result<Limited, ControlFault> {
        let n = self.model.joint_count();
        input.check(n)?;
        check("gains", n, self.gains.len())?;
        check("torque_limit", n, self.torque_limit.len())?;
        check("torque", n, torque.len())?;
        let mut buffers = [[T::ZERO; MAX_JOINTS]; 3];
        let [error, rate, planned] = &mut buffers;
        let (error, rate, planned) = (&mut error[..n], &mut rate[..n], &mut planned[..n]);
        let mut jacobian = [T::ZERO; MAX_JOINTS * MAX_JOINTS];
        let jacobian = &mut jacobian[..n * n];
        self.errors(input, [&mut *error, &mut *rate], jacobian)?;
        for (own, reference) in planned.iter_mut().zip(input.reference) {
            *own = reference.velocity;
        }
        let still = [T::ZERO; MAX_JOINTS];
        let still = &still[..n];
        self.model
            .rigid_torque(input.position, still, still, torque)?;
        self.model
            .add_viscous_torque(input.position, planned, torque)?;
        add_dry_friction(
            &self.model,
            &self.friction,
            input.position,
            planned,
            input.velocity,
            torque,
        )?;
        for (k, (row, gains)) in jacobian.chunks_exact(n).zip(self.gains).enumerate() {
            let feedback =
                gains.proportional * error[k] + gains.derivative * rate[k] + state.integral[k];
            for (own, &ratio) in torque.iter_mut().zip(row) {
                *own += ratio * feedback;
            }
        }
        // What the limit cuts off, by joint and then by motor.
        let (mut cut, mut motor_cut) = ([T::ZERO; MAX_JOINTS], [T::ZERO; MAX_JOINTS]);
        for (j, own) in torque.iter_mut().enumerate() {
            *own += input.known(j);
            cut[j] = -*own;
        }
        let limited = limit(self.torque_limit, torque);
        if limited.any() {
            for (own, &given) in cut.iter_mut().zip(&*torque) {
                *own += given;
            }
            self.model
                .motor_torque(input.position, &cut[..n], &mut motor_cut[..n])?;
        }
        for (k, gains) in self.gains.iter().enumerate() {
            if T::ZERO.lt(gains.integral) {
                let tracking = (gains.derivative / gains.integral).sqrt();
                state.integral[k] +=
                    self.period * (gains.integral * error[k] + motor_cut[k] / tracking);
            }
        }
        Ok(limited)
    }
}
