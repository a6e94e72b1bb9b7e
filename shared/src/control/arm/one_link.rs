//! The position laws of the one-link rig as laws of a chain of one joint.

use super::fault::{ControlFault, check};
use super::input::{Inputs, Law, Limited};
use crate::control::law;
use crate::control::{Measured, Torque};
use crate::scalar::Real;

impl<T: Real<Mask = bool>> Law<T> for law::Config<T> {
    type State = law::State<T>;

    fn step(
        &self,
        state: &mut law::State<T>,
        input: &Inputs<'_, T>,
        torque: &mut [T],
    ) -> Result<Limited, ControlFault> {
        input.check(1)?;
        check("torque", 1, torque.len())?;
        let measured = Measured {
            position: input.position[0],
            velocity: input.velocity[0],
        };
        let Torque { value, limited, .. } =
            law::step(self, state, measured, input.reference[0], input.known(0));
        torque[0] = value;
        let mut out = Limited::default();
        out.note(0, limited);
        Ok(out)
    }
}
