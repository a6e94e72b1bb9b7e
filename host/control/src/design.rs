//! Gains for a robot, from the law's own model.

use nalgebra::{DMatrix, SymmetricEigen};

use super::error::ControlError;
use super::law_model::LawModel;
use rig_model::simulate::SimulateError;
use rig_shared::control::arm::ControlFault;
use rig_shared::transmission::MotorSpace;

/// Converts a fault of the design, before the motion begins.
pub(crate) fn at_start(fault: ControlFault) -> ControlError {
    match fault {
        ControlFault::Multibody(error) => SimulateError::from(error).into(),
        ControlFault::Transmission(error) => SimulateError::from(error).into(),
        fault => ControlError::Law {
            law: "design",
            time: 0.0,
            fault,
        },
    }
}

/// Inertias that gains are designed for.
pub(crate) struct Inertias {
    /// The largest of each joint over some positions, kg·m² or kg, in joint or in motor coordinates.
    pub largest: Vec<f64>,
    /// Largest ratio of them to the inertia that moves with the other joints free, over the same positions and all
    /// directions of motion; at least 1.
    pub lambda: f64,
    /// The joint that moves most in that direction, weighted by its inertia.
    pub lightest: usize,
}

/// Returns the inertia matrix at some positions, in joint or in motor coordinates.
fn matrix(model: &LawModel, q: &[f64], of_motors: bool) -> Result<Vec<f64>, ControlError> {
    let n = model.chain.joint_count();
    let mut matrix = vec![0.0; n * n];
    (model.view())
        .inertia_matrix(q, &mut matrix)
        .map_err(at_start)?;
    let Some(motors) = model.motors.as_ref().filter(|_| of_motors) else {
        return Ok(matrix);
    };
    let mut turned = vec![0.0; n * n];
    let space =
        MotorSpace::at(&motors.transmission, q, &vec![0.0; n]).map_err(SimulateError::from)?;
    (space.inertia_matrix(&matrix, &mut turned)).map_err(SimulateError::from)?;
    Ok(turned)
}

/// Returns the inertias of a model over some positions.
pub(crate) fn inertias(
    model: &LawModel,
    positions: &[Vec<f64>],
    of_motors: bool,
) -> Result<Inertias, ControlError> {
    let n = model.chain.joint_count();
    let matrices = (positions.iter())
        .map(|q| matrix(model, q, of_motors))
        .collect::<Result<Vec<_>, _>>()?;
    let mut largest = vec![0.0_f64; n];
    for matrix in &matrices {
        for (j, own) in largest.iter_mut().enumerate() {
            *own = own.max(matrix[j * n + j]);
        }
    }
    let (mut lambda, mut lightest) = (1.0, 0);
    for matrix in &matrices {
        let scaled = DMatrix::from_fn(n, n, |r, c| {
            matrix[r * n + c] / (largest[r] * largest[c]).sqrt()
        });
        let eigen = SymmetricEigen::new(scaled);
        let (at, least) = eigen.eigenvalues.argmin();
        if least > 0.0 && 1.0 / least > lambda {
            lambda = 1.0 / least;
            lightest = eigen.eigenvectors.column(at).iamax();
        }
    }
    Ok(Inertias {
        largest,
        lambda,
        lightest,
    })
}
