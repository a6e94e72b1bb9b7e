//! Accumulation of a triangular factor: least squares over any number of rows in constant memory.

use rig_numerics::vector::{axpy, dot};

/// Number of rows reduced together: with a few dozen columns they fit in the second-level cache.
const BLOCK_ROWS: usize = 128;

/// The upper triangular R of a QR factorisation of all rows so far, each row `[x | y]`.
///
/// Rows are collected in blocks. A full block is stacked under R, and Householder reflections make the stack triangular
/// again (Golub & Van Loan, Matrix Computations, §5.2 and §6.5.2; the sequential TSQR of Demmel et al. 2012). No normal
/// equations are formed, so the condition number is not squared.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangularFactor {
    width: usize,
    /// Column-major, `width` × `width`, upper triangle.
    r: Vec<f64>,
    /// Column-major, [`BLOCK_ROWS`] × `width`.
    block: Vec<f64>,
    filled: usize,
    rows: u64,
}

impl TriangularFactor {
    /// Creates a factor for rows of `columns` regressor entries and one right-hand side.
    pub fn new(columns: usize) -> Self {
        let width = columns + 1;
        Self {
            width,
            r: vec![0.0; width * width],
            block: vec![0.0; BLOCK_ROWS * width],
            filled: 0,
            rows: 0,
        }
    }

    /// Returns the number of regressor columns.
    pub fn columns(&self) -> usize {
        self.width - 1
    }

    /// Returns the number of rows so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Adds one row `weight·[x | y]`; `x` has [`Self::columns`] entries (more are ignored, fewer leave zeros).
    pub fn push(&mut self, x: &[f64], y: f64, weight: f64) {
        let row = self.filled;
        let columns = self.columns();
        for (c, value) in x.iter().take(columns).enumerate() {
            self.block[c * BLOCK_ROWS + row] = weight * value;
        }
        self.block[columns * BLOCK_ROWS + row] = weight * y;
        self.filled += 1;
        self.rows += 1;
        if self.filled == BLOCK_ROWS {
            self.reduce();
        }
    }

    /// Adds all rows of another factor, each scaled by `weight`.
    pub fn merge(&mut self, other: &Self, weight: f64) {
        let mut other = other.clone();
        other.reduce();
        let rows = self.rows + other.rows;
        let width = self.width;
        let mut row = vec![0.0; width];
        for i in 0..width {
            for (j, value) in row.iter_mut().enumerate() {
                *value = other.r[j * width + i];
            }
            self.push(&row[..width - 1], row[width - 1], weight);
        }
        self.rows = rows;
    }

    fn reduce(&mut self) {
        let (width, filled) = (self.width, self.filled);
        for j in 0..width {
            let (head, tail) = self.block.split_at_mut((j + 1) * BLOCK_ROWS);
            let v = &mut head[j * BLOCK_ROWS..j * BLOCK_ROWS + filled];
            let diagonal = self.r[j * width + j];
            let below = dot(v, v);
            if below == 0.0 {
                continue;
            }
            let norm = (diagonal * diagonal + below).sqrt();
            let beta = if diagonal > 0.0 { -norm } else { norm };
            // Reflection I − τ·[1; v]·[1; v]ᵀ, v scaled so that its first entry is one.
            let first = diagonal - beta;
            let tau = -first / beta;
            for x in v.iter_mut() {
                *x /= first;
            }
            self.r[j * width + j] = beta;
            for (k, column) in tail.chunks_exact_mut(BLOCK_ROWS).enumerate() {
                let column = &mut column[..filled];
                let top = &mut self.r[(j + 1 + k) * width + j];
                let projection = tau * (*top + dot(v, column));
                *top -= projection;
                axpy(-projection, v, column);
            }
        }
        self.filled = 0;
    }

    /// Returns R, column-major, (columns + 1)². The last column belongs to the right-hand side; its last entry is,
    /// apart from the sign, the norm of the residual.
    pub fn triangle(&self) -> Vec<f64> {
        let mut whole = self.clone();
        whole.reduce();
        let width = self.width;
        for j in 0..width {
            for i in j + 1..width {
                whole.r[j * width + i] = 0.0;
            }
        }
        whole.r
    }

    /// Returns the regressor's part of R and the right-hand side Qᵀy, as matrices.
    pub fn system(&self) -> (nalgebra::DMatrix<f64>, nalgebra::DVector<f64>) {
        let columns = self.columns();
        let all = nalgebra::DMatrix::from_vec(self.width, self.width, self.triangle());
        (
            all.view((0, 0), (columns, columns)).into_owned(),
            all.view((0, columns), (columns, 1)).column(0).into_owned(),
        )
    }

    /// Returns the sum of squared residuals of the parameters `x` over all rows.
    pub fn residual_squares(&self, x: &[f64]) -> f64 {
        let r = self.triangle();
        let (width, columns) = (self.width, self.columns());
        (0..width)
            .map(|i| {
                let model: f64 = (0..columns.min(x.len()))
                    .map(|j| r[j * width + i] * x[j])
                    .sum();
                (r[columns * width + i] - model).powi(2)
            })
            .sum()
    }

    /// Returns the sum of squares of the right-hand side.
    pub fn right_side_squares(&self) -> f64 {
        self.residual_squares(&[])
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rig_numerics::svd::Svd;

    #[test]
    fn accumulated_factor_solves_as_the_whole_matrix_does() {
        let mut g = rand_pcg::Pcg64::seed_from_u64(3);
        for rows in [5usize, 127, 128, 129, 1000] {
            let a = DMatrix::from_fn(rows, 5, |_, j| {
                (g.random::<f64>() - 0.5) * 10f64.powi(j as i32 - 2)
            });
            let y = DVector::from_fn(rows, |_, _| g.random::<f64>());
            let mut factor = TriangularFactor::new(5);
            let (mut upper, mut lower) = (TriangularFactor::new(5), TriangularFactor::new(5));
            for i in 0..rows {
                let row: Vec<f64> = a.row(i).iter().copied().collect();
                factor.push(&row, y[i], 1.0);
                if i % 3 == 0 { &mut upper } else { &mut lower }.push(&row, y[i], 1.0);
            }
            upper.merge(&lower, 1.0);
            assert_eq!(upper.rows(), rows as u64);
            let expected = Svd::of(a.clone()).solve(&y, 0.0);
            for f in [&factor, &upper] {
                let (r, z) = f.system();
                let x = r.clone().solve_upper_triangular(&z).unwrap();
                assert!((&x - &expected).norm() < 1e-9 * expected.norm());
                let residual = (&a * &expected - &y).norm_squared();
                assert!(
                    (f.residual_squares(x.as_slice()) - residual).abs() < 1e-10 * y.norm_squared()
                );
                assert!(
                    (r.transpose() * &r - a.transpose() * &a).norm() < 1e-10 * (a.norm().powi(2))
                );
            }
        }
    }

    #[test]
    fn a_matrix_that_normal_equations_cannot_solve() {
        // Läuchli's matrix: with ε = 1e-9, 1 + ε² rounds to one and AᵀA is singular.
        let e = 1e-9;
        let mut factor = TriangularFactor::new(3);
        for (row, y) in [
            ([1.0, 1.0, 1.0], 6.0),
            ([e, 0.0, 0.0], e),
            ([0.0, e, 0.0], 2.0 * e),
            ([0.0, 0.0, e], 3.0 * e),
        ] {
            factor.push(&row, y, 1.0);
        }
        let (r, z) = factor.system();
        let x = r.solve_upper_triangular(&z).unwrap();
        for (found, expected) in x.iter().zip([1.0, 2.0, 3.0]) {
            assert!((found - expected).abs() < 1e-5, "{x}");
        }
    }
}
