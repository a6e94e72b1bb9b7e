//! What all laws have in common: input, output, and the trait.

use super::fault::{ControlFault, check};
use crate::control::Torque;
use crate::scalar::Real;
use crate::trajectory::Reference;

/// Input of a law in one control tick; slices have one entry a joint.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a, T> {
    /// Measured positions, rad or m.
    pub position: &'a [T],
    /// Measured velocities, rad/s or m/s.
    pub velocity: &'a [T],
    /// Desired motion of the joints. Laws in the space of a task hold it as the posture.
    pub reference: &'a [Reference<T>],
    /// Desired motion of the tool along each direction of the task, m from the task's origin; unused by joint laws.
    pub task: [Reference<T>; 3],
    /// Force of the environment on the tool, in the base frame, N; unused by joint laws.
    pub force: [T; 3],
    /// Known joint torques in addition to the model, N·m or N; empty for none.
    pub feedforward: &'a [T],
}

impl<T: Real> Inputs<'_, T> {
    /// Checks the lengths for a chain of `n` joints.
    pub(super) fn check(&self, n: usize) -> Result<(), ControlFault> {
        check("position", n, self.position.len())?;
        check("velocity", n, self.velocity.len())?;
        check("reference", n, self.reference.len())?;
        if self.feedforward.is_empty() {
            return Ok(());
        }
        check("feedforward", n, self.feedforward.len())
    }

    /// Returns the known torque of a joint.
    pub(super) fn known(&self, joint: usize) -> T {
        self.feedforward.get(joint).copied().unwrap_or(T::ZERO)
    }
}

/// The joints whose torque limit has reduced the torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limited(u16);

impl Limited {
    /// Returns true if the limit of joint `joint` (from 0) has reduced its torque.
    pub fn joint(self, joint: usize) -> bool {
        self.0 >> joint & 1 == 1
    }

    /// Returns true if any limit has reduced a torque.
    pub fn any(self) -> bool {
        self.0 != 0
    }

    pub(super) fn note(&mut self, joint: usize, limited: bool) {
        self.0 |= u16::from(limited) << joint;
    }
}

/// Cuts torques to ±`limits` (N·m or N). A torque that is not a number becomes 0.
pub(super) fn limit<T: Real<Mask = bool>>(limits: &[T], torque: &mut [T]) -> Limited {
    let mut limited = Limited::default();
    for (joint, (own, &limit)) in torque.iter_mut().zip(limits).enumerate() {
        let cut = Torque::saturated(limit, *own, T::ZERO);
        *own = cut.value;
        limited.note(joint, cut.limited);
    }
    limited
}

/// A control law: measurement and reference in, joint torques out.
pub trait Law<T> {
    /// What the law remembers from tick to tick.
    type State;

    /// Computes the joint torques of one tick (length n, N·m or N), within their limits, and advances the state.
    ///
    /// # Errors
    /// [`ControlFault`]; the torques are then undefined.
    fn step(
        &self,
        state: &mut Self::State,
        input: &Inputs<'_, T>,
        torque: &mut [T],
    ) -> Result<Limited, ControlFault>;
}
