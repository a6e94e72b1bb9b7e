//! Computed torque: the model turns a wanted acceleration of the joints into torques.
//!
//! τ = A(q)·(q̈_r + kd·ė + kp·e) + C·q̇ + g + off + fv·q̇ + dry friction (Craig 1986; Khalil & Dombre 2002, sec. 14.4),
//! with the motors' inertia in A and C. With the exact model each joint's error obeys ë + kd·ė + kp·e = 0. Viscous
//! friction is at the measured velocity, as in the one-joint law.
//!
//! Leaves out: an integral; a torque that the model lacks leaves an error of that torque over A·kp.

use super::fault::{ControlFault, check};
use super::friction::add_dry_friction;
use super::input::{Inputs, Law, Limited, limit};
use super::model::ArmModel;
use crate::multibody::MAX_JOINTS;
use crate::precompensation::PrecompensationSettings;
use crate::scalar::Real;

/// Constants of the law.
#[derive(Clone, Copy, Debug)]
pub struct Config<'a, T> {
    /// The model.
    pub model: ArmModel<'a, T>,
    /// kp of each joint, 1/s².
    pub proportional: &'a [T],
    /// kd of each joint, 1/s.
    pub derivative: &'a [T],
    /// Settings of the compensation of dry friction.
    pub friction: PrecompensationSettings<T>,
    /// Highest torque of each joint, N·m or N.
    pub torque_limit: &'a [T],
}

impl<T: Real<Mask = bool>> Law<T> for Config<'_, T> {
    type State = ();

    fn step(
        &self,
        (): &mut (),
        input: &Inputs<'_, T>,
        torque: &mut [T],
    ) -> Result<Limited, ControlFault> {
        let n = self.model.joint_count();
        input.check(n)?;
        check("proportional", n, self.proportional.len())?;
        check("derivative", n, self.derivative.len())?;
        check("torque_limit", n, self.torque_limit.len())?;
        let (mut wanted, mut planned) = ([T::ZERO; MAX_JOINTS], [T::ZERO; MAX_JOINTS]);
        for (j, reference) in input.reference.iter().enumerate() {
            planned[j] = reference.velocity;
            wanted[j] = reference.acceleration
                + self.proportional[j] * (reference.position - input.position[j])
                + self.derivative[j] * (reference.velocity - input.velocity[j]);
        }
        let (q, qd) = (input.position, input.velocity);
        self.model.rigid_torque(q, qd, &wanted[..n], torque)?;
        self.model.add_viscous_torque(q, qd, torque)?;
        add_dry_friction(&self.model, &self.friction, q, &planned[..n], qd, torque)?;
        for (j, own) in torque.iter_mut().enumerate() {
            *own += input.known(j);
        }
        Ok(limit(self.torque_limit, torque))
    }
}
