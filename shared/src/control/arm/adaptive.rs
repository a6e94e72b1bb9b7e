//! Passivity-based adaptive control of an arm (Slotine & Li 1987).
//!
//! With e = q − q_r, s = ė + Λ·e, v = q̇_r − Λ·e: τ = Y(q, q̇, v, v̇)·θ̂ − K_D·s and θ̂' = −Γ·Yᵀ·s. The function
//! V = ½·sᵀ·A·s + ½·θ̃ᵀ·Γ⁻¹·θ̃ then obeys V̇ = −sᵀ·K_D·s, minus what friction takes, because Ȧ − 2C is skew-symmetric.
//! Y is taken at the columns of an independent set of parameters (base parameters), or at all of them: V̇ is the same.
//!
//! Robust measures are those of the one-link law: every θ̂ stays within its bounds (projection; friction is not below
//! zero), nothing is learnt inside the dead zone of s nor while a torque is limited.
//!
//! Leaves out: velocity-weakening friction, and the compensated sums of the one-link law: at 1 kHz a step of θ̂ is above
//! the rounding of `f64`, but not of `f32`.

use super::fault::{ControlFault, check};
use super::input::{Inputs, Law, Limited, limit};
use super::regressor::PassiveRegressor;
use crate::multibody::MAX_JOINTS;
use crate::scalar::Real;

/// Constants of the law. Slices have one entry a joint, or one a parameter.
#[derive(Clone, Copy, Debug)]
pub struct Config<'a, T> {
    /// Geometry and drives.
    pub regressor: PassiveRegressor<'a, T>,
    /// Standard columns of the parameters that are adapted, in ascending order.
    pub columns: &'a [usize],
    /// Λ of each joint, 1/s.
    pub slope: &'a [T],
    /// K_D of each joint, N·m·s/rad or N·s/m.
    pub derivative: &'a [T],
    /// Γ of each parameter, its unit squared per joule; 0 for one that is not adapted.
    pub rate: &'a [T],
    /// Smallest value of each parameter.
    pub lower: &'a [T],
    /// Largest value of each parameter.
    pub upper: &'a [T],
    /// |s| of each joint below which nothing is learnt, rad/s or m/s.
    pub dead_zone: &'a [T],
    /// Highest torque of each joint, N·m or N.
    pub torque_limit: &'a [T],
    /// Time between two steps, s.
    pub period: T,
}

/// State of the law, with the buffers that it needs.
#[derive(Debug)]
pub struct State<'a, T> {
    /// The parameters in use.
    pub theta: &'a mut [T],
    /// Length n × [`PassiveRegressor::width`].
    pub regressor: &'a mut [T],
    /// Length [`workspace_length`](super::PassiveRegressor::workspace_length) of the regressor.
    pub workspace: &'a mut [T],
}

impl<'a, T: Real<Mask = bool>> Law<T> for Config<'a, T> {
    type State = State<'a, T>;

    fn step(
        &self,
        state: &mut State<'a, T>,
        input: &Inputs<'_, T>,
        torque: &mut [T],
    ) -> Result<Limited, ControlFault> {
        let n = self.regressor.chain.joint_count();
        input.check(n)?;
        for (name, list) in [
            ("slope", self.slope),
            ("derivative", self.derivative),
            ("dead_zone", self.dead_zone),
            ("torque_limit", self.torque_limit),
            ("torque", torque),
        ] {
            check(name, n, list.len())?;
        }
        let count = self.columns.len();
        for (name, list) in [
            ("rate", self.rate),
            ("lower", self.lower),
            ("upper", self.upper),
            ("theta", &*state.theta),
        ] {
            check(name, count, list.len())?;
        }
        let mut buffers = [[T::ZERO; MAX_JOINTS]; 3];
        let [s, v, vd] = &mut buffers;
        for (j, reference) in input.reference.iter().enumerate() {
            let error = input.position[j] - reference.position;
            let rate = input.velocity[j] - reference.velocity;
            s[j] = rate + self.slope[j] * error;
            v[j] = reference.velocity - self.slope[j] * error;
            vd[j] = reference.acceleration - self.slope[j] * rate;
        }
        self.regressor.evaluate(
            input.position,
            input.velocity,
            [&v[..n], &vd[..n]],
            state.workspace,
            state.regressor,
        )?;
        for (j, own) in torque.iter_mut().enumerate() {
            *own = input.known(j) - self.derivative[j] * s[j];
            for (&column, &theta) in self.columns.iter().zip(&*state.theta) {
                *own += self.regressor.entry(state.regressor, j, column) * theta;
            }
        }
        let limited = limit(self.torque_limit, torque);
        if !limited.any() {
            self.adapt(state, &s[..n]);
        }
        Ok(limited)
    }
}

impl<T: Real<Mask = bool>> Config<'_, T> {
    fn adapt(&self, state: &mut State<'_, T>, s: &[T]) {
        for (k, &column) in self.columns.iter().enumerate() {
            let mut sum = T::ZERO;
            for (j, &own) in s.iter().enumerate() {
                let zone = self.dead_zone[j];
                let beyond = own - own.clamp_to(-zone, zone);
                sum += self.regressor.entry(state.regressor, j, column) * beyond;
            }
            let next = state.theta[k] - self.rate[k] * sum * self.period;
            state.theta[k] = next.clamp_to(self.lower[k], self.upper[k]);
        }
    }
}
