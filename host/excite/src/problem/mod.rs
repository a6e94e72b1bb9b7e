//! The objective of a design, with its exact gradient.
//!
//! The criterion depends on the information matrix M = YᵀY/S, and its derivative by the regressor's entries is
//! 2/S·Y·∂f/∂M. The limits on torque add λ·πᵀ. Both are weights on the regressor's entries. One backward sweep through
//! the chain ([`regressor_gradient`](rig_shared::multibody::regressor_gradient)) gives derivatives by position,
//! velocity and acceleration of each sample. The Fourier functions turn these into derivatives by the coefficients.

mod constraints;
mod motion;
mod motors;
mod objective;
mod penalty;
mod rows;
mod state;
mod torque;
mod wrench;

pub(super) use state::Problem;
