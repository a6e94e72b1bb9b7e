//! Least squares of one joint's torque, with functionals of the parameters and their honest uncertainty.

use nalgebra::{DMatrix, DVector};

use crate::identify::independent_columns;

/// A column counts as excited where more than this share of it is left beside the others.
const EXCITED: f64 = 1e-5;
/// Stretches that are taken as independent of each other (cluster-robust covariance, Liang and Zeger 1986).
const STRETCHES: usize = 30;

/// A fitted model of one torque.
pub(super) struct Fit {
    /// Columns that count.
    kept: Vec<usize>,
    /// Orthonormal basis of them.
    basis: DMatrix<f64>,
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Measured minus predicted.
    pub(super) residual: DVector<f64>,
    /// Sum of squares of the torque about its mean.
    total: f64,
}

/// A number and its standard deviation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) value: f64,
    pub(super) std: f64,
}

impl Measured {
    /// In standard deviations.
    pub(super) fn sigmas(self) -> f64 {
        self.value / self.std.max(f64::MIN_POSITIVE)
    }
}

/// Sum of squares about the mean.
pub(super) fn about_mean(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = x.clone().count().max(1) as f64;
    let mean = x.clone().sum::<f64>() / count;
    x.map(|v| (v - mean) * (v - mean)).sum()
}

impl Fit {
    /// Of `torque` by the columns of `matrix`, preferred in `order`; none where there are too few rows.
    pub(super) fn of(matrix: &DMatrix<f64>, torque: &[f64], order: &[usize]) -> Option<Self> {
        let kept = independent_columns(matrix, order, EXCITED).kept;
        let rows = matrix.nrows();
        if kept.is_empty() || rows < 3 * kept.len() || rows != torque.len() {
            return None;
        }
        let x = matrix.select_columns(&kept);
        let y = DVector::from_column_slice(torque);
        let qr = x.clone().qr();
        let (basis, r) = (qr.q(), qr.r());
        let along = basis.transpose() * &y;
        let values = r.solve_upper_triangular(&along)?;
        let residual = &y - &basis * &along;
        let inverse = r.solve_upper_triangular(&DMatrix::identity(kept.len(), kept.len()))?;
        let mut scores = DMatrix::zeros(kept.len(), kept.len());
        let length = rows.div_ceil(STRETCHES).max(1);
        for from in (0..rows).step_by(length) {
            let count = length.min(rows - from);
            let score = basis.rows(from, count).transpose() * residual.rows(from, count);
            scores += &score * score.transpose();
        }
        let covariance = &inverse * scores * inverse.transpose();
        Some(Self {
            kept,
            basis,
            values,
            covariance,
            residual,
            total: about_mean(torque.iter().copied()),
        })
    }

    /// Share of the torque's variance that is left.
    pub(super) fn unexplained(&self) -> f64 {
        self.residual.norm_squared() / self.total.max(f64::MIN_POSITIVE)
    }

    /// Σ weights · parameters, weights over all columns of the matrix.
    pub(super) fn functional(&self, weights: &DVector<f64>) -> Measured {
        let own = DVector::from_iterator(self.kept.len(), self.kept.iter().map(|c| weights[*c]));
        Measured {
            value: own.dot(&self.values),
            std: own.dot(&(&self.covariance * &own)).max(0.0).sqrt(),
        }
    }

    /// The parameter of a column; none where it is not excited.
    pub(super) fn parameter(&self, column: usize) -> Option<Measured> {
        let at = self.kept.iter().position(|c| *c == column)?;
        Some(Measured {
            value: self.values[at],
            std: self.covariance[(at, at)].max(0.0).sqrt(),
        })
    }

    /// What the parameters say of other rows.
    pub(super) fn predict(&self, matrix: &DMatrix<f64>) -> DVector<f64> {
        matrix.select_columns(&self.kept) * &self.values
    }

    /// Share of the variance that is left of the torque moved by each number of rows from `-reach` to `reach` against the
    /// motion, all judged on the same stretch of the motion; none where that is too short.
    pub(super) fn unexplained_moved(&self, torque: &[f64], reach: usize) -> Option<Vec<f64>> {
        let span = self.basis.nrows().checked_sub(2 * reach)?;
        if span < 3 * self.kept.len() {
            return None;
        }
        let part = self.basis.rows(reach, span).into_owned();
        let inner = (part.transpose() * &part).cholesky()?;
        let moved = torque.windows(span).map(|window| {
            let y = DVector::from_column_slice(window);
            let along = part.transpose() * &y;
            let left = y.norm_squared() - along.dot(&inner.solve(&along));
            left.max(0.0) / about_mean(window.iter().copied()).max(f64::MIN_POSITIVE)
        });
        Some(moved.collect())
    }
}
