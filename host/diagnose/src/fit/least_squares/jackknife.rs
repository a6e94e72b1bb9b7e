//! Jackknife covariance: the change of the coefficients when one cluster of rows is left out.

use nalgebra::{DMatrix, DVector};

use crate::fit::least_squares::Fit;
use rig_numerics::vector::dot;

impl Fit<'_> {
    /// Returns the jackknife covariance of the coefficients of weighted columns, one cluster left out at a time
    /// (MacKinnon, Nielsen and Webb 2023, Journal of Applied Econometrics 38: CV3). `rest` is their residual. The
    /// sandwich of scores is too small if clusters are few or one of them has most information. None if the columns are
    /// collinear.
    pub(crate) fn jackknife(
        &self,
        columns: &[impl AsRef<[f64]>],
        rest: &[f64],
    ) -> Option<DMatrix<f64>> {
        let k = columns.len();
        // Scale columns of very different units.
        let scale: Vec<f64> = (columns.iter())
            .map(|c| 1.0 / dot(c.as_ref(), c.as_ref()).sqrt())
            .collect();
        let mut own = vec![DMatrix::<f64>::zeros(k, k); self.blocks];
        let mut scores = vec![DVector::<f64>::zeros(k); self.blocks];
        for (range, block) in self.stretches(&|block| block) {
            for a in 0..k {
                let left = &columns[a].as_ref()[range.clone()];
                scores[block][a] += scale[a] * dot(left, &rest[range.clone()]);
                for b in 0..=a {
                    let right = &columns[b].as_ref()[range.clone()];
                    own[block][(a, b)] += scale[a] * scale[b] * dot(left, right);
                }
            }
        }
        let mut all = DMatrix::zeros(k, k);
        for matrix in &mut own {
            matrix.fill_upper_triangle_with_lower_triangle();
            all += &*matrix;
        }
        let whole = all.clone().cholesky()?;
        let mut sum = DMatrix::zeros(k, k);
        for (matrix, score) in own.iter().zip(&scores) {
            // If the only informative cluster is left out, the others know nothing: use its plain score.
            let moved = match (&all - matrix).cholesky() {
                Some(others) => others.solve(score),
                None => whole.solve(score),
            };
            sum += &moved * moved.transpose();
        }
        let g = self.blocks as f64;
        sum *= (g - 1.0) / g;
        Some(DMatrix::from_fn(k, k, |a, b| {
            scale[a] * scale[b] * sum[(a, b)]
        }))
    }
}
