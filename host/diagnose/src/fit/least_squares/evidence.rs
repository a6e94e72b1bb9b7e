//! Tests of candidate columns beside a fit.

use nalgebra::{DMatrix, DVector};

use crate::fit::evidence::Evidence;
use crate::fit::least_squares::{Beside, Fit};
use rig_identify::f_p_value;
use rig_numerics::vector::{axpy, dot};

impl Fit<'_> {
    /// Returns the evidence for projected columns. Columns whose coefficient cannot be negative and is zero take part in
    /// nothing but the list of coefficients.
    pub(crate) fn evidence(&self, columns: &[Vec<f64>], bounds: &[[f64; 2]]) -> Option<Evidence> {
        let beside = Beside {
            gram: DMatrix::from_fn(columns.len(), columns.len(), |a, b| {
                dot(&columns[a], &columns[b])
            }),
            right: DVector::from_iterator(
                columns.len(),
                columns.iter().map(|c| dot(c, &self.residual)),
            ),
        };
        let (explained, gains) = self.explained(&beside, bounds)?;
        let part: Vec<usize> = (0..columns.len()).filter(|c| gains[*c] != 0.0).collect();
        if part.is_empty() {
            return None;
        }
        if part.len() < columns.len() {
            let own: Vec<Vec<f64>> = part.iter().map(|c| columns[*c].clone()).collect();
            let open: Vec<[f64; 2]> = part.iter().map(|c| bounds[*c]).collect();
            let mut evidence = self.evidence(&own, &open)?;
            let spread = |values: &[f64]| {
                let mut all = vec![0.0; columns.len()];
                for (c, value) in part.iter().zip(values) {
                    all[*c] = *value;
                }
                all
            };
            evidence.gains = spread(&evidence.gains);
            evidence.stds = spread(&evidence.stds);
            return Some(evidence);
        }
        let k = columns.len();
        // The residual under the alternative: with the columns.
        let mut rest = self.residual.clone();
        for (column, gain) in columns.iter().zip(&gains) {
            axpy(-gain, column, &mut rest);
        }
        let inverse = beside.gram.cholesky()?.inverse();
        let (covariance, clusters) = self.robust_covariance(columns, &inverse, &rest);
        let g = clusters as f64;
        let stds = (0..k).map(|c| covariance[(c, c)].max(0.0).sqrt()).collect();
        let beta = DVector::from_column_slice(&gains);
        let wald = beta.dot(&covariance.cholesky()?.solve(&beta));
        let freedom = (g - k as f64).max(1.0);
        let statistic = wald / k as f64 * freedom / (g - 1.0).max(1.0);
        let p_value = f_p_value(statistic, [k as f64, freedom])
            .unwrap_or(1.0)
            .max(f64::MIN_POSITIVE);
        let (plain, more) = self.cross_validated(columns)?;
        let block_errors: Vec<[f64; 2]> = (plain.of_block.iter().zip(&more.of_block))
            .map(|(a, b)| [*a, *b])
            .collect();
        let joint_gain = (plain.of_joint.iter().zip(&more.of_joint))
            .filter(|(before, _)| **before > 0.0)
            .map(|(before, after)| 1.0 - (after / before).sqrt())
            .fold(f64::NEG_INFINITY, f64::max);
        let (before, after) = block_errors
            .iter()
            .fold((0.0, 0.0), |(a, b), e| (a + e[0], b + e[1]));
        let gain = 1.0 - (after / before).sqrt();
        let g = self.blocks as f64;
        let mean = (before - after) / g;
        let spread = block_errors
            .iter()
            .map(|e| (e[0] - e[1] - mean).powi(2))
            .sum::<f64>()
            / (g - 1.0).max(1.0);
        let gain_sigmas = mean / (spread / g).sqrt().max(f64::MIN_POSITIVE);
        Some(Evidence {
            gains,
            stds,
            explained,
            gain,
            joint_gain,
            gain_sigmas,
            p_value,
            block_errors,
        })
    }
}
