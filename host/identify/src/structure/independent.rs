//! Independent columns of a matrix.

use nalgebra::DMatrix;

/// Independent columns of a matrix, and the dependent ones as combinations of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Independent {
    /// Kept columns, in ascending order.
    pub kept: Vec<usize>,
    /// Kept × all columns: column j = Σ kept columns · entries of column j. Identity on the kept ones.
    pub combination: DMatrix<f64>,
    /// Smallest remainder of a kept column and largest of a dropped one, each relative to the column.
    pub remainders: (f64, f64),
    /// Remainder of every column relative to its length; 0 for a column of zeros.
    pub remainder: Vec<f64>,
}

/// Visits the columns of `matrix` in `order` and keeps each that is not a combination of the ones kept before, to
/// within `tolerance` of its length: a QR factorisation pivoted by preference (Gautier 1991). Columns shorter than
/// 1e-12 of the longest count as zero.
pub fn independent_columns(matrix: &DMatrix<f64>, order: &[usize], tolerance: f64) -> Independent {
    let all = matrix.ncols();
    let longest = (0..all)
        .map(|c| matrix.column(c).norm())
        .fold(0.0, f64::max);
    let mut basis: Vec<nalgebra::DVector<f64>> = Vec::new();
    let mut visited: Vec<usize> = Vec::new();
    // Coordinates of every column in the orthonormal basis, extended as the basis grows.
    let mut coordinates: Vec<Vec<f64>> = vec![Vec::new(); all];
    let (mut least_kept, mut most_dropped) = (f64::INFINITY, 0.0f64);
    let mut remainder = vec![0.0; all];
    for &c in order {
        let length = matrix.column(c).norm();
        if length <= 1e-12 * longest || length.is_nan() {
            continue;
        }
        let mut rest = matrix.column(c).into_owned() / length;
        // Twice is enough (Kahan): the second pass removes the rounding error of the first.
        for _ in 0..2 {
            for b in &basis {
                let along = b.dot(&rest);
                rest.axpy(-along, b, 1.0);
            }
        }
        let left = rest.norm();
        remainder[c] = left;
        if left > tolerance {
            least_kept = least_kept.min(left);
            basis.push(rest / left);
            visited.push(c);
        } else {
            most_dropped = most_dropped.max(left);
        }
    }
    for c in 0..all {
        coordinates[c] = basis.iter().map(|b| b.dot(&matrix.column(c))).collect();
    }
    let rank = visited.len();
    let triangle = DMatrix::from_fn(rank, rank, |i, j| {
        if i <= j {
            coordinates[visited[j]][i]
        } else {
            0.0
        }
    });
    let mut order_of: Vec<usize> = (0..rank).collect();
    order_of.sort_by_key(|&k| visited[k]);
    let mut combination = DMatrix::zeros(rank, all);
    for c in 0..all {
        let right = nalgebra::DVector::from_column_slice(&coordinates[c]);
        let solution = triangle
            .solve_upper_triangular(&right)
            .unwrap_or_else(|| nalgebra::DVector::zeros(rank));
        for (row, &k) in order_of.iter().enumerate() {
            combination[(row, c)] = solution[k];
        }
    }
    let kept: Vec<usize> = order_of.iter().map(|&k| visited[k]).collect();
    // Set the identity on the kept columns exactly, without rounding errors.
    for (row, &c) in kept.iter().enumerate() {
        combination.column_mut(c).fill(0.0);
        combination[(row, c)] = 1.0;
    }
    Independent {
        kept,
        combination,
        remainders: (least_kept, most_dropped),
        remainder,
    }
}
