//! Small linear systems, lane by lane, without branches on values.

use crate::multibody::MAX_JOINTS;
use crate::scalar::{Mask, Real};

/// Smallest pivot that counts as non-zero, as a share of the largest entry of its column. Ratios of real drives lie
/// within 10⁴ of each other, and rounding of `f32` in a few operations is 10⁻⁶.
pub(super) const SINGULAR: f64 = 1e-7;

/// LU factors of an n × n matrix, L·U = P·M, with the row exchanges.
pub(super) struct Factors<T> {
    entries: [[T; MAX_JOINTS]; MAX_JOINTS],
    /// Row exchanges as weights 0 and 1: 1 at (i, j) if step j exchanged row i > j with row j.
    exchanged: [[T; MAX_JOINTS]; MAX_JOINTS],
    n: usize,
}

impl<T: Real> Factors<T> {
    /// Factors a row-major matrix. Returns none if a lane has no valid pivot.
    pub(super) fn of(matrix: &[T], n: usize) -> Option<Self> {
        let mut f = Self {
            entries: [[T::ZERO; MAX_JOINTS]; MAX_JOINTS],
            exchanged: [[T::ZERO; MAX_JOINTS]; MAX_JOINTS],
            n,
        };
        // Largest entry of each column: the scale of its pivot.
        let mut largest = [T::ZERO; MAX_JOINTS];
        for i in 0..n {
            for j in 0..n {
                let value = matrix[i * n + j];
                f.entries[i][j] = value;
                largest[j] = largest[j].max(value.abs());
            }
        }
        for j in 0..n {
            for i in j + 1..n {
                let better = f.entries[j][j].abs().lt(f.entries[i][j].abs());
                f.exchanged[i][j] = T::select(better, T::ONE, T::ZERO);
                for k in 0..n {
                    let (upper, lower) = (f.entries[j][k], f.entries[i][k]);
                    f.entries[j][k] = T::select(better, lower, upper);
                    f.entries[i][k] = T::select(better, upper, lower);
                }
            }
            let pivot = f.entries[j][j];
            // NaN fails this comparison too.
            if !(T::from_f64(SINGULAR) * largest[j]).lt(pivot.abs()).all() {
                return None;
            }
            for i in j + 1..n {
                let factor = f.entries[i][j] / pivot;
                f.entries[i][j] = factor;
                for k in j + 1..n {
                    let above = f.entries[j][k];
                    f.entries[i][k] -= factor * above;
                }
            }
        }
        Some(f)
    }

    /// Replaces the right-hand side by the solution.
    pub(super) fn solve(&self, x: &mut [T]) {
        let n = self.n;
        for j in 0..n {
            for i in j + 1..n {
                self.exchange(x, i, j);
            }
        }
        for i in 0..n {
            for j in 0..i {
                let above = x[j];
                x[i] -= self.entries[i][j] * above;
            }
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                let below = x[j];
                x[i] -= self.entries[i][j] * below;
            }
            x[i] /= self.entries[i][i];
        }
    }

    /// Replaces the right-hand side by the solution for the transposed matrix.
    pub(super) fn solve_transposed(&self, x: &mut [T]) {
        let n = self.n;
        for i in 0..n {
            for j in 0..i {
                let above = x[j];
                x[i] -= self.entries[j][i] * above;
            }
            x[i] /= self.entries[i][i];
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                let below = x[j];
                x[i] -= self.entries[j][i] * below;
            }
        }
        for j in (0..n).rev() {
            for i in (j + 1..n).rev() {
                self.exchange(x, i, j);
            }
        }
    }

    #[inline(always)]
    fn exchange(&self, x: &mut [T], i: usize, j: usize) {
        let better = T::from_f64(0.5).lt(self.exchanged[i][j]);
        let (upper, lower) = (x[j], x[i]);
        x[j] = T::select(better, lower, upper);
        x[i] = T::select(better, upper, lower);
    }
}
