//! Least squares of one joint's torque, with linear functions of the parameters and their uncertainty.

use nalgebra::{DMatrix, DVector};

use rig_identify::independent_columns;
use rig_numerics::statistics::squares_about_mean;

/// Share of a column that must be independent of the others to be excited.
pub(crate) const EXCITED: f64 = 1e-5;
/// Most stretches that count as independent.
const STRETCHES: usize = 60;
/// Least rows of a stretch, more than the correlation length of residuals.
const LEAST_STRETCH: usize = 25;

/// Share of a direction that may be rounding.
const ROUNDING: f64 = 1e-10;

/// A fitted model of one torque.
pub(crate) struct Fit {
    /// Columns in use.
    kept: Vec<usize>,
    /// Orthonormal basis of the columns.
    basis: DMatrix<f64>,
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Number of stretches minus one.
    freedom: f64,
    /// Measured minus predicted.
    pub(crate) residual: DVector<f64>,
    /// Sum of squares of the torque about its mean.
    total: f64,
}

/// A value with its standard deviation and degrees of freedom.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    pub(crate) value: f64,
    pub(crate) std: f64,
    freedom: f64,
}

impl Measured {
    pub(crate) fn new(value: f64, std: f64, freedom: f64) -> Self {
        Self {
            value,
            std,
            freedom,
        }
    }

    /// Returns the equally rare number of normal standard deviations: Student's t, converted by Wallace's formula
    /// (1959).
    pub(crate) fn sigmas(self) -> f64 {
        let (t, f) = (self.value / self.std.max(f64::MIN_POSITIVE), self.freedom);
        let normal = (8.0 * f + 1.0) / (8.0 * f + 3.0) * (f * (t * t / f).ln_1p()).sqrt();
        normal.copysign(t)
    }
}

/// Returns the covariance of the coordinates in an orthonormal `basis`, by leaving out one stretch at a time, and the
/// number of stretches.
///
/// The cluster jackknife (Bell & McCaffrey 2002; MacKinnon, Nielsen & Webb 2023, "CV₃"). Q_g are the basis' rows of
/// stretch g and e_g their residual. Leaving it out moves the coordinates by (1 − Q_gᵀ·Q_g)⁻¹·Q_gᵀ·e_g. Residuals
/// without the inverse are far too small with nearly as many parameters as stretches, as the fit adapts to them. A
/// direction in only one stretch has no bounds.
pub(crate) fn jackknife(basis: &DMatrix<f64>, residual: &DVector<f64>) -> (DMatrix<f64>, usize) {
    let (rows, size) = basis.shape();
    let length = rows.div_ceil(STRETCHES).max(LEAST_STRETCH);
    let mut sum = DMatrix::zeros(size, size);
    let mut stretches = 0_usize;
    for from in (0..rows).step_by(length) {
        let count = length.min(rows - from);
        let own = basis.rows(from, count);
        let score = own.transpose() * residual.rows(from, count);
        let mut rest = -(own.transpose() * own);
        for k in 0..size {
            // Rounding must not make it negative.
            rest[(k, k)] += 1.0 + ROUNDING;
        }
        let moved = rest.cholesky().map(|c| c.solve(&score));
        let moved = moved.unwrap_or(score / ROUNDING);
        sum.ger(1.0, &moved, &moved, 1.0);
        stretches += 1;
    }
    let share = (stretches as f64 - 1.0) / (stretches as f64).max(1.0);
    (sum * share, stretches)
}

impl Fit {
    /// Fits `torque` by the columns of `matrix`, preferred in `order`; `None` if there are too few rows.
    pub(crate) fn of(matrix: &DMatrix<f64>, torque: &[f64], order: &[usize]) -> Option<Self> {
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
        let (spread, stretches) = jackknife(&basis, &residual);
        let covariance = &inverse * spread * inverse.transpose();
        Some(Self {
            kept,
            basis,
            values,
            covariance,
            freedom: stretches.saturating_sub(1).max(1) as f64,
            residual,
            total: squares_about_mean(torque),
        })
    }

    /// Returns the residual share of the torque's variance.
    pub(crate) fn unexplained(&self) -> f64 {
        self.residual.norm_squared() / self.total.max(f64::MIN_POSITIVE)
    }

    /// Returns Σ weights · parameters, with weights over all columns of the matrix.
    pub(crate) fn functional(&self, weights: &DVector<f64>) -> Measured {
        let own = DVector::from_iterator(self.kept.len(), self.kept.iter().map(|c| weights[*c]));
        Measured {
            value: own.dot(&self.values),
            std: own.dot(&(&self.covariance * &own)).max(0.0).sqrt(),
            freedom: self.freedom,
        }
    }

    /// Returns the parameter of a column; `None` if it is not excited.
    pub(crate) fn parameter(&self, column: usize) -> Option<Measured> {
        let at = self.kept.iter().position(|c| *c == column)?;
        Some(Measured {
            value: self.values[at],
            std: self.covariance[(at, at)].max(0.0).sqrt(),
            freedom: self.freedom,
        })
    }

    /// Returns the torque of other rows by these parameters.
    pub(crate) fn predict(&self, matrix: &DMatrix<f64>) -> DVector<f64> {
        matrix.select_columns(&self.kept) * &self.values
    }

    /// Returns the residual share of variance with the torque moved by each number of rows from `-reach` to `reach`
    /// against the motion. All use the same stretch of the motion, and those of its rows that are `used`; `None` if these
    /// are too few.
    pub(crate) fn unexplained_moved(
        &self,
        torque: &[f64],
        reach: usize,
        used: &[bool],
    ) -> Option<Vec<f64>> {
        let span = self.basis.nrows().checked_sub(2 * reach)?;
        let rows: Vec<usize> = (0..span).filter(|k| used[reach + k]).collect();
        if rows.len() < 3 * self.kept.len() {
            return None;
        }
        let part = self.basis.rows(reach, span).select_rows(&rows);
        let inner = (part.transpose() * &part).cholesky()?;
        let moved = torque.windows(span).map(|window| {
            let y = DVector::from_iterator(rows.len(), rows.iter().map(|k| window[*k]));
            let along = part.transpose() * &y;
            let left = y.norm_squared() - along.dot(&inner.solve(&along));
            left.max(0.0) / squares_about_mean(y.as_slice()).max(f64::MIN_POSITIVE)
        });
        Some(moved.collect())
    }
}
