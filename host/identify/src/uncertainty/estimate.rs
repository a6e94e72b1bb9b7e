//! An estimate with its covariance and intervals.

use nalgebra::DMatrix;
use rig_numerics::svd::Svd;
use serde::Serialize;
use statrs::distribution::ContinuousCDF;
use statrs::distribution::FisherSnedecor;
use statrs::distribution::StudentsT;

/// An estimate with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Values of the base parameters.
    pub values: Vec<f64>,
    /// Standard deviations; allow for correlation of the residuals in time.
    pub std: Vec<f64>,
    /// Standard deviations for white residuals, as in the literature: σ²·(XᵀX)⁻¹.
    pub classical_std: Vec<f64>,
    /// Covariance, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// Correlation, row by row.
    pub correlation: Vec<Vec<f64>>,
    /// 95 % intervals (Student's t with `degrees_of_freedom`).
    pub interval: Vec<[f64; 2]>,
    /// Number of groups minus one.
    pub degrees_of_freedom: usize,
    /// Rows used.
    pub rows: u64,
    /// Rows divided by the residual's correlation time.
    pub effective_rows: f64,
    /// Correlation time of the residuals in rows: 1 + 2·Σρ.
    pub memory_rows: f64,
    /// Condition number of the unscaled regressor, SI units.
    pub condition: f64,
    /// Condition number with every column scaled to length one.
    pub scaled_condition: f64,
}

impl Estimate {
    /// Builds the estimate from values and their covariance. `regressor` is the fitted upper triangle, `memory_rows`
    /// the correlation time of the residuals.
    pub(crate) fn of(
        values: &[f64],
        covariance: &DMatrix<f64>,
        degrees_of_freedom: usize,
        classical_std: Vec<f64>,
        regressor: &DMatrix<f64>,
        rows: u64,
        memory_rows: f64,
    ) -> Self {
        let size = values.len();
        let std: Vec<f64> = (0..size)
            .map(|k| covariance[(k, k)].max(0.0).sqrt())
            .collect();
        let quantile = t_quantile(degrees_of_freedom as f64);
        let condition = |m: &DMatrix<f64>| {
            let s = Svd::of(m.clone()).singular_values;
            s.max() / s.min()
        };
        let mut scaled = regressor.clone();
        for mut column in scaled.column_iter_mut() {
            let norm = column.norm();
            column /= norm;
        }
        let rows_of = |m: &dyn Fn(usize, usize) -> f64| {
            (0..size)
                .map(|i| (0..size).map(|j| m(i, j)).collect())
                .collect::<Vec<Vec<f64>>>()
        };
        Self {
            values: values.to_vec(),
            interval: (0..size)
                .map(|k| [values[k] - quantile * std[k], values[k] + quantile * std[k]])
                .collect(),
            covariance: rows_of(&|i, j| covariance[(i, j)]),
            correlation: rows_of(&|i, j| {
                covariance[(i, j)] / (std[i] * std[j]).max(f64::MIN_POSITIVE)
            }),
            std,
            classical_std,
            degrees_of_freedom,
            rows,
            effective_rows: rows as f64 / memory_rows,
            memory_rows,
            condition: condition(regressor),
            scaled_condition: condition(&scaled),
        }
    }
}

/// A 95 % confidence region of two parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ellipse {
    /// Parameters.
    pub pair: [usize; 2],
    /// Centre.
    pub centre: [f64; 2],
    /// First half axis as a vector, in the units of the parameters.
    pub first: [f64; 2],
    /// Second half axis.
    pub second: [f64; 2],
}

/// Returns the probability that a ratio of two variances with these degrees of freedom, the numerator's first, is as large by
/// chance (F test). A denominator of zero makes the ratio infinite, and leaves no chance; a ratio that is no number shows
/// nothing. `None` if the degrees of freedom are not above zero.
pub fn f_p_value(ratio: f64, [numerator, denominator]: [f64; 2]) -> Option<f64> {
    let law = FisherSnedecor::new(numerator, denominator).ok()?;
    let ratio = ratio.max(0.0);
    // The law multiplies the ratio by the degrees of freedom, which must not overflow.
    Some(match (ratio * numerator).is_finite() {
        true => law.sf(ratio),
        false => 0.0,
    })
}

/// Returns Student's t quantile for a two-sided 95 % interval; the degrees of freedom need not be whole, and count as 1 at
/// least.
pub fn t_quantile(degrees_of_freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees_of_freedom.max(1.0))
        .map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

impl Estimate {
    /// Returns true if a value lies in the 95 % interval of parameter `k`.
    pub fn covers(&self, k: usize, value: f64) -> bool {
        self.interval
            .get(k)
            .is_some_and(|[low, high]| (*low..=*high).contains(&value))
    }

    /// Returns the joint 95 % region of two parameters, half axes scaled by √(2·F₀.₉₅(2, ν)). `None` for a bad pair.
    pub fn ellipse(&self, a: usize, b: usize) -> Option<Ellipse> {
        let n = self.values.len();
        if a >= n || b >= n || a == b {
            return None;
        }
        let quantile = FisherSnedecor::new(2.0, self.degrees_of_freedom.max(1) as f64)
            .ok()?
            .inverse_cdf(0.95);
        let (sa, sb) = (self.std[a], self.std[b]);
        let rho = self.correlation[a][b];
        let scale = (2.0 * quantile).sqrt();
        // In scaled coordinates the axes lie on the diagonals, with variances 1 ± ρ.
        let (plus, minus) = (
            ((1.0 + rho).max(0.0) / 2.0).sqrt() * scale,
            ((1.0 - rho).max(0.0) / 2.0).sqrt() * scale,
        );
        Some(Ellipse {
            pair: [a, b],
            centre: [self.values[a], self.values[b]],
            first: [plus * sa, plus * sb],
            second: [minus * sa, -minus * sb],
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// F with one degree of freedom each exceeds x with the probability 1 − 2/π·atan √x.
    #[test]
    fn every_ratio_of_variances_has_a_probability() {
        for x in [0.0, 0.3, 1.0, 40.0, 1e9] {
            let truth = 1.0 - std::f64::consts::FRAC_2_PI * f64::sqrt(x).atan();
            assert!((f_p_value(x, [1.0, 1.0]).unwrap() - truth).abs() < 1e-9);
        }
        for endless in [f64::INFINITY, f64::MAX, 1e308] {
            assert_eq!(f_p_value(endless, [3.0, 12.0]), Some(0.0));
        }
        for nothing in [-1.0, f64::NAN] {
            assert_eq!(f_p_value(nothing, [3.0, 12.0]), Some(1.0));
        }
        assert_eq!(f_p_value(1.0, [3.0, 0.0]), None);
    }
}
