//! A quantity at all samples of a block.

use core::ops::{Deref, DerefMut};

use super::super::spatial::Vector3;
use crate::lanes::Element;

/// Samples in a block, of `f64` or `f32`.
///
/// With 64 inverse and forward dynamics of `f32` take 13 to 25 % less time, but the derivatives of inverse dynamics of
/// `f64` 7 to 17 % more: the buffers of seven joints then no longer fit into the nearest caches (EPYC, AVX-512).
pub const LANES: usize = 32;

/// One quantity at the samples of a block, aligned so that no vector crosses a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Lane<T>(pub [T; LANES]);

impl<T: Element> Lane<T> {
    /// All zero.
    pub const ZERO: Self = Self([T::ZERO; LANES]);
}

impl<T> Deref for Lane<T> {
    type Target = [T; LANES];

    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<T> DerefMut for Lane<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

/// A vector at the samples of a block.
pub type Lane3<T> = [Lane<T>; 3];

/// Returns the vector of one sample.
#[inline(always)]
pub(super) fn get<T: Copy>(v: &Lane3<T>, k: usize) -> Vector3<T> {
    Vector3([v[0][k], v[1][k], v[2][k]])
}

/// Sets the vector of one sample.
#[inline(always)]
pub(super) fn set<T: Copy>(v: &mut Lane3<T>, k: usize, value: Vector3<T>) {
    let [x, y, z] = value.0;
    v[0][k] = x;
    v[1][k] = y;
    v[2][k] = z;
}
