//! Transmission analysis with a link encoder: position residuals across the transmission.
//!
//! x = q − ql = c + ε·q + δ·q̇ + (λ + φ·sgn q̇)/K − D·λ̇/K² + (gap/2)·s(λ + φ·sgn q̇) + Σ cos, sin of motor or joint
//! angle. λ is the gear torque by the model for the link's *measured* motion, so it includes the gear's effect (Spong
//! 1987; backlash: Nordin and Gutman 2002; errors of encoders and gears as orders over a turn). s is the flank in
//! contact. It changes with the sign of the torque over a fitted width, because impacts and filters blur it. ε allows
//! for a small ratio error, δ for different reading instants. x contains no motor friction and no torque sensor error:
//! presliding and Stribeck friction affect the torque alone.
//!
//! Leaves out: stiffness that grows with the twist; hysteresis of the gear; the motion inside the gap, except its mean;
//! drives that move several joints; friction in the link's bearing that winds up the gear at rest.

mod across;
mod analysis;
mod collected;
mod contact;
mod equation;
mod gear;
mod law;
mod naming;
mod reading;
mod result;
mod sentences;
mod sizes;
mod tell;
#[cfg(test)]
mod tests;

pub(crate) use across::across;
pub(crate) use result::{Across, gears, names_something, refutes};
pub(crate) use tell::tell;
