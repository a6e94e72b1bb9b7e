//! Optimality criteria of a motion.

use nalgebra::{DMatrix, SymmetricEigen};

/// Optimality criterion of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// Small ratio of largest to smallest singular value: errors are spread evenly (Gautier & Khalil 1992).
    #[default]
    ConditionNumber,
    /// Large smallest singular value: the least identifiable combination of parameters is known as well as possible.
    SmallestSingularValue,
    /// Large determinant of the information matrix (D-optimal): the confidence ellipsoid is small.
    Determinant,
}

impl Criterion {
    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ConditionNumber => "cond",
            Self::SmallestSingularValue => "min-singular",
            Self::Determinant => "d-optimal",
        }
    }

    /// Returns the criterion of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [
            Self::ConditionNumber,
            Self::SmallestSingularValue,
            Self::Determinant,
        ]
        .into_iter()
        .find(|c| c.name() == name)
    }

    /// Returns its value for a motion: smaller is better for the condition number, larger for the others.
    pub fn of(self, values: &Values) -> f64 {
        match self {
            Self::ConditionNumber => values.condition_number,
            Self::SmallestSingularValue => values.smallest_singular_value,
            Self::Determinant => values.mean_singular_value,
        }
    }

    pub(super) fn cost(self, values: &Values) -> f64 {
        match self {
            Self::ConditionNumber => values.condition_number,
            Self::SmallestSingularValue | Self::Determinant => -self.of(values),
        }
    }
}

/// Identifiability of the parameters from a motion, over one whole period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    /// Condition number of the regressor with weighted rows and scaled columns, see [`super`].
    pub condition_number: f64,
    /// Smallest singular value of that regressor over the square root of its number of samples.
    pub smallest_singular_value: f64,
    /// Geometric mean of its singular values, likewise: the determinant of the information to the power 1/(2p).
    pub mean_singular_value: f64,
    /// Condition number of the unscaled regressor in SI units, as in an identification.
    pub si_condition_number: f64,
}

/// Smoothing of the extreme singular values during optimisation. The largest eigenvalue λ of the information is
/// replaced by the norm (Σ λᵏ)^(1/k) of all of them, with this k, and the inverse of the smallest likewise. Eigenvalues
/// coincide at an optimum, where the extreme ones have kinks and the norm has none. The norm is between the value and
/// p^(1/k) times it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Smoothing(pub i32);

/// Returns the criterion of an information matrix, as a logarithm to be minimised, and its derivative by the matrix's
/// entries. Not finite if the matrix is not.
pub(super) fn criterion_of(
    information: &DMatrix<f64>,
    criterion: Criterion,
    smoothing: Smoothing,
) -> (f64, DMatrix<f64>) {
    let p = information.nrows();
    if information.iter().any(|v| !v.is_finite()) {
        return (f64::INFINITY, DMatrix::zeros(p, p));
    }
    let eigen = SymmetricEigen::new(information.clone());
    let values = &eigen.eigenvalues;
    let (least, most) = (values.imin(), values.imax());
    // Rounding can make the smallest eigenvalue of a singular matrix negative.
    let floor = 1e-15 * values[most].max(f64::MIN_POSITIVE);
    let value = |k: usize| values[k].max(floor);
    // Derivatives by the eigenvalues.
    let mut slopes = vec![0.0; p];
    let mut sum = 0.0;
    // ½·ln of the largest of factor·λ^sign, smoothed.
    let Smoothing(k) = smoothing;
    let mut extreme = |sign: i32, at: usize| {
        let shares: Vec<f64> = (0..p)
            .map(|i| (value(i) / value(at)).powi(sign * k))
            .collect();
        let total: f64 = shares.iter().sum();
        sum += 0.5 * (f64::from(sign) * value(at).ln() + total.ln() / f64::from(k));
        for (i, share) in shares.iter().enumerate() {
            slopes[i] += 0.5 * f64::from(sign) * share / (total * value(i));
        }
    };
    match criterion {
        Criterion::ConditionNumber => {
            extreme(1, most);
            extreme(-1, least);
        }
        Criterion::SmallestSingularValue => extreme(-1, least),
        Criterion::Determinant => {
            let share = 0.5 / p as f64;
            for k in 0..p {
                sum -= share * value(k).ln();
                slopes[k] = -share / value(k);
            }
        }
    }
    // V·diag(slopes)·Vᵀ
    let mut scaled = eigen.eigenvectors.clone();
    for (k, slope) in slopes.iter().enumerate() {
        scaled.column_mut(k).scale_mut(*slope);
    }
    let slope = scaled * eigen.eigenvectors.transpose();
    (sum, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_is_that_of_central_differences() {
        // Angles that grow with the square; sines of sums would give a singular matrix.
        let root = DMatrix::from_fn(9, 5, |i, j| ((1 + i * 7 + j * 3).pow(2) as f64 * 1.7).sin());
        let information = root.tr_mul(&root);
        for criterion in [
            Criterion::ConditionNumber,
            Criterion::SmallestSingularValue,
            Criterion::Determinant,
        ] {
            for smoothing in [Smoothing(1), Smoothing(2), Smoothing(8)] {
                let (value, slope) = criterion_of(&information, criterion, smoothing);
                for (i, j) in [(0, 0), (1, 3), (4, 2)] {
                    let moved = |by: f64| {
                        let mut m = information.clone();
                        m[(i, j)] += by;
                        if i != j {
                            m[(j, i)] += by;
                        }
                        criterion_of(&m, criterion, smoothing).0
                    };
                    let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                    let twice = if i == j { 1.0 } else { 2.0 };
                    assert!(
                        (difference - twice * slope[(i, j)]).abs() < 1e-7 * (1.0 + value.abs()),
                        "{criterion:?} {smoothing:?}: {difference} {}",
                        slope[(i, j)]
                    );
                }
            }
        }
    }

    #[test]
    fn smoothing_lies_above_and_closes_in() {
        let information = DMatrix::from_diagonal(&nalgebra::dvector![1.0, 1.1, 4.0, 4.1]);
        let at = |s| criterion_of(&information, Criterion::ConditionNumber, s).0;
        let exact = 0.5 * 4.1_f64.ln();
        let mut before = f64::INFINITY;
        for k in [2, 4, 16, 64] {
            let value = at(Smoothing(k));
            assert!(exact <= value && value < before);
            assert!(value - exact <= 4.0_f64.ln() / f64::from(k) + 1e-12);
            before = value;
        }
    }
}
