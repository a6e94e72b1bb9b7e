//! Impedance control (Hogan 1985): the tool answers a force like a mass with spring and damper.
//!
//! M_d·(ẍ − ẍ_r) + D_d·(ẋ − ẋ_r) + K_d·(x − x_r) = f along each direction of the task, f the measured force of the
//! environment on the tool. The acceleration follows from it, and the decoupling of the operational space gives the
//! torques; the measured force is taken off the arm, so that M_d may differ from the arm's own inertia.
//!
//! Leaves out: rotations of the tool. Friction that the model lacks adds to f: the tool then rests anywhere within
//! friction over K_d.

use super::fault::{ControlFault, check};
use super::input::{Inputs, Law, Limited};
use super::operational::Operational;
use super::task::AXES;
use crate::scalar::Real;

/// The behaviour of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Target<T> {
    /// M_d, kg, above 0.
    pub mass: T,
    /// D_d, N·s/m, above 0.
    pub damping: T,
    /// K_d, N/m.
    pub stiffness: T,
}

impl<T: Real> Target<T> {
    /// Returns the target with a stiffness (N/m), an undamped natural frequency `bandwidth` (Hz) and a damping ratio:
    /// M_d = K_d/ω², D_d = 2ζ·K_d/ω.
    pub fn design(stiffness: T, bandwidth: T, damping: T) -> Self {
        let omega = T::from_f64(core::f64::consts::TAU) * bandwidth;
        Self {
            mass: stiffness / omega.squared(),
            damping: T::from_f64(2.0) * damping * stiffness / omega,
            stiffness,
        }
    }
}

/// Constants of the law.
#[derive(Clone, Copy, Debug)]
pub struct Config<'a, T> {
    /// Arm, tool and directions.
    pub operational: Operational<'a, T>,
    /// Behaviour along each direction.
    pub targets: &'a [Target<T>],
}

impl<T: Real<Mask = bool>> Law<T> for Config<'_, T> {
    type State = ();

    fn step(
        &self,
        (): &mut (),
        input: &Inputs<'_, T>,
        torque: &mut [T],
    ) -> Result<Limited, ControlFault> {
        let Operational { model, task, .. } = &self.operational;
        let count = task.directions.len();
        check("targets", count, self.targets.len())?;
        let motion = task.motion(model.chain, input.position, input.velocity)?;
        let pressed = task.pressed(&input.force);
        let mut wanted = [T::ZERO; AXES];
        let mut speed = [T::ZERO; AXES];
        for (d, target) in self.targets.iter().enumerate() {
            let reference = &input.task[d];
            let pull = target.stiffness * (reference.position - motion.position[d]) - pressed[d];
            wanted[d] = reference.acceleration
                + (target.damping * (reference.velocity - motion.velocity[d]) + pull) / target.mass;
            // Without inertia the target would move at this speed.
            speed[d] = reference.velocity + pull / target.damping;
        }
        let targets = [&wanted, &speed, &pressed];
        let computed = self.operational.torque(input, &motion, targets, torque)?;
        Ok(computed.limited)
    }
}
