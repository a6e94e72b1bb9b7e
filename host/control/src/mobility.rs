//! How an arm moves its tool: Jacobian, mobility, and the tool's inertia.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::design::at_start;
use super::error::ControlError;
use super::law_model::LawModel;
use super::tool::tool_pose;

/// Returns the position of the tool and its Jacobian (3 × n) at a pose.
pub(crate) fn jacobian(
    model: &LawModel,
    q: &[f64],
    tool: [f64; 3],
) -> Result<([f64; 3], DMatrix<f64>), ControlError> {
    let mut columns = vec![[0.0; 6]; q.len()];
    let position = tool_pose(&model.chain, q, tool, &mut columns)?;
    let matrix = DMatrix::from_fn(3, q.len(), |axis, j| columns[j][axis]);
    Ok((position, matrix))
}

/// Returns the inverse of the inertia matrix at a pose.
pub(crate) fn inverse_inertia(model: &LawModel, q: &[f64]) -> Result<DMatrix<f64>, ControlError> {
    let n = q.len();
    let mut mass = vec![0.0; n * n];
    model
        .view()
        .inertia_matrix(q, &mut mass)
        .map_err(at_start)?;
    let mass = DMatrix::from_row_slice(n, n, &mass);
    mass.try_inverse().ok_or_else(|| {
        ControlError::Unreachable("The inertia matrix of the law's model cannot be inverted; give every joint an inertia.".to_owned())
    })
}

/// Returns the mobility of the tool J·A⁻¹·Jᵀ, m/(N·s²).
pub(crate) fn mobility(
    model: &LawModel,
    q: &[f64],
    matrix: &DMatrix<f64>,
) -> Result<Matrix3<f64>, ControlError> {
    let full = matrix * inverse_inertia(model, q)? * matrix.transpose();
    Ok(Matrix3::from_fn(|a, b| full[(a, b)]))
}

/// Returns the inertia of the tool along `normal` while it is free to move in all directions, kg: 1/(nᵀ·J·A⁻¹·Jᵀ·n).
/// No constraint along the surface makes it smaller.
pub(crate) fn free_inertia(
    model: &LawModel,
    q: &[f64],
    tool: [f64; 3],
    normal: [f64; 3],
) -> Result<f64, ControlError> {
    let (_, matrix) = jacobian(model, q, tool)?;
    let normal = Vector3::from(normal);
    Ok(1.0 / normal.dot(&(mobility(model, q, &matrix)? * normal)))
}
