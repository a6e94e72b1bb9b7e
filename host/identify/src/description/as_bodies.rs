//! Physically consistent links for base parameters from another fit.
//!
//! An unconstrained fit may give impossible links and an inertia matrix that is not positive definite, which cannot be
//! simulated. The result is the nearest physically consistent set ([`crate::bodies::consistent`]) in the metric of the
//! data.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::combinations::Combinations;
use super::written::written;
use crate::bodies::consistent::consistent;
use crate::bodies::hints::{Sizes, hints};
use crate::bodies::prior::Prior;
use crate::bodies::quadratic::Quadratic;
use crate::error::IdentifyError;
use rig_model::robot::{DESCRIBED, Robot};

/// `robot` with physically consistent links.
pub struct Bodies {
    /// The robot with them.
    pub robot: Robot,
    /// Their base parameters.
    pub values: Vec<f64>,
    /// Remarks, sentences.
    pub remarks: Vec<String>,
}

/// Finds the bodies nearest to base parameters; `information` is the inverse of their covariance.
///
/// # Errors
/// [`IdentifyError::Inconsistent`].
pub fn as_bodies(
    robot: &Robot,
    base: &Combinations,
    information: DMatrix<f64>,
    sizes: Sizes,
) -> Result<Bodies, IdentifyError> {
    let columns = base.combination.ncols();
    let prior = Prior::of(
        robot,
        columns,
        &hints(columns, (base.columns, base.values), sizes),
        DESCRIBED,
    );
    // R with RᵀR the information matrix, which may be singular.
    let SymmetricEigen {
        eigenvalues,
        eigenvectors,
    } = information.symmetric_eigen();
    let root = DMatrix::from_diagonal(&eigenvalues.map(|e| e.max(0.0).sqrt()));
    let r = root * eigenvectors.transpose();
    let data = Quadratic {
        right: &r * DVector::from_column_slice(base.values),
        matrix: r * base.combination,
    };
    let pi = DVector::from_vec(consistent(&data, &prior)?.parameters);
    let values = (base.combination * &pi).as_slice().to_vec();
    let (robot, remarks) = written(robot, &pi, prior.remarks);
    Ok(Bodies {
        robot,
        values,
        remarks,
    })
}
