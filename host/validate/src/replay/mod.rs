//! Simulated motion of a model under the recorded torques, with controllers that correct deviations from the recorded
//! motion.
//!
//! If a joint's controller is linear in position and velocity, then for the model's motion q instead of the recorded
//! q_m it gives its recorded torque plus kp·(q_m − q) + kd·(q̇_m − q̇). All feed-forward terms are already in the
//! recorded torque. So the closed loop is simulated with kp and kd alone. They come from [joint.controller] if
//! described; else from a regression, if the recording has a reference that explains the torque; else from a slow
//! substitute, which holds a joint that would fall or drift at the recorded motion.
//!
//! Limits: no integral action (it is part of the recorded torque), no controllers that couple joints, no temperatures,
//! no effects on the voltage.

mod controller;
mod simulation;
#[cfg(test)]
mod tests;

pub use controller::of_joints;
pub use simulation::replayed;
