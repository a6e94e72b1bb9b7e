//! How far coefficients may be off: what each cluster of rows would have made of them had it not been there.

use nalgebra::{DMatrix, DVector};

use super::{Fit, dot};

impl Fit<'_> {
    /// Covariance of the coefficients of weighted columns by leaving out one cluster at a time (MacKinnon, Nielsen and Webb
    /// 2023, Journal of Applied Econometrics 38: CV3): `rest` is what they leave. The sandwich of scores is too small where
    /// clusters are few or one of them tells much more than others. None where the columns are not independent.
    pub(crate) fn jackknife(
        &self,
        columns: &[impl AsRef<[f64]>],
        rest: &[f64],
    ) -> Option<DMatrix<f64>> {
        let k = columns.len();
        // Columns of very different units.
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
            // Without the only cluster that tells something nothing would be known: its score then counts as it is.
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
