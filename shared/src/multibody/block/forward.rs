//! Forward dynamics of a block.

use super::body::Body;
use super::frame::Frame;
use super::inertia::{CompositeBlock, composite_bodies, lower};
use super::inverse::{JointBlock, inverse_dynamics};
use super::lane::{LANES, Lane};
use crate::lanes::{Element, MulAdd};

/// First sample of a block with a pivot of the inertia matrix that is not positive, and the joint of that pivot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositive {
    /// Sample within the block.
    pub lane: usize,
    /// Joint, from 0 at the base.
    pub joint: usize,
}

/// Computes the accelerations under the torques `tau`: the torques without acceleration by Newton–Euler, the inertia
/// matrix by composite bodies, and its factorisation L·D·Lᵀ.
///
/// `frames`, `bodies`, `work` and the signals have one entry per joint, `matrix` has n(n + 1)/2. Returns the first lane
/// whose matrix is not positive definite (or holds a NaN); the accelerations of such lanes are invalid.
#[inline(always)]
pub fn forward_dynamics<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    gravity: [T; 3],
    bodies: &[Body<T>],
    q: &[Lane<T>],
    qd: &[Lane<T>],
    tau: &[Lane<T>],
    work: &mut [JointBlock<T>],
    composite: &mut CompositeBlock<T>,
    matrix: &mut [Lane<T>],
    qdd: &mut [Lane<T>],
) -> Result<(), NotPositive> {
    let n = frames.len();
    inverse_dynamics::<T, F>(frames, gravity, bodies, q, qd, None, work, qdd);
    composite_bodies::<T, F>(frames, bodies, q, work, composite, matrix);
    for (x, tau) in qdd.iter_mut().zip(tau) {
        for k in 0..LANES {
            x[k] = tau[k] - x[k];
        }
    }
    // The joint as a number of the same size as the lanes.
    let none = -T::ONE;
    let mut failed = [none; LANES];
    for j in 0..n {
        let mut inverse = Lane::ZERO;
        let number = T::from_u32(j as u32);
        let pivot = &mut matrix[lower(j, j)];
        for k in 0..LANES {
            // NaN fails this comparison too.
            let bad = !(pivot[k] > T::ZERO) & (failed[k] == none);
            failed[k] = if bad { number } else { failed[k] };
            inverse[k] = T::ONE / pivot[k];
        }
        *pivot = inverse;
        for i in j + 1..n {
            let column = matrix[lower(i, j)];
            let mut factor = Lane::ZERO;
            for k in 0..LANES {
                factor[k] = column[k] * inverse[k];
            }
            // Rows up to i still hold the column without the division; below them it is no longer needed.
            for r in j + 1..i {
                let above = matrix[lower(r, j)];
                subtract::<T, F>(&mut matrix[lower(i, r)], &column, &above);
            }
            subtract::<T, F>(&mut matrix[lower(i, i)], &column, &factor);
            matrix[lower(i, j)] = factor;
            let (before, after) = qdd.split_at_mut(i);
            subtract::<T, F>(&mut after[0], &before[j], &factor);
        }
    }
    for j in (0..n).rev() {
        let (before, after) = qdd.split_at_mut(j + 1);
        let x = &mut before[j];
        for k in 0..LANES {
            x[k] *= matrix[lower(j, j)][k];
        }
        for (i, later) in (j + 1..n).zip(after) {
            subtract::<T, F>(x, later, &matrix[lower(i, j)]);
        }
    }
    match failed.iter().position(|joint| *joint != none) {
        None => Ok(()),
        Some(lane) => Err(NotPositive {
            lane,
            joint: failed[lane].to_f64() as usize,
        }),
    }
}

/// x −= a·b
#[inline(always)]
pub(super) fn subtract<T: Element, F: MulAdd<T>>(x: &mut Lane<T>, a: &Lane<T>, b: &Lane<T>) {
    for k in 0..LANES {
        x[k] = F::mul_add(-a[k], b[k], x[k]);
    }
}
