//! A quantity at all samples of a block.

use core::ops::{Deref, DerefMut};

use super::super::spatial::Vector3;

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
pub(super) fn get(v: &Lane3, k: usize) -> Vector3<f64> {
    Vector3([v[0][k], v[1][k], v[2][k]])
}

/// Sets the vector of one sample.
#[inline(always)]
pub(super) fn set(v: &mut Lane3, k: usize, value: Vector3<f64>) {
    let [x, y, z] = value.0;
    v[0][k] = x;
    v[1][k] = y;
    v[2][k] = z;
}

pub(super) const ZERO: Lane = Lane::ZERO;
pub(super) const ZERO3: Lane3 = [ZERO; 3];
