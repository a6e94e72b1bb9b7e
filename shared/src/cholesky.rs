//! Cholesky's factorisation of small symmetric matrices, row-major.

use crate::scalar::{Mask, Real};

/// Replaces the lower triangle of an n × n matrix A by its factor L, A = L·Lᵀ.
///
/// # Errors
/// The row (from 0) of the first pivot that is not above zero, or NaN.
pub(crate) fn factorise<T: Real>(matrix: &mut [T], n: usize) -> Result<(), usize> {
    for j in 0..n {
        let mut pivot = matrix[j * n + j];
        for k in 0..j {
            pivot -= matrix[j * n + k].squared();
        }
        // NaN fails this comparison too.
        if !T::ZERO.lt(pivot).all() {
            return Err(j);
        }
        let root = pivot.sqrt();
        matrix[j * n + j] = root;
        for i in j + 1..n {
            let mut value = matrix[i * n + j];
            for k in 0..j {
                value -= matrix[i * n + k] * matrix[j * n + k];
            }
            matrix[i * n + j] = value / root;
        }
    }
    Ok(())
}

/// Replaces `x` by the solution of L·Lᵀ·y = x; `factor` is that of [`factorise`].
pub(crate) fn solve<T: Real>(factor: &[T], x: &mut [T]) {
    let n = x.len();
    for i in 0..n {
        let mut value = x[i];
        for k in 0..i {
            value -= factor[i * n + k] * x[k];
        }
        x[i] = value / factor[i * n + i];
    }
    for i in (0..n).rev() {
        let mut value = x[i];
        for k in i + 1..n {
            value -= factor[k * n + i] * x[k];
        }
        x[i] = value / factor[i * n + i];
    }
}
