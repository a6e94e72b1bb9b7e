//! Covariance of an estimate from few groups of rows.
//!
//! The covariance of [`rig_identify`] comes from 8 to 64 groups of rows. With as many parameters its inverse is noise.
//! Here it is shrunk towards the covariance of least squares with residuals of one correlation time, which the regressor
//! alone gives: the oracle approximating shrinkage of Chen, Wiesel, Eldar and Hero (2010, "Shrinkage algorithms for MMSE
//! covariance estimation", IEEE Trans. Signal Processing 58, eq. 23), in coordinates in which that target is a multiple
//! of the identity.

use nalgebra::DMatrix;

/// A shrunk covariance.
pub(crate) struct Shrunk {
    /// Covariance.
    pub covariance: DMatrix<f64>,
    /// Weight of the target, 0 to 1.
    pub weight: f64,
    /// Factor of the inverse that makes its mean right, at most 1: (ν − p − 1)/ν for the sample covariance of ν degrees
    /// of freedom (Hotelling 1931), 1 for the target, and linear in the weight between.
    pub inverse_factor: f64,
}

/// Shrinks `covariance`, estimated with `freedom` degrees of freedom. `information` is the matrix XᵀX of the estimated
/// parameters, up to a factor. `None` if it is singular.
pub(crate) fn shrunk(
    covariance: &DMatrix<f64>,
    information: &DMatrix<f64>,
    freedom: usize,
) -> Option<Shrunk> {
    let p = covariance.nrows();
    let scale: Vec<f64> = (0..p).map(|k| information[(k, k)].sqrt()).collect();
    let scaled = DMatrix::from_fn(p, p, |i, j| information[(i, j)] / (scale[i] * scale[j]));
    let lower = scaled.cholesky()?.unpack();
    // Whitened: z = Lᵀ·D·x has covariance c·I if the covariance of x is c·(D·L·Lᵀ·D)⁻¹.
    let to = DMatrix::from_fn(p, p, |i, j| lower[(j, i)] * scale[j]);
    let back = to.clone().try_inverse()?;
    let white = &to * covariance * to.transpose();
    let (trace, squares) = (white.trace(), white.norm_squared());
    let (size, nu) = (p as f64, freedom.max(1) as f64);
    let spread = squares - trace * trace / size;
    let above = (1.0 - 2.0 / size) * squares + trace * trace;
    let below = (nu + 1.0 - 2.0 / size) * spread;
    let weight = if below > 0.0 {
        (above / below).clamp(0.0, 1.0)
    } else {
        1.0
    };
    let target = DMatrix::identity(p, p) * (trace / size);
    let mixed = white * (1.0 - weight) + target * weight;
    let own = ((nu - size - 1.0) / nu).max(0.0);
    Some(Shrunk {
        covariance: &back * mixed * back.transpose(),
        weight,
        inverse_factor: (weight + (1.0 - weight) * own).max(0.1),
    })
}
