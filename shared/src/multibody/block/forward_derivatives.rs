//! Derivatives of the forward dynamics of a block.
//!
//! With the inertia matrix A and the torques ID(q, q̇, q̈) of the motion, ∂q̈/∂q = −A⁻¹·∂ID/∂q, ∂q̈/∂q̇ = −A⁻¹·∂ID/∂q̇ and
//! ∂q̈/∂τ = A⁻¹ (Carpentier & Mansard 2018, sec. V).

use super::body::Body;
use super::columns::{Columns, Section};
use super::derivatives::{DerivativeBlock, derivatives};
use super::forward::{NotPositive, forward_dynamics, subtract};
use super::frame::Frame;
use super::inertia::{CompositeBlock, lower};
use super::inverse::JointBlock;
use super::lane::{LANES, Lane};
use crate::lanes::{Element, MulAdd};

/// Returns the number of buffers that the derivatives of the forward dynamics of `n` joints need.
#[must_use]
pub const fn derivative_buffers(n: usize) -> usize {
    n + 2 * lower(n, 0) + 2 * n * n
}

/// Computes the derivatives of the accelerations under the torques `tau` by position, velocity and torque.
///
/// `frames`, `bodies`, `joints`, `work` and the signals q, q̇, τ have one entry per joint, `buffer` has
/// [`derivative_buffers`]. Column i·n + j of `by_position` and `by_velocity` is ∂q̈_i/∂q_j and ∂q̈_i/∂q̇_j; `by_torque` has the lower triangle of the
/// inverse of the inertia matrix. Errors as [`forward_dynamics`].
#[inline(always)]
pub fn forward_dynamics_derivatives<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    gravity: [T; 3],
    bodies: &[Body<T>],
    [q, qd, tau]: [&[Lane<T>]; 3],
    joints: &mut [JointBlock<T>],
    composite: &mut CompositeBlock<T>,
    work: &mut [DerivativeBlock<T>],
    buffer: &mut [Lane<T>],
    by_position: &mut Section<T>,
    by_velocity: &mut Section<T>,
    by_torque: &mut Section<T>,
) -> Result<(), NotPositive> {
    let n = frames.len();
    let (qdd, rest) = buffer.split_at_mut(n);
    let (factor, rest) = rest.split_at_mut(lower(n, 0));
    let (inertia, rest) = rest.split_at_mut(lower(n, 0));
    let (by_q, by_qd) = rest.split_at_mut(n * n);
    let by_qd = &mut by_qd[..n * n];
    forward_dynamics::<T, F>(
        frames, gravity, bodies, q, qd, tau, joints, composite, factor, qdd,
    )?;
    derivatives::<T, F>(
        frames,
        gravity,
        bodies,
        [q, qd, qdd],
        work,
        by_q,
        by_qd,
        inertia,
    );
    invert::<T, F>(n, factor, inertia);
    for (c, entry) in inertia.iter().enumerate() {
        *by_torque.lane(c) = entry.0;
    }
    // As many samples at once as keep their sums in registers.
    if size_of::<T>() == size_of::<f64>() {
        multiply_negative::<T, F, 8>(n, inertia, by_q, by_position);
        multiply_negative::<T, F, 8>(n, inertia, by_qd, by_velocity);
    } else {
        multiply_negative::<T, F, 16>(n, inertia, by_q, by_position);
        multiply_negative::<T, F, 16>(n, inertia, by_qd, by_velocity);
    }
    Ok(())
}

/// Writes −A⁻¹·X, row by row, from the lower triangle of A⁻¹ and the n×n matrix X, `WIDTH` samples at once.
#[inline(always)]
fn multiply_negative<T: Element, F: MulAdd<T>, const WIDTH: usize>(
    n: usize,
    inverse: &[Lane<T>],
    x: &[Lane<T>],
    out: &mut Section<T>,
) {
    for i in 0..n {
        let mut c = 0;
        while c < n {
            c += match n - c {
                1 => products::<T, F, WIDTH, 1>(n, i, c, inverse, x, out),
                2 => products::<T, F, WIDTH, 2>(n, i, c, inverse, x, out),
                3 => products::<T, F, WIDTH, 3>(n, i, c, inverse, x, out),
                _ => products::<T, F, WIDTH, 4>(n, i, c, inverse, x, out),
            };
        }
    }
}

/// Writes the entries (i, first) to (i, first + N − 1); returns N.
#[inline(always)]
fn products<T: Element, F: MulAdd<T>, const WIDTH: usize, const N: usize>(
    n: usize,
    i: usize,
    first: usize,
    inverse: &[Lane<T>],
    x: &[Lane<T>],
    out: &mut Section<T>,
) -> usize {
    let mut entries = out.lanes::<N>(i * n + first);
    for at in (0..LANES).step_by(WIDTH) {
        let mut sums = [[T::ZERO; WIDTH]; N];
        for j in 0..n {
            let factor = &inverse[lower(i.max(j), i.min(j))].as_chunks::<WIDTH>().0[at / WIDTH];
            let row = &x[j * n + first..j * n + first + N];
            for (sum, x) in sums.iter_mut().zip(row) {
                let x = &x.as_chunks::<WIDTH>().0[at / WIDTH];
                for k in 0..WIDTH {
                    sum[k] = F::mul_add(-factor[k], x[k], sum[k]);
                }
            }
        }
        for (entry, sum) in entries.iter_mut().zip(&sums) {
            entry[at..at + WIDTH].copy_from_slice(sum);
        }
    }
    N
}

/// Writes the lower triangle of A⁻¹, from the factor of A.
#[inline(always)]
fn invert<T: Element, F: MulAdd<T>>(n: usize, factor: &[Lane<T>], out: &mut [Lane<T>]) {
    // Column c: L·y = e_c from row c on, then Lᵀ·x = y/D back to row c.
    for c in 0..n {
        out[lower(c, c)].fill(T::ONE);
        for i in c + 1..n {
            let (before, entry) = out.split_at_mut(lower(i, c));
            let entry = &mut entry[0];
            entry.fill(T::ZERO);
            for j in c..i {
                subtract::<T, F>(entry, &before[lower(j, c)], &factor[lower(i, j)]);
            }
        }
        for j in (c..n).rev() {
            let (before, after) = out.split_at_mut(lower(j, c) + 1);
            let entry = &mut before[lower(j, c)];
            for k in 0..LANES {
                entry[k] *= factor[lower(j, j)][k];
            }
            for i in j + 1..n {
                let later = &after[lower(i, c) - lower(j, c) - 1];
                subtract::<T, F>(entry, later, &factor[lower(i, j)]);
            }
        }
    }
}
