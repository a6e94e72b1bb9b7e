//! Drives coupled to joints: motor coordinates Ψ as functions of the joint coordinates q (the book's φ).
//!
//! One motor per joint. Motor k turns by
//!
//! Ψ_k = F_k(q) = Σ_j g_kj·q_j + (2π/p)·√(s + m·cos φ − n·sin φ) + zero, φ = Σ_j c_j·q_j + offset,
//!
//! with constant ratios g (gears, bevels, a coupled wrist) and, where a ball screw turns a crank, its length over its
//! lead p: s = l₁² + l₂² + l₃² and m, n from the crank l₁ and the two legs l₂, l₃ of the screw's anchor (Kozłowski
//! 1998, the IRp-6). With J = ∂F/∂q the powers on both sides are the same, τᵀq̇ = τ_motorᵀΨ̇, so that
//!
//! Ψ̇ = J·q̇, Ψ̈ = J·q̈ + J̇·q̇, τ = Jᵀ·τ_motor.
//!
//! # Parameters of the motors
//! After the 14·n columns of [`multibody`](crate::multibody) a regressor has three per motor ([`MOTOR_COLUMN_NAMES`]):
//! inertia, viscous and Coulomb friction of the motor, except the part that the joint's own `Ia`, `fv`, `fc` describe.
//! Their factors depend on the drive ([`DriveKind`]; r_j = J_kj/J_kk, s = Σ_j r_j·q̇_j, torque of joint i):
//!
//! | column | simple | coupled | varying |
//! | --- | --- | --- | --- |
//! | `Iam` | 0 | r_i·ṡ − \[i ≠ k\]·r_i²·q̈_i | J_ki·Ψ̈_k |
//! | `fvm` | 0 | r_i·s − r_i²·q̇_i | J_ki·Ψ̇_k |
//! | `fcm` | 0 | r_i·sgn s | J_ki·sgn Ψ̇_k |
//!
//! For a coupled drive the values are those seen at its own joint. The motor's part on the diagonal of another joint
//! belongs to that joint's `Ia` and `fv`. This is the convention under which the coupled wrists of the Stäubli arms are
//! published (Gautier 1991; Khalil & Dombre 2002, ch. 12). For a varying drive the values are the motor's own. The
//! joint of a coupled or varying drive has no `Ia` if only the motor turns there: `Iam` describes that inertia. It has
//! one if another motor adds to the joint, or if gear and shaft have an inertia of their own
//! ([`Transmission::has_joint_inertia`], [`DriveMap::joint_inertia`]).
//!
//! Leaves out: more or fewer motors than joints, backlash and elasticity of gears, mass of the screws and rods (they
//! turn with the links beside them), screw friction that grows with the load, the gyroscopic torque of rotors. Leaves
//! out also the first moment of a crank that turns with a sum of joint angles about the shoulder of a parallelogram
//! (the IRp-6's with φ₃ = q₂ + q₃). It has the weight of a first moment of the outer link, without the coupling of the
//! two links that a crank at the elbow has. The serial chain can describe only one of these two properties.

mod columns;
mod drives;
mod dynamics;
mod error;
mod inverse;
mod map;
mod motors;
mod solve;
#[cfg(test)]
mod tests;

pub use drives::{DriveKind, DriveMap, MOTOR_COLUMN_NAMES, MOTOR_COLUMNS, ScrewMap, motor_column};
pub use dynamics::MotorSpace;
pub use error::TransmissionError;
pub use inverse::MAX_NEWTON_STEPS;
pub use motors::Transmission;
