//! Forward dynamics of a block.

use super::body::Body;
use super::frame::Frame;
use super::inertia::{CompositeBlock, composite_bodies, lower};
use super::inverse::{JointBlock, inverse_dynamics};
use super::lane::{LANES, Lane, ZERO};
use crate::lanes::MulAdd;

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
pub fn forward_dynamics<F: MulAdd>(
    frames: &[Frame],
    gravity: [f64; 3],
    bodies: &[Body],
    q: &[Lane],
    qd: &[Lane],
    tau: &[Lane],
    work: &mut [JointBlock],
    composite: &mut CompositeBlock,
    matrix: &mut [Lane],
    qdd: &mut [Lane],
) -> Result<(), NotPositive> {
    let n = frames.len();
    inverse_dynamics::<F>(frames, gravity, bodies, q, qd, None, work, qdd);
    composite_bodies::<F>(frames, bodies, q, work, composite, matrix);
    for (x, tau) in qdd.iter_mut().zip(tau) {
        for k in 0..LANES {
            x[k] = tau[k] - x[k];
        }
    }
    let mut failed = [u64::MAX; LANES];
    for j in 0..n {
        let mut inverse = ZERO;
        let pivot = &mut matrix[lower(j, j)];
        for k in 0..LANES {
            // NaN fails this comparison too.
            let bad = !(pivot[k] > 0.0) & (failed[k] == u64::MAX);
            failed[k] = if bad { j as u64 } else { failed[k] };
            inverse[k] = 1.0 / pivot[k];
        }
        *pivot = inverse;
        for i in j + 1..n {
            let column = matrix[lower(i, j)];
            let mut factor = ZERO;
            for k in 0..LANES {
                factor[k] = column[k] * inverse[k];
            }
            // Rows up to i still hold the column without the division; below them it is no longer needed.
            for r in j + 1..i {
                let above = matrix[lower(r, j)];
                subtract::<F>(&mut matrix[lower(i, r)], &column, &above);
            }
            subtract::<F>(&mut matrix[lower(i, i)], &column, &factor);
            matrix[lower(i, j)] = factor;
            let (before, after) = qdd.split_at_mut(i);
            subtract::<F>(&mut after[0], &before[j], &factor);
        }
    }
    for j in (0..n).rev() {
        let (before, after) = qdd.split_at_mut(j + 1);
        let x = &mut before[j];
        for k in 0..LANES {
            x[k] *= matrix[lower(j, j)][k];
        }
        for (i, later) in (j + 1..n).zip(after) {
            subtract::<F>(x, later, &matrix[lower(i, j)]);
        }
    }
    match failed.iter().position(|joint| *joint != u64::MAX) {
        None => Ok(()),
        Some(lane) => Err(NotPositive {
            lane,
            joint: failed[lane] as usize,
        }),
    }
}

/// x −= a·b
#[inline(always)]
pub(super) fn subtract<F: MulAdd>(x: &mut Lane, a: &Lane, b: &Lane) {
    for k in 0..LANES {
        x[k] = F::mul_add(-a[k], b[k], x[k]);
    }
}
