//! Least squares on a triangular factor, with some columns left out.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use crate::error::IdentifyError;
use crate::rows::factor::TriangularFactor;
use crate::structure::base::Base;
use crate::structure::independent::Independent;

/// Returns the triangular factor of the kept columns alone.
pub(crate) fn triangle(factor: &TriangularFactor, data: &Independent) -> DMatrix<f64> {
    kept_columns(factor, data).0.qr().r()
}

/// Spreads the values of the kept columns over all columns, zero elsewhere.
pub(crate) fn spread(beta: &[f64], kept: &[usize], p: usize) -> Vec<f64> {
    let mut full = vec![0.0; p];
    for (value, &k) in beta.iter().zip(kept) {
        full[k] = *value;
    }
    full
}

/// Returns the minimum-norm solution of equations weighted by `weights`: collinear columns share their value. None if
/// there is no solution.
pub(crate) fn weighted_minimum_norm(
    factors: &[TriangularFactor],
    weights: &[f64],
) -> Option<DVector<f64>> {
    let mut all = TriangularFactor::new(factors.first()?.columns());
    for (factor, weight) in factors.iter().zip(weights) {
        if *weight > 0.0 {
            all.merge(factor, *weight);
        }
    }
    let (r, z) = all.system();
    let svd = Svd::of(r);
    let smallest = 1e-10 * svd.singular_values.max();
    Some(svd.solve(&z, smallest))
}

/// Returns the minimum-norm solution over all joints, weighted by their residuals. None if there is no solution.
pub(crate) fn by_noise(factors: &[TriangularFactor]) -> Option<Vec<f64>> {
    let mut squares: Vec<f64> = factors
        .iter()
        .map(TriangularFactor::right_side_squares)
        .collect();
    let mut beta = Vec::new();
    for _ in 0..2 {
        let weights: Vec<f64> = (factors.iter().zip(&squares))
            .map(|(f, s)| {
                if *s > 0.0 {
                    (f.rows() as f64 / s).sqrt()
                } else {
                    0.0
                }
            })
            .collect();
        beta = weighted_minimum_norm(factors, &weights)?
            .as_slice()
            .to_vec();
        squares = factors.iter().map(|f| f.residual_squares(&beta)).collect();
    }
    Some(beta)
}

pub(crate) fn kept_columns(
    factor: &TriangularFactor,
    data: &Independent,
) -> (DMatrix<f64>, DVector<f64>) {
    let (r, z) = factor.system();
    (r.select_columns(&data.kept), z)
}

/// Solves for the kept columns alone.
pub(crate) fn least_squares(
    factor: &TriangularFactor,
    data: &Independent,
    base: &Base,
) -> Result<Vec<f64>, IdentifyError> {
    let (a, z) = kept_columns(factor, data);
    let qr = a.clone().qr();
    let right = qr.q().transpose() * z;
    qr.r()
        .solve_upper_triangular(&right)
        .filter(|x| x.iter().all(|v| v.is_finite()))
        .map(|x| x.as_slice().to_vec())
        .ok_or_else(|| {
            let smallest = (0..a.ncols())
                .min_by(|&i, &j| a.column(i).norm().total_cmp(&a.column(j).norm()))
                .unwrap_or(0);
            IdentifyError::Singular {
                column: base.column_name(base.columns[data.kept[smallest]]),
            }
        })
}

/// Returns the classical standard deviations, σ²·(XᵀX)⁻¹, and the inverse of the triangular factor.
pub(crate) fn classical(
    factor: &TriangularFactor,
    data: &Independent,
    beta: &[f64],
) -> Result<(Vec<f64>, DMatrix<f64>), IdentifyError> {
    let (a, _) = kept_columns(factor, data);
    let r = a.qr().r();
    let inverse = r.try_inverse().ok_or(IdentifyError::Singular {
        column: "unknown".into(),
    })?;
    let full = spread(beta, &data.kept, factor.columns());
    let freedom = factor.rows().saturating_sub(beta.len() as u64).max(1);
    let sigma = (factor.residual_squares(&full) / freedom as f64).sqrt();
    let std = (0..beta.len())
        .map(|k| sigma * inverse.row(k).norm())
        .collect();
    Ok((std, inverse))
}
