//! The description as a prior, with its uncertainty chosen by the evidence of the data.
//!
//! π ~ N(π₀, diag(d)²), data of unit noise: π̂ = π₀ + D·Aᵀ·(A·Aᵀ + 1)⁻¹·(z − R·K·π₀) with A = R·K·D. The deviations d
//! of the stated values are unknown: a description may be right in most values and far off in a few. Each deviation is
//! s times the value's natural size times its own factor. The factors give the prior the tail of Student's t with
//! [`TAIL`] degrees of freedom (a scale mixture of normal distributions; Lange, Little & Taylor 1989). Expectation and
//! maximisation find the s and the factors that make the data most likely (MacKay 1992; Tipping 2001).
//!
//! Limits: the uncertainty of s and of the factors is not included.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use super::consistent::scaled_cholesky;
use super::prior::{Prior, Rule};
use super::quadratic::Quadratic;
use crate::error::{IdentifyError, singular};
use crate::rows::factor::TriangularFactor;

/// Candidates of s, from 0.1 % to 1000 %.
pub(crate) const CANDIDATES: [f64; 2] = [1e-3, 10.0];
/// Relative uncertainty of values that the description does not state: effectively no prior.
const BROAD: f64 = 100.0;
/// Degrees of freedom of the prior's tail: Cauchy's. Evidence: a placeholder description (tests/other_engine, 1 kg and
/// 0.01 kg·m² for every link) and joint 1 of a Panda on another motion. A normal prior leaves 1.42 times the noise,
/// four degrees 1.38, one 1.24, no prior 1.18.
const TAIL: f64 = 1.0;
/// Iterations of expectation and maximisation.
const ROUNDS: usize = 12;

/// Data as ‖R·β − z‖² plus the squares that no β explains, in units of the noise.
pub(crate) struct Seen {
    r: DMatrix<f64>,
    z: DVector<f64>,
    left: f64,
}

impl Seen {
    pub(crate) fn of(factor: &TriangularFactor) -> Self {
        let (r, z) = factor.system();
        let left = (factor.right_side_squares() - z.norm_squared()).max(0.0);
        Self { r, z, left }
    }

    /// Rewrites the data as a problem over the values that `combination` combines.
    pub(crate) fn quadratic(&self, combination: &DMatrix<f64>) -> Quadratic {
        Quadratic {
            matrix: &self.r * combination,
            right: self.z.clone(),
        }
    }
}

/// Prior beliefs: values, natural sizes, and which values the description states.
#[derive(Clone)]
pub(crate) struct Belief {
    /// Base columns as combinations of the values here.
    pub combination: DMatrix<f64>,
    pub centre: DVector<f64>,
    scale: DVector<f64>,
    stated: Vec<bool>,
}

impl Belief {
    pub(crate) fn of(prior: &Prior, combination: &DMatrix<f64>) -> Self {
        let columns = prior.centre.len();
        Self {
            combination: prior.own(combination),
            centre: DVector::from_column_slice(&prior.centre),
            scale: DVector::from_column_slice(&prior.scale),
            stated: (0..columns)
                .map(|c| {
                    matches!(prior.rules[c], Rule::Inertial(_)) || prior.uncertainty[c].is_finite()
                })
                .collect(),
        }
    }

    /// Appends values that are base columns of their own, with mean zero and deviations `sizes`.
    pub(crate) fn with(&self, sizes: &[f64]) -> Self {
        let (rows, columns) = self.combination.shape();
        let more = sizes.len();
        let mut combination = self
            .combination
            .clone()
            .resize(rows + more, columns + more, 0.0);
        let mut centre = self.centre.clone().resize_vertically(columns + more, 0.0);
        let mut scale = self.scale.clone().resize_vertically(columns + more, 0.0);
        for (k, size) in sizes.iter().enumerate() {
            combination[(rows + k, columns + k)] = 1.0;
            centre[columns + k] = 0.0;
            scale[columns + k] = size / BROAD;
        }
        let mut stated = self.stated.clone();
        stated.resize(columns + more, false);
        Self {
            combination,
            centre,
            scale,
            stated,
        }
    }

    /// Returns the values of the base columns, followed by those of terms.
    pub(crate) fn base_values(&self, standard: &DVector<f64>) -> DVector<f64> {
        &self.combination * standard
    }

    /// Extends the deviations `first` by those of values appended since.
    pub(crate) fn widened(&self, first: &DVector<f64>) -> DVector<f64> {
        let even = self.even(1.0);
        DVector::from_fn(even.len(), |c, _| *first.get(c).unwrap_or(&even[c]))
    }

    /// Returns the deviations if every stated value has the same relative uncertainty `s`.
    pub(crate) fn even(&self, s: f64) -> DVector<f64> {
        DVector::from_fn(self.scale.len(), |c, _| {
            self.scale[c] * if self.stated[c] { s } else { BROAD }
        })
    }

    /// Returns the deviations with the largest evidence, among `steps` candidates of s.
    pub(crate) fn most_likely(&self, data: &Seen, steps: usize) -> Result<Likely, IdentifyError> {
        let mut best: Option<Likely> = None;
        for k in 0..steps {
            let share = k as f64 / (steps - 1).max(1) as f64;
            let s = CANDIDATES[0] * (CANDIDATES[1] / CANDIDATES[0]).powf(share);
            let found = self.tailed(data, s)?;
            if best.as_ref().is_none_or(|b| found.evidence > b.evidence) {
                best = Some(found);
            }
        }
        best.ok_or_else(|| singular("of the ridge problem"))
    }

    /// Finds the factors of the stated values for a given s.
    fn tailed(&self, data: &Seen, s: f64) -> Result<Likely, IdentifyError> {
        let mut deviation = self.even(s);
        for _ in 0..ROUNDS {
            let found = self.judged(data, &deviation)?;
            for c in (0..deviation.len()).filter(|&c| self.stated[c]) {
                let even = (s * self.scale[c]).powi(2);
                let square = (found.standard[c] - self.centre[c]).powi(2) + found.variance[c];
                deviation[c] = ((TAIL * even + square) / (TAIL + 1.0)).sqrt();
            }
        }
        let found = self.judged(data, &deviation)?;
        let tail: f64 = (0..deviation.len())
            .filter(|&c| self.stated[c])
            .map(|c| {
                let ratio = (deviation[c] / (s * self.scale[c])).powi(2);
                -0.5 * TAIL * (ratio.ln() + 1.0 / ratio - 1.0)
            })
            .sum();
        Ok(Likely {
            evidence: found.evidence + tail,
            s,
            deviation,
        })
    }

    /// Returns the base columns over values of unit deviation.
    fn spread(&self, deviation: &DVector<f64>) -> DMatrix<f64> {
        let mut spread = self.combination.clone();
        for (c, mut column) in spread.column_iter_mut().enumerate() {
            column *= deviation[c];
        }
        spread
    }

    /// Returns the log evidence without its constant, the mean and the variances. Forms A·Aᵀ + 1: with its diagonal
    /// scaled to one, this squares the condition number due to collinearity, not due to different sizes. For data
    /// almost without noise, where this is too much, the factor is found without forming the matrix.
    pub(crate) fn judged(
        &self,
        data: &Seen,
        deviation: &DVector<f64>,
    ) -> Result<Judged, IdentifyError> {
        let Seen { r, z, left } = data;
        let mut seen = r * self.spread(deviation);
        let mut sum = &seen * seen.transpose();
        for k in 0..sum.nrows() {
            sum[(k, k)] += 1.0;
        }
        let failed = || singular("of the description's evidence");
        let (lower, scale) = match scaled_cholesky(sum) {
            Some((cholesky, scale)) => (cholesky.unpack_dirty(), scale),
            None => (unsquared(&seen), DVector::repeat(seen.nrows(), 1.0)),
        };
        let logarithm: f64 = (0..scale.len())
            .map(|k| 2.0 * (lower[(k, k)] / scale[k]).abs().ln())
            .sum();
        let surprise = z - r * (&self.combination * &self.centre);
        let half =
            (lower.solve_lower_triangular(&surprise.component_mul(&scale))).ok_or_else(failed)?;
        let along = half.norm_squared();
        let pulls = lower.tr_solve_lower_triangular(&half).ok_or_else(failed)?;
        let step = seen.tr_mul(&pulls.component_mul(&scale));
        for mut column in seen.column_iter_mut() {
            column.component_mul_assign(&scale);
        }
        if !lower.solve_lower_triangular_mut(&mut seen) {
            return Err(failed());
        }
        Ok(Judged {
            evidence: -0.5 * (left + logarithm + along),
            standard: &self.centre + step.component_mul(deviation),
            variance: DVector::from_fn(deviation.len(), |c, _| {
                deviation[c].powi(2) * (1.0 - seen.column(c).norm_squared()).max(0.0)
            }),
        })
    }

    /// Returns the posterior with its covariance.
    pub(crate) fn posterior(
        &self,
        data: &Seen,
        deviation: &DVector<f64>,
    ) -> Result<Posterior, IdentifyError> {
        let Seen { r, z, .. } = data;
        let spread = self.spread(deviation);
        let seen = r * &spread;
        // In the basis of its singular vectors the data's covariance is diagonal, so no condition number is squared.
        let Svd {
            u,
            singular_values: gains,
            v_t,
        } = Svd::of(seen);
        let surprise = u.transpose() * (z - r * (&self.combination * &self.centre));
        let step = DVector::from_fn(gains.len(), |k, _| {
            gains[k] / (1.0 + gains[k] * gains[k]) * surprise[k]
        });
        let standard = &self.centre + (v_t.transpose() * step).component_mul(deviation);
        Ok(Posterior {
            standard,
            spread,
            gains,
            v_t,
        })
    }
}

/// Deviations and their evidence.
pub(crate) struct Likely {
    pub evidence: f64,
    pub s: f64,
    pub deviation: DVector<f64>,
}

/// Evidence of the deviations and the resulting posterior values.
pub(crate) struct Judged {
    pub evidence: f64,
    /// Mean.
    pub standard: DVector<f64>,
    /// Variance of each value.
    variance: DVector<f64>,
}

/// Posterior distribution.
pub(crate) struct Posterior {
    /// Mean.
    pub standard: DVector<f64>,
    spread: DMatrix<f64>,
    gains: DVector<f64>,
    v_t: DMatrix<f64>,
}

impl Posterior {
    /// Returns the covariance of the base columns' values, followed by those of terms.
    pub(crate) fn base(&self) -> DMatrix<f64> {
        // The observed part of K·P·Kᵀ shrinks by 1/(1 + d²), the rest stays. No difference of large numbers is taken.
        let along = &self.spread * self.v_t.transpose();
        let rest = &self.spread - &along * &self.v_t;
        let mut base = &rest * rest.transpose();
        for (k, gain) in self.gains.iter().enumerate() {
            let column = along.column(k).into_owned();
            base.ger(1.0 / (1.0 + gain * gain), &column, &column, 1.0);
        }
        base
    }
}

/// Returns the lower factor of A·Aᵀ + 1 by orthogonal transformations of Aᵀ over 1 (Golub and Van Loan 2013, section
/// 5.2).
fn unsquared(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (m, n) = a.shape();
    let mut tall = DMatrix::zeros(n + m, m);
    tall.rows_mut(0, n).copy_from(&a.transpose());
    tall.rows_mut(n, m).fill_diagonal(1.0);
    tall.qr().r().transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_of_a_sum_that_cannot_be_formed_is_that_of_one_that_can() {
        // Columns of very different sizes, as from data without noise.
        let a = DMatrix::from_fn(4, 6, |r, c| {
            10f64.powi(c as i32 - 2) * ((r * 7 + c * 3) as f64).sin()
        });
        let lower = unsquared(&a);
        let sum = &a * a.transpose() + DMatrix::identity(4, 4);
        assert!((&lower * lower.transpose() - &sum).norm() < 1e-12 * sum.norm());
        assert!(
            lower
                .upper_triangle()
                .iter()
                .enumerate()
                .all(|(k, x)| k % 5 == 0 || *x == 0.0)
        );
    }
}
