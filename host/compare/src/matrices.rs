//! Inverses of covariances whose entries differ by orders of magnitude.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rig_numerics::svd::Svd;

/// Returns the inverse of a positive definite matrix; `None` for another one. Scales it to a unit diagonal first.
pub(crate) fn inverse(m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = DVector::from_iterator(
        m.nrows(),
        (0..m.nrows()).map(|k| 1.0 / m[(k, k)].max(f64::MIN_POSITIVE).sqrt()),
    );
    let scaled = DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| scale[i] * m[(i, j)] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    let all = DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| {
        scale[i] * 0.5 * (inverse[(i, j)] + inverse[(j, i)]) * scale[j]
    });
    all.iter().all(|v| v.is_finite()).then_some(all)
}

/// Returns the pseudo-inverse; singular values below 1e-9 of the largest count as zero.
pub(crate) fn pseudo_inverse(m: &DMatrix<f64>) -> DMatrix<f64> {
    let svd = Svd::of(m.clone());
    svd.pseudo_inverse(1e-9 * svd.singular_values.max())
}

/// Returns the pseudo-inverse of a symmetric, positive semi-definite matrix, and its rank.
pub(crate) fn symmetric_pseudo_inverse(m: &DMatrix<f64>) -> (DMatrix<f64>, usize) {
    let n = m.nrows();
    let scale = DVector::from_iterator(
        n,
        (0..n).map(|k| match m[(k, k)] > 0.0 {
            true => 1.0 / m[(k, k)].sqrt(),
            false => 0.0,
        }),
    );
    let scaled = DMatrix::from_fn(n, n, |i, j| scale[i] * m[(i, j)] * scale[j]);
    let SymmetricEigen {
        eigenvalues,
        eigenvectors,
    } = scaled.symmetric_eigen();
    let most = eigenvalues.iter().copied().fold(0.0, f64::max);
    let kept = eigenvalues.map(|e| if e > 1e-9 * most { 1.0 / e } else { 0.0 });
    let rank = kept.iter().filter(|e| **e > 0.0).count();
    let inner = &eigenvectors * DMatrix::from_diagonal(&kept) * eigenvectors.transpose();
    let all = DMatrix::from_fn(n, n, |i, j| scale[i] * inner[(i, j)] * scale[j]);
    (all, rank)
}

/// Returns xᵀ·M·x.
pub(crate) fn quadratic(m: &DMatrix<f64>, x: &DVector<f64>) -> f64 {
    x.dot(&(m * x))
}
