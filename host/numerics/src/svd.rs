//! Singular value decomposition by one-sided Jacobi rotations.
//!
//! Pairs of columns are turned until all are orthogonal (Hestenes 1958). Small singular values are as exact relative to their size
//! as large ones (Demmel and Veselić 1992). The decomposition of nalgebra 0.35 leaves a residual of up to a thousandth of the
//! matrix in one of some hundred matrices ([issue 1172](https://github.com/dimforge/nalgebra/issues/1172)), so it is not used.
//!
//! Leaves out: complex matrices, and speed for hundreds of columns. 60 columns take some milliseconds.

use nalgebra::allocator::Allocator;
use nalgebra::{DMatrix, DVector, DefaultAllocator, Dim, Dyn, OMatrix};

/// Most passes over all pairs of columns. Ten are enough for 130 columns; a pass beyond changes nothing.
const PASSES: usize = 60;

/// A = U·diag(σ)·Vᵀ of a matrix with m rows and n columns, with k = min(m, n).
#[derive(Clone, Debug, PartialEq)]
pub struct Svd {
    /// U, m × k; its columns are orthonormal, and zero where the singular value is zero.
    pub u: DMatrix<f64>,
    /// σ, k values, the largest first.
    pub singular_values: DVector<f64>,
    /// Vᵀ, k × n; its rows are orthonormal.
    pub v_t: DMatrix<f64>,
}

impl Svd {
    /// Decomposes a matrix. What is not finite stays not finite in the result.
    pub fn of(matrix: DMatrix<f64>) -> Self {
        let (rows, columns) = matrix.shape();
        if rows < columns {
            let other = Self::of(matrix.transpose());
            // Rows of Vᵀ are those of the transposed U, which are zero for singular values of zero.
            return Self {
                u: other.v_t.transpose(),
                singular_values: other.singular_values,
                v_t: other.u.transpose(),
            };
        }
        if columns == 0 {
            return Self {
                u: matrix,
                singular_values: DVector::zeros(0),
                v_t: DMatrix::zeros(0, 0),
            };
        }
        let qr = matrix.qr();
        let (mut turned, mut v) = (qr.r(), DMatrix::identity(columns, columns));
        for _ in 0..PASSES {
            if !pass(&mut turned, &mut v) {
                break;
            }
        }
        let sizes: Vec<f64> = turned.column_iter().map(|c| c.norm()).collect();
        let mut order: Vec<usize> = (0..columns).collect();
        order.sort_by(|a, b| sizes[*b].total_cmp(&sizes[*a]));
        let mut u = qr.q() * turned.select_columns(&order);
        for (mut column, k) in u.column_iter_mut().zip(&order) {
            if sizes[*k] > 0.0 {
                column /= sizes[*k];
            }
        }
        Self {
            u,
            singular_values: DVector::from_iterator(columns, order.iter().map(|k| sizes[*k])),
            v_t: v.select_columns(&order).transpose(),
        }
    }

    /// Returns the least-squares solution x of A·x = b with the least norm; singular values up to `least` count as zero.
    pub fn solve<C: Dim>(&self, b: &OMatrix<f64, Dyn, C>, least: f64) -> OMatrix<f64, Dyn, C>
    where
        DefaultAllocator: Allocator<Dyn, C>,
    {
        let mut along = self.u.tr_mul(b);
        for (mut row, s) in along.row_iter_mut().zip(self.singular_values.iter()) {
            row *= if *s > least { 1.0 / s } else { 0.0 };
        }
        self.v_t.tr_mul(&along)
    }

    /// Returns the pseudo-inverse, n × m; singular values up to `least` count as zero.
    pub fn pseudo_inverse(&self, least: f64) -> DMatrix<f64> {
        let rows = self.u.nrows();
        self.solve(&DMatrix::identity(rows, rows), least)
    }
}

/// Turns each pair of columns of `a` until it is orthogonal, and those of `v` alike; returns true if any was not.
fn pass(a: &mut DMatrix<f64>, v: &mut DMatrix<f64>) -> bool {
    let count = a.ncols();
    let exact = f64::EPSILON * (count as f64).sqrt();
    let mut is_turned = false;
    for p in 0..count {
        for q in p + 1..count {
            let [aa, bb] = [p, q].map(|k| a.column(k).norm_squared());
            let ab = a.column(p).dot(&a.column(q));
            if !(ab.abs() > exact * aa.sqrt() * bb.sqrt()) {
                continue;
            }
            is_turned = true;
            let zeta = (bb - aa) / (2.0 * ab);
            let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            for matrix in [&mut *a, &mut *v] {
                turn(matrix, [p, q], [cosine, cosine * tangent]);
            }
        }
    }
    is_turned
}

/// Turns two columns, p < q, in their plane.
fn turn(matrix: &mut DMatrix<f64>, [p, q]: [usize; 2], [cosine, sine]: [f64; 2]) {
    let rows = matrix.nrows();
    let (before, after) = matrix.as_mut_slice().split_at_mut(q * rows);
    let first = &mut before[p * rows..(p + 1) * rows];
    for (x, y) in first.iter_mut().zip(&mut after[..rows]) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn drawn(random: &mut rand_pcg::Pcg64, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| random.random::<f64>() - 0.5)
    }

    /// Matrices with known singular values: the decomposition gives these and the matrix back. That of nalgebra fails in some of
    /// them.
    #[test]
    fn singular_values_and_matrix_come_back() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        for (rows, columns, condition) in [
            (1, 1, 1.0),
            (3, 3, 1e3),
            (10, 10, 1e3),
            (46, 20, 1e6),
            (20, 46, 1e6),
            (60, 60, 1e12),
        ] {
            for _ in 0..60 {
                let least = rows.min(columns);
                let left = drawn(&mut random, rows, least).qr().q();
                let right = drawn(&mut random, columns, least).qr().q();
                let mut values: Vec<f64> = (0..least)
                    .map(|_| f64::powf(condition, -random.random::<f64>()))
                    .collect();
                values.sort_by(|a, b| b.total_cmp(a));
                let sizes = DVector::from_column_slice(&values);
                let matrix = left * DMatrix::from_diagonal(&sizes) * right.transpose();
                let found = Svd::of(matrix.clone());
                let again = &found.u * DMatrix::from_diagonal(&found.singular_values) * &found.v_t;
                assert!((again - &matrix).norm() < 1e-14 * least as f64 * matrix.norm());
                let own = found.v_t.clone() * found.v_t.transpose();
                assert!((own - DMatrix::identity(least, least)).norm() < 1e-12);
                // Rounding of the product above is relative to the largest value.
                assert!((found.singular_values - sizes).amax() < 1e-13);
            }
        }
    }

    /// Columns of unlike length: the smallest singular value is exact relative to its own size.
    #[test]
    fn small_singular_values_are_exact_relative_to_their_size() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(2);
        for _ in 0..50 {
            let mut matrix = drawn(&mut random, 12, 4).qr().q();
            let sizes = [1.0, 1e-6, 1e-12, 1e-18];
            for (mut column, size) in matrix.column_iter_mut().zip(sizes) {
                column *= size;
            }
            let found = Svd::of(matrix);
            for (own, size) in found.singular_values.iter().zip(sizes) {
                assert!((own / size - 1.0).abs() < 1e-13, "{own} {size}");
            }
        }
    }

    /// A system with a direction that it does not determine has the solution of least norm, as the normal equations give it.
    #[test]
    fn solutions_have_the_least_norm() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let mut matrix = drawn(&mut random, 9, 5);
        let twin = matrix.column(0) * 2.0;
        matrix.set_column(4, &twin);
        let right = DVector::from_fn(9, |_, _| random.random::<f64>());
        let x = Svd::of(matrix.clone()).solve(&right, 1e-12);
        // The residual is orthogonal to all columns, x to the undetermined direction.
        assert!(matrix.tr_mul(&(&right - &matrix * &x)).norm() < 1e-13);
        assert!((x[4] - 2.0 * x[0]).abs() < 1e-13, "{x}");
        let inverse = Svd::of(matrix.clone()).pseudo_inverse(1e-12);
        assert!((&matrix * &inverse * &matrix - &matrix).norm() < 1e-13);
        assert!((inverse * right - x).norm() < 1e-13);
    }

    #[test]
    fn nothing_and_zeros_have_no_size() {
        assert_eq!(Svd::of(DMatrix::zeros(3, 0)).singular_values.len(), 0);
        let zero = Svd::of(DMatrix::zeros(3, 2));
        assert_eq!(zero.singular_values.amax(), 0.0);
        assert_eq!(zero.pseudo_inverse(0.0), DMatrix::zeros(2, 3));
        let mut broken = DMatrix::zeros(2, 2);
        broken[(0, 0)] = f64::NAN;
        assert!(Svd::of(broken).singular_values.iter().any(|s| s.is_nan()));
    }
}
