//! Fits of each joint's torque alone, with parameters of their own.
//!
//! A wrong factor of a joint's torques stays in the residual of a fit that all joints share. The joint's own fit is as good
//! with the factor as without it, so its residual is the noise against which the factor is judged.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use crate::error::IdentifyError;
use crate::estimators::problem::Problem;
use crate::options::ModelKind;
use crate::rows::factor::TriangularFactor;
use crate::rows::stream::each_rows;
use crate::uncertainty::residual::LEAST_ERROR;
use rig_model::robot::CONTRADICTED;
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::svd::Svd;
use rig_numerics::vector::dot_in_order;
use rig_shared::multibody::{COLUMNS, column};

/// Relative singular value below which a direction is rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Number of columns of friction that changes with load and position.
const VARYING: usize = 6;
/// Friction among the standard parameters of a joint.
const FRICTION: [usize; 3] = [column::VISCOUS, column::COULOMB, column::OFFSET];

/// The fit of a joint's torque alone.
pub(crate) struct OwnFit {
    /// Triangular factor of the joint's rows, and their torque in its directions.
    pub system: (DMatrix<f64>, DVector<f64>),
    /// Number of rows.
    pub rows: u64,
    /// Fitted values of the base columns.
    pub values: Vec<f64>,
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
pub(crate) fn own_fits(
    problem: &Problem,
    equations: &[TriangularFactor],
) -> Result<Vec<OwnFit>, IdentifyError> {
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
    let own = |((equation, fit), memory): ((&TriangularFactor, Values), &Autocorrelation)| OwnFit {
        system: equation.system(),
        rows: equation.rows(),
        values: fit.values,
        std: fit.std * memory.correlation_time().max(1.0).sqrt(),
    };
    Ok(equations.iter().zip(fits).zip(&memories).map(own).collect())
}

/// Fits the equation of each joint alone beside friction that changes with load and position: what its torque then shows
/// of the parameters. The residual's memory is that of `fits`. `None` for equations that are no torques at instants.
///
/// # Errors
/// [`IdentifyError`]: a recording that cannot be read.
pub(crate) fn beside_varying_friction(
    problem: &Problem,
    fits: &[OwnFit],
) -> Result<Option<Vec<OwnFit>>, IdentifyError> {
    if problem.options.model != ModelKind::Differential {
        return Ok(None);
    }
    let is_friction: Vec<bool> = (problem.base.columns.iter())
        .map(|c| FRICTION.contains(&(c % COLUMNS)))
        .collect();
    let p = is_friction.len();
    let mut factors = vec![TriangularFactor::new(VARYING + p); fits.len()];
    let mut plain = vec![0.0; fits.len()];
    for recording in problem.training {
        each_rows(
            *recording,
            problem.plan,
            problem.options.model,
            &mut |rows| {
                let mut row = vec![0.0; VARYING + p];
                for (j, (equation, fit)) in rows.equations.iter().zip(fits).enumerate() {
                    for i in (0..equation.y.len()).filter(|i| equation.keep[*i]) {
                        let x = &equation.x[i * p..(i + 1) * p];
                        let load: f64 = (x.iter().zip(&fit.values).zip(&is_friction))
                            .filter(|(_, friction)| !**friction)
                            .map(|((x, value), _)| x * value)
                            .sum();
                        let columns = varying_friction(rows.q[j][i], rows.qd[j][i], load);
                        row[..VARYING].copy_from_slice(&columns);
                        row[VARYING..].copy_from_slice(x);
                        factors[j].push(&row, equation.y[i], 1.0);
                        plain[j] += (equation.y[i] - dot_in_order(x, &fit.values)).powi(2);
                    }
                }
                Ok(())
            },
        )?;
    }
    let own = |((factor, fit), plain): ((&TriangularFactor, &OwnFit), f64)| {
        let (r, z) = factor.system();
        let left = factor.residual_squares(Values::of(factor).values.as_slice());
        OwnFit {
            system: (
                r.view((VARYING, VARYING), (p, p)).into_owned(),
                z.rows(VARYING, p).into_owned(),
            ),
            rows: factor.rows(),
            values: fit.values.clone(),
            std: fit.std * (left / plain.max(f64::MIN_POSITIVE)).sqrt().min(1.0),
        }
    };
    Ok(Some(
        (factors.iter().zip(fits).zip(plain)).map(own).collect(),
    ))
}

/// Returns friction that grows with the load, and that changes with the position once a turn, per unit of each.
fn varying_friction(q: f64, qd: f64, load: f64) -> [f64; VARYING] {
    let (sine, cosine) = q.sin_cos();
    let sense = if qd == 0.0 { 0.0 } else { qd.signum() };
    [load.abs(), cosine, sine]
        .map(|size| [size * sense, size * qd])
        .as_flattened()
        .try_into()
        .unwrap_or([0.0; VARYING])
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
