//! Least squares for the ten parameters beside unknowns of no interest, in the directions that the data show.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rig_identify::{LeaveOut, Refit, TriangularFactor};
use rig_numerics::svd::Svd;
use rig_shared::multibody::INERTIAL_PARAMETERS;

/// Distance from the flange at which the mass of a load plausibly lies, m. It decides which directions count as shown,
/// and limits what is not shown.
pub(crate) const PLAUSIBLE_DISTANCE: f64 = 0.1;
/// Relative singular value below which a direction is rounding.
const ROUNDING: f64 = 1e-9;
/// Standard deviations by which a mass differs certainly from none.
pub(crate) const CERTAIN: f64 = 5.0;
/// Probability by chance below which two values of the same thing contradict each other: the load by sensor and by torques,
/// and its mass and a known one.
pub(crate) const CONTRADICTS: f64 = 1e-3;
/// A parameter is shown if its standard deviation is below this share of its plausible size.
const SHOWN: f64 = 0.5;

/// The ten parameters, in the order m mx my mz Ixx Ixy Ixz Iyy Iyz Izz.
pub(crate) type Parameters = SVector<f64, INERTIAL_PARAMETERS>;
/// A matrix of these.
pub(crate) type Square = SMatrix<f64, INERTIAL_PARAMETERS, INERTIAL_PARAMETERS>;

/// The ten parameters with their uncertainty.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    /// Values; 0 along directions that the data do not show.
    pub values: Parameters,
    /// Covariance of what the data show.
    pub covariance: Square,
    /// Covariance of what they do not show: plausible sizes along these directions.
    pub beyond: Square,
    /// Inverse of the covariance along the shown directions; 0 along the others.
    pub information: Square,
    /// Plausible size of each parameter.
    pub sizes: Parameters,
    /// Degrees of freedom of the covariance.
    pub degrees_of_freedom: usize,
}

impl Estimate {
    /// Returns the standard deviations; a direction that is not shown has its plausible size.
    pub(crate) fn std(&self) -> Parameters {
        (self.covariance + self.beyond)
            .diagonal()
            .map(|v| v.max(0.0).sqrt())
    }

    /// Takes away what the data show of the inertia, whatever it is: mass and first moments keep what they are known by.
    pub(crate) fn hide_inertia(&mut self) {
        const FIRST: usize = 4;
        const COUNT: usize = INERTIAL_PARAMETERS - FIRST;
        let own = self
            .information
            .fixed_view::<FIRST, FIRST>(0, 0)
            .into_owned();
        let mixed = self
            .information
            .fixed_view::<FIRST, COUNT>(0, FIRST)
            .into_owned();
        let hidden = self
            .information
            .fixed_view::<COUNT, COUNT>(FIRST, FIRST)
            .into_owned();
        let inverse =
            symmetric_inverse(&DMatrix::from_column_slice(COUNT, COUNT, hidden.as_slice()));
        let inverse = SMatrix::<f64, COUNT, COUNT>::from_iterator(inverse.iter().copied());
        let left = own - mixed * inverse * mixed.transpose();
        self.information.fill(0.0);
        self.information
            .fixed_view_mut::<FIRST, FIRST>(0, 0)
            .copy_from(&left);
        for matrix in [&mut self.covariance, &mut self.beyond] {
            matrix.fixed_rows_mut::<COUNT>(FIRST).fill(0.0);
            matrix.fixed_columns_mut::<COUNT>(FIRST).fill(0.0);
        }
        for k in FIRST..INERTIAL_PARAMETERS {
            self.values[k] = 0.0;
            self.beyond[(k, k)] = self.sizes[k].powi(2);
        }
    }

    /// Adds independent errors to the covariance, one column each, with the change of the parameters that one standard
    /// deviation of it makes. Directions that the data do not show stay hidden.
    pub(crate) fn widen<const N: usize>(&mut self, errors: &SMatrix<f64, INERTIAL_PARAMETERS, N>) {
        self.covariance += errors * errors.transpose();
        // Woodbury: (C + L·Lᵀ)⁻¹ = I − I·L·(1 + Lᵀ·I·L)⁻¹·Lᵀ·I, on the directions of the information I alone.
        let weighed = self.information * errors;
        let inner = SMatrix::<f64, N, N>::identity() + errors.transpose() * weighed;
        let inner = symmetric_inverse(&DMatrix::from_column_slice(N, N, inner.as_slice()));
        let inner = SMatrix::<f64, N, N>::from_iterator(inner.iter().copied());
        self.information -= weighed * inner * weighed.transpose();
    }

    /// Returns for each parameter if the data show it.
    pub(crate) fn shown(&self) -> [bool; INERTIAL_PARAMETERS] {
        let std = self.std();
        std::array::from_fn(|k| std[k] < SHOWN * self.sizes[k])
    }
}

/// Returns the plausible sizes of the parameters of a load of about `mass` kg.
pub(crate) fn sizes_of(mass: f64) -> Parameters {
    Parameters::from_fn(|k, _| match k {
        0 => mass,
        1..=3 => mass * PLAUSIBLE_DISTANCE,
        _ => mass * PLAUSIBLE_DISTANCE.powi(2),
    })
}

/// Where the uncertainty comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Spread {
    /// Refits with one segment of time left out: allows for correlated noise and errors of the model.
    Segments,
    /// The residuals, which are independent: poses that were approached one by one. Holds the degrees of freedom.
    Residuals(usize),
}

/// Estimates the parameters from segments, one factor each, in units of the noise. The first ten columns are those of
/// the parameters.
pub(crate) fn estimate(segments: &[TriangularFactor], mass: f64, spread: Spread) -> Estimate {
    let sizes = sizes_of(mass);
    let all = LeaveOut::of(segments);
    let (r, z) = all.whole.system();
    let shown = shown_directions(&r, &sizes);
    let lift = DMatrix::from_fn(INERTIAL_PARAMETERS, shown.along.ncols(), |k, c| {
        sizes[k] * shown.along[(k, c)]
    });
    let fit = |factor: &TriangularFactor| {
        let (r, z) = factor.system();
        solved(&reduced(&r, &lift), &z)
    };
    let whole = solved(&reduced(&r, &lift), &z);
    let count = lift.ncols();
    let (covariance, degrees_of_freedom) = match spread {
        Spread::Segments => {
            let without = all.without.iter().map(fit);
            let refit = Refit {
                whole: whole.as_slice()[..count].to_vec(),
                without: without.map(|x| x.as_slice()[..count].to_vec()).collect(),
            };
            (refit.covariance(), segments.len().saturating_sub(1))
        }
        Spread::Residuals(freedom) => {
            let squares = shown.strength.map(|s| 1.0 / (s * s));
            (DMatrix::from_diagonal(&squares), freedom)
        }
    };
    let of = |m: &DMatrix<f64>| Square::from_iterator(m.iter().copied());
    let inverse = match count {
        0 => DMatrix::zeros(0, 0),
        _ => symmetric_inverse(&covariance),
    };
    let down = DMatrix::from_fn(count, INERTIAL_PARAMETERS, |c, k| {
        shown.along[(k, c)] / sizes[k]
    });
    let hidden = DMatrix::from_fn(INERTIAL_PARAMETERS, shown.hidden.ncols(), |k, c| {
        sizes[k] * shown.hidden[(k, c)]
    });
    let values = &lift * whole.rows(0, count);
    Estimate {
        values: Parameters::from_iterator(values.iter().copied()),
        covariance: of(&(&lift * &covariance * lift.transpose())),
        beyond: of(&(&hidden * hidden.transpose())),
        information: of(&(down.transpose() * inverse * down)),
        sizes,
        degrees_of_freedom,
    }
}

/// Orthonormal directions in the space of the parameters over their sizes.
struct Directions {
    /// Shown by the data.
    along: DMatrix<f64>,
    /// Singular value of each of them: the inverse of its standard deviation.
    strength: DVector<f64>,
    /// Not shown by the data.
    hidden: DMatrix<f64>,
}

/// Finds the directions whose standard deviation is below their plausible size, whatever the other unknowns are.
fn shown_directions(r: &DMatrix<f64>, sizes: &Parameters) -> Directions {
    let p = r.ncols();
    let mut own = r.columns(0, INERTIAL_PARAMETERS).into_owned();
    for (k, mut column) in own.column_iter_mut().enumerate() {
        column *= sizes[k];
    }
    let others = scaled(
        &r.columns(INERTIAL_PARAMETERS, p - INERTIAL_PARAMETERS)
            .into_owned(),
    )
    .0;
    if others.ncols() > 0 {
        let svd = Svd::of(others);
        let largest = svd.singular_values.max();
        for (c, s) in svd.singular_values.iter().enumerate() {
            if *s > ROUNDING * largest {
                let column = svd.u.column(c).into_owned();
                let along = column.transpose() * &own;
                own -= &column * along;
            }
        }
    }
    let svd = Svd::of(own);
    let right = svd.v_t.transpose();
    let largest = svd.singular_values.max();
    let is_shown = |s: f64| s > 1.0 && s > ROUNDING * largest;
    let (shown, hidden): (Vec<usize>, Vec<usize>) =
        (0..INERTIAL_PARAMETERS).partition(|k| is_shown(svd.singular_values[*k]));
    Directions {
        along: right.select_columns(&shown),
        strength: DVector::from_iterator(
            shown.len(),
            shown.iter().map(|k| svd.singular_values[*k]),
        ),
        hidden: right.select_columns(&hidden),
    }
}

/// Replaces the columns of the parameters by those of their shown directions.
fn reduced(r: &DMatrix<f64>, lift: &DMatrix<f64>) -> DMatrix<f64> {
    let others = r.ncols() - INERTIAL_PARAMETERS;
    let mut out = DMatrix::zeros(r.nrows(), lift.ncols() + others);
    out.columns_mut(0, lift.ncols())
        .copy_from(&(r.columns(0, INERTIAL_PARAMETERS) * lift));
    out.columns_mut(lift.ncols(), others)
        .copy_from(&r.columns(INERTIAL_PARAMETERS, others));
    out
}

/// Returns the pseudo-inverse of a symmetric, positive semi-definite matrix.
fn symmetric_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = matrix.clone().symmetric_eigen();
    let least = f64::EPSILON * matrix.ncols() as f64 * eigen.eigenvalues.amax();
    let kept = eigen
        .eigenvalues
        .map(|e| if e > least { 1.0 / e } else { 0.0 });
    &eigen.eigenvectors * DMatrix::from_diagonal(&kept) * eigen.eigenvectors.transpose()
}

/// Returns the matrix with columns of length one, and their lengths.
fn scaled(matrix: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let mut matrix = matrix.clone();
    let lengths = matrix
        .column_iter_mut()
        .map(|mut column| {
            let length = column.norm();
            if length > 0.0 {
                column /= length;
            }
            length
        })
        .collect();
    (matrix, lengths)
}

/// Solves a least-squares problem; unknowns that the equations do not determine get the smallest values.
pub(crate) fn solved(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let (matrix, lengths) = scaled(matrix);
    let svd = Svd::of(matrix);
    let mut x = svd.solve(right, ROUNDING * svd.singular_values.max());
    for (value, length) in x.iter_mut().zip(lengths) {
        *value = if length > 0.0 { *value / length } else { 0.0 };
    }
    x
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// The information of the sensor and that of the torques are inverses of covariances. An error of a thousandth in one of them
    /// made a load that neither had shown.
    #[test]
    fn covariances_of_unlike_sizes_have_an_exact_inverse() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(4);
        for _ in 0..3000 {
            let turn = DMatrix::from_fn(10, 10, |_, _| random.random::<f64>() - 0.5)
                .qr()
                .q();
            let sizes = DVector::from_fn(10, |_, _| f64::powf(1e3, -random.random::<f64>()));
            let covariance = &turn * DMatrix::from_diagonal(&(sizes * 1e-6)) * turn.transpose();
            let again = &covariance * symmetric_inverse(&covariance);
            assert!((again - DMatrix::identity(10, 10)).amax() < 1e-9);
        }
        let mut singular = DMatrix::zeros(2, 2);
        singular[(0, 0)] = 4.0;
        assert_eq!(symmetric_inverse(&singular)[(0, 0)], 0.25);
        assert_eq!(symmetric_inverse(&singular)[(1, 1)], 0.0);
    }
}
