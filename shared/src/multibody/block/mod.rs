//! The model mathematics over blocks of samples, written for vector registers.
//!
//! A block holds [`LANES`] samples, every quantity as a [`Lane`]: one array, one entry a sample. Each step of a recursion is one
//! loop over the lanes whose body is the formula for one sample without branches, which compilers turn into vector
//! instructions of whatever width the CALLER is compiled for: every function here is inlined into it, so a caller compiled for a
//! wider instruction set gets it throughout. Whether a product is rounded before it goes into a sum is the caller's choice
//! ([`MulAdd`](crate::lanes::MulAdd)): with [`Rounded`](crate::lanes::Rounded) results are the same to the last bit whatever the
//! instruction set.
//!
//! What is known before the samples come saves work in every one of them: which twists are quarter turns and which
//! lengths are zero picks one of a few loop bodies for each joint ([`Frame`]), and parameters that act alike are gathered
//! in one place beforehand ([`Body`]).
//!
//! Angles beyond [`ANGLE_LIMIT`](crate::lanes::ANGLE_LIMIT) take the slow way, sample by sample, with the same accuracy.

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

/// One quantity at the samples of a block; so aligned that no vector of it straddles two lines of the cache.
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

/// The vector of one sample.
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
