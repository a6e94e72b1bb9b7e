//! Serial chains of rigid links, any length up to [`MAX_JOINTS`], revolute and prismatic joints mixed.
//!
//! Everything is linear in one vector π of [`COLUMNS`] parameters per joint, named by [`COLUMN_NAMES`]:
//! the ten inertial parameters of link i in frame i (inertia about the ORIGIN of that frame), the drive's
//! inertia seen at the joint, viscous and Coulomb friction, and a constant torque:
//!
//! τ = A(q)·q̈ + C(q, q̇)·q̇ + g(q) + Ia·q̈ + fv·q̇ + fc·sgn q̇ + off = Y(q, q̇, q̈)·π
//!
//! Frames follow the modified Denavit–Hartenberg convention (Craig 1986; Khalil & Dombre 2002, sec. 3.2).
//! All quantities are SI and joint-side; an entry that belongs to a prismatic joint is in metres and newtons
//! where that of a revolute joint is in radians and newton metres. Matrices are row-major slices.
//!
//! Every function checks the lengths of its slices and returns [`MultibodyError::WrongLength`] if one is wrong; outputs
//! are then untouched. No function allocates. None branches on a value of `T`, except [`forward_dynamics`] and
//! [`articulated_forward_dynamics`], which stop if some lane's inertia is not positive. [`block`] holds the functions
//! that recordings use repeatedly, for blocks of samples.
//!
//! One drive may turn several axes ([`Follower`]). Parameters and columns are then 14 for each link: those of the joints,
//! followed by those of the followers.
//!
//! Leaves out: elasticity of links and joints, closed loops, coupling between drives, the gyroscopic torque of the
//! rotors (their inertia acts only along its own joint), external forces on the links, and friction other than Coulomb
//! and viscous. At q̇ = 0 Coulomb friction is 0 instead of the set of torques that hold the joint.

mod adjoint;
mod articulated;
pub mod block;
mod capacity;
mod chain;
mod coefficients;
mod coriolis;
mod energy;
mod forward;
mod inertia_matrix;
mod inverse;
mod kinematics;
mod momentum;
mod parameters;
mod projection;
mod regressor;
mod spatial;

#[cfg(test)]
mod lagrangian;
#[cfg(test)]
pub(crate) mod samples;
#[cfg(test)]
mod structure;
#[cfg(test)]
mod textbook;
#[cfg(test)]
mod timing;
mod wrench;

pub use adjoint::regressor_gradient;
pub use articulated::articulated_forward_dynamics;
pub use chain::{
    AxisMotion, Chain, ChainError, Follower, JointGeometry, JointKind, MAX_JOINTS, MultibodyError,
};
pub use coefficients::{pair_column, velocity_coefficients};
pub use coriolis::coriolis_matrix;
pub use energy::{
    energy_regressor, friction_power_regressor, kinetic_energy, kinetic_energy_regressor,
    potential_energy, potential_energy_regressor, power_regressor,
};
pub use forward::{forward_dynamics, solve_positive_definite};
pub use inertia_matrix::inertia_matrix;
pub use inverse::{bias_torque, gravity_vector, inverse_dynamics};
pub(crate) use kinematics::convective;
pub use kinematics::{Pose, convective_acceleration, frame_pose, point_position};
pub use momentum::{momentum_loss_regressor, momentum_regressor};
pub use parameters::{COLUMN_NAMES, COLUMNS, column};
pub use regressor::differential_regressor;
pub use wrench::{INERTIAL_PARAMETERS, wrench_regressor};
