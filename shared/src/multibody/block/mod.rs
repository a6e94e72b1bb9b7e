//! The model mathematics over blocks of samples, written for vector registers.
//!
//! A block holds [`LANES`] samples. Every quantity is a [`Lane`]: an array with one entry per sample. Each step of a
//! recursion is one loop over the lanes, and its body is the formula for one sample without branches. Compilers turn it
//! into vector instructions of the width for which the CALLER is compiled: every function here is inlined, so a caller
//! compiled for a wider instruction set gets it throughout. The caller also chooses whether a product is rounded before
//! it is added ([`MulAdd`](crate::lanes::MulAdd)). With [`Rounded`](crate::lanes::Rounded) results are the same to the
//! last bit for any instruction set.
//!
//! Knowledge of the chain saves work in every sample. Twists of a quarter turn and zero lengths select one of a few
//! loop bodies for each joint ([`Frame`]). Parameters with the same action are grouped beforehand ([`Body`]).
//!
//! Angles beyond [`ANGLE_LIMIT`](crate::lanes::ANGLE_LIMIT) take one sample at a time: slower, equally accurate.

mod body;
mod columns;
mod forward;
mod frame;
mod inertia;
mod inverse;
mod regressor;

use core::ops::{Deref, DerefMut};

use super::spatial::Vector3;

pub use body::Body;
pub use columns::Section;
pub use forward::{NotPositive, forward_dynamics};
pub use frame::Frame;
pub use inertia::{CompositeBlock, inertia_matrix, lower};
pub use inverse::{JointBlock, inverse_dynamics};
pub use regressor::{AxisBlock, differential_regressor, energy_regressor};

/// Samples in a block.
pub const LANES: usize = 32;

/// One quantity at the samples of a block, aligned so that no vector crosses a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Lane(pub [f64; LANES]);

impl Lane {
    /// All zero.
    pub const ZERO: Self = Self([0.0; LANES]);
}

impl Deref for Lane {
    type Target = [f64; LANES];

    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Lane {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// A vector at the samples of a block.
pub type Lane3 = [Lane; 3];

/// Returns the vector of one sample.
#[inline(always)]
fn get(v: &Lane3, k: usize) -> Vector3<f64> {
    Vector3([v[0][k], v[1][k], v[2][k]])
}

/// Sets the vector of one sample.
#[inline(always)]
fn set(v: &mut Lane3, k: usize, value: Vector3<f64>) {
    let [x, y, z] = value.0;
    v[0][k] = x;
    v[1][k] = y;
    v[2][k] = z;
}

const ZERO: Lane = Lane::ZERO;
const ZERO3: Lane3 = [ZERO; 3];
