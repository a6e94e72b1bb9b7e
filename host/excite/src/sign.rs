//! The sign of a velocity, rounded off for the optimiser.

use rig_shared::scalar::Real;

use crate::lanes::L;

/// Share of the velocity limit within which the optimiser smooths the sign of the velocity, so that its gradient
/// includes the Coulomb column. The reported values use the exact sign.
pub(super) const SIGN_WIDTH: f64 = 0.01;

/// Returns the sign of a velocity, smoothed about zero.
pub(super) fn soft_sign(velocity: L, limit: f64) -> L {
    let width = L::splat(SIGN_WIDTH * limit);
    velocity / (velocity * velocity + width * width).sqrt()
}

/// Returns the derivative of [`soft_sign`] by the velocity.
pub(super) fn soft_sign_slope(velocity: L, limit: f64) -> L {
    let square = L::splat((SIGN_WIDTH * limit) * (SIGN_WIDTH * limit));
    let sum = velocity * velocity + square;
    square / (sum * sum.sqrt())
}
