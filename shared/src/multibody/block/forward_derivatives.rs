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
use crate::lanes::MulAdd;

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
pub fn forward_dynamics_derivatives<F: MulAdd>(
    frames: &[Frame],
    gravity: [f64; 3],
    bodies: &[Body],
    [q, qd, tau]: [&[Lane]; 3],
    joints: &mut [JointBlock],
    composite: &mut CompositeBlock,
    work: &mut [DerivativeBlock],
    buffer: &mut [Lane],
    by_position: &mut Section,
    by_velocity: &mut Section,
    by_torque: &mut Section,
) -> Result<(), NotPositive> {
    let n = frames.len();
    let (qdd, rest) = buffer.split_at_mut(n);
    let (factor, rest) = rest.split_at_mut(lower(n, 0));
    let (inertia, rest) = rest.split_at_mut(lower(n, 0));
    let (by_q, by_qd) = rest.split_at_mut(n * n);
    let by_qd = &mut by_qd[..n * n];
    forward_dynamics::<F>(
        frames, gravity, bodies, q, qd, tau, joints, composite, factor, qdd,
    )?;
    derivatives::<F>(
        frames,
        gravity,
        bodies,
        [q, qd, qdd],
        work,
        by_q,
        by_qd,
        inertia,
    );
    invert::<F>(n, factor, inertia);
    for (c, entry) in inertia.iter().enumerate() {
        *by_torque.lane(c) = entry.0;
    }
    multiply_negative::<F>(n, inertia, by_q, by_position);
    multiply_negative::<F>(n, inertia, by_qd, by_velocity);
    Ok(())
}

/// Samples that a product takes at once: their sums stay in registers.
const WIDTH: usize = 8;

/// Writes −A⁻¹·X, row by row, from the lower triangle of A⁻¹ and the n×n matrix X.
#[inline(always)]
fn multiply_negative<F: MulAdd>(n: usize, inverse: &[Lane], x: &[Lane], out: &mut Section) {
    for i in 0..n {
        let mut c = 0;
        while c < n {
            c += match n - c {
                1 => products::<F, 1>(n, i, c, inverse, x, out),
                2 => products::<F, 2>(n, i, c, inverse, x, out),
                3 => products::<F, 3>(n, i, c, inverse, x, out),
                _ => products::<F, 4>(n, i, c, inverse, x, out),
            };
        }
    }
}

/// Writes the entries (i, first) to (i, first + N − 1); returns N.
#[inline(always)]
fn products<F: MulAdd, const N: usize>(
    n: usize,
    i: usize,
    first: usize,
    inverse: &[Lane],
    x: &[Lane],
    out: &mut Section,
) -> usize {
    let mut entries = out.lanes::<N>(i * n + first);
    for at in (0..LANES).step_by(WIDTH) {
        let mut sums = [[0.0; WIDTH]; N];
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
fn invert<F: MulAdd>(n: usize, factor: &[Lane], out: &mut [Lane]) {
    // Column c: L·y = e_c from row c on, then Lᵀ·x = y/D back to row c.
    for c in 0..n {
        out[lower(c, c)].fill(1.0);
        for i in c + 1..n {
            let (before, entry) = out.split_at_mut(lower(i, c));
            let entry = &mut entry[0];
            entry.fill(0.0);
            for j in c..i {
                subtract::<F>(entry, &before[lower(j, c)], &factor[lower(i, j)]);
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
                subtract::<F>(entry, later, &factor[lower(i, j)]);
            }
        }
    }
}
