//! Fits of each joint's torque alone, with parameters of their own.
//!
//! A wrong factor of a joint's torques stays in the residual of a fit that all joints share. The joint's own fit is as good
//! with the factor as without it, so its residual is the noise against which the factor is judged.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::rows::factor::TriangularFactor;
use crate::rows::stream::each_rows;
use crate::uncertainty::residual::LEAST_ERROR;
use rig_model::robot::CONTRADICTED;
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::svd::Svd;
use rig_numerics::vector::dot_in_order;

/// Relative singular value below which a direction is rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

/// The fit of a joint's torque alone.
pub(crate) struct OwnFit<'a> {
    /// The rows of the joint.
    pub equation: &'a TriangularFactor,
    /// Standard deviation of the residual, with its memory: that of one independent row for as many as remember each other.
    pub std: f64,
}

/// Values of a fit and the standard deviation of what it leaves.
struct Values {
    values: Vec<f64>,
    std: f64,
}

impl Values {
    /// Pseudo-inverse: one joint need not excite every parameter.
    fn of(equation: &TriangularFactor) -> Self {
        let (r, z) = equation.system();
        let svd = Svd::of(r);
        let smallest = ROUNDING * svd.singular_values.max();
        let rank = (svd.singular_values.iter().filter(|s| **s > smallest)).count();
        let values = svd.solve(&z, smallest).as_slice().to_vec();
        let rows = equation.rows() as f64;
        let squares = equation.residual_squares(&values) / (rows - rank as f64).max(1.0);
        let rms = (equation.right_side_squares() / rows.max(1.0)).sqrt();
        Self {
            values,
            std: squares.sqrt().max(LEAST_ERROR * rms),
        }
    }
}

/// Fits the equation of each joint alone.
///
/// # Errors
/// [`IdentifyError`]: a recording that cannot be read.
pub(crate) fn own_fits<'a>(
    problem: &Problem,
    equations: &'a [TriangularFactor],
) -> Result<Vec<OwnFit<'a>>, IdentifyError> {
    let fits: Vec<Values> = equations.iter().map(Values::of).collect();
    let mut memories = vec![Autocorrelation::default(); fits.len()];
    for recording in problem.training {
        each_rows(
            *recording,
            problem.plan,
            problem.options.model,
            &mut |rows| {
                let joints = rows.equations.iter().zip(&fits).zip(&mut memories);
                for ((equation, fit), memory) in joints {
                    let p = fit.values.len();
                    for i in (0..equation.y.len()).filter(|i| equation.keep[*i]) {
                        let x = &equation.x[i * p..(i + 1) * p];
                        memory.push(equation.y[i] - dot_in_order(x, &fit.values));
                    }
                }
                Ok(())
            },
        )?;
    }
    let own =
        |((equation, fit), memory): ((&'a TriangularFactor, &Values), &Autocorrelation)| OwnFit {
            equation,
            std: fit.std * memory.correlation_time().max(1.0).sqrt(),
        };
    Ok(equations
        .iter()
        .zip(&fits)
        .zip(&memories)
        .map(own)
        .collect())
}

/// Returns true if a sum of squares in units of the noise is as improbable as a value that counts as contradicted.
pub(crate) fn is_contradicted(squares: f64, freedom: usize) -> bool {
    let chance = 2.0 * Normal::standard().sf(CONTRADICTED);
    ChiSquared::new(freedom as f64).is_ok_and(|d| d.sf(squares) < chance)
}

/// Returns orthonormal directions that span columns, whatever their sizes.
pub(crate) fn directions(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let largest = matrix.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
    let columns: Vec<DVector<f64>> = (matrix.column_iter())
        .filter(|c| c.norm() > ROUNDING * largest)
        .map(|c| c.normalize())
        .collect();
    if columns.is_empty() {
        return DMatrix::zeros(matrix.nrows(), 0);
    }
    let svd = Svd::of(DMatrix::from_columns(&columns));
    let most = svd.singular_values.max();
    let kept: Vec<usize> = (0..svd.singular_values.len())
        .filter(|k| svd.singular_values[*k] > ROUNDING.sqrt() * most)
        .collect();
    svd.u.select_columns(&kept)
}
