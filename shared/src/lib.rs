//! The mathematics of the rig: one source for the microcontroller, the desktop and wide batches.
#![no_std]

#[cfg(test)]
extern crate std;

mod cholesky;
pub mod compensation;
pub mod control;
pub mod drive;
pub mod dual;
pub mod effects;
pub mod encoder;
pub mod estimation;
pub mod friction;
mod hyperbolic;
pub mod lanes;
pub mod link;
pub mod model;
pub mod multibody;
pub mod precompensation;
pub mod safety;
pub mod scalar;
mod sincos;
pub mod trajectory;
pub mod transmission;
pub mod units;
pub mod wire;
