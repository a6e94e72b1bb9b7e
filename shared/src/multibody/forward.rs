//! Forward dynamics.

use super::capacity::with_capacity;
use super::chain::{Chain, MAX_JOINTS, MultibodyError, check};
use super::inertia_matrix::inertia_matrix;
use super::inverse::bias_torque;
use super::parameters::COLUMNS;
use crate::cholesky;
use crate::scalar::Real;

/// Computes the accelerations q̈ (length n) under the torques `tau`: A(q)·q̈ = τ − bias(q, q̇), with the inertia matrix
/// of the composite-rigid-body algorithm and a Cholesky factorisation (Featherstone 2008, sec. 6.2). The factorisation
/// detects an A that is not positive definite, as identified parameters may give. O(n³), with n at most [`MAX_JOINTS`].
/// [`super::articulated_forward_dynamics`] computes the same in O(n).
///
/// # Errors
/// [`MultibodyError::WrongLength`]; [`MultibodyError::NotPositiveDefinite`], also if a number is NaN. `qdd` is then
/// untouched.
pub fn forward_dynamics<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    tau: &[T],
    qdd: &mut [T],
) -> Result<(), MultibodyError> {
    let n = chain.joint_count();
    check("tau", n, tau.len())?;
    check("qdd", n, qdd.len())?;
    let mut free = [T::ZERO; MAX_JOINTS];
    let free = &mut free[..n];
    bias_torque(chain, parameters, q, qd, free)?;
    for (entry, &torque) in free.iter_mut().zip(tau) {
        *entry = torque - *entry;
    }
    with_capacity!(n, accelerate(chain, parameters, q, free))?;
    qdd.copy_from_slice(free);
    Ok(())
}

/// Replaces the net torques by the accelerations.
fn accelerate<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    x: &mut [T],
) -> Result<(), MultibodyError> {
    let n = chain.joint_count();
    // A square with constant generics is not expressible; the rows of a CAPACITY × CAPACITY array are.
    let mut square = [[T::ZERO; CAPACITY]; CAPACITY];
    let matrix = square.as_flattened_mut();
    let matrix = &mut matrix[..n * n];
    inertia_matrix(chain, parameters, q, matrix)?;
    solve_positive_definite(matrix, x)
}

/// Replaces `x` (length n) by the solution of A·y = x by Cholesky's factorisation, for a symmetric A (n × n, row-major)
/// such as an inertia matrix with that of the motors. The factor replaces the lower triangle of A.
///
/// # Errors
/// [`MultibodyError::WrongLength`]; [`MultibodyError::NotPositiveDefinite`], also if a number is NaN. `x` is then
/// untouched.
pub fn solve_positive_definite<T: Real>(
    matrix: &mut [T],
    x: &mut [T],
) -> Result<(), MultibodyError> {
    let n = x.len();
    check("matrix", n * n, matrix.len())?;
    cholesky::factorise(matrix, n)
        .map_err(|joint| MultibodyError::NotPositiveDefinite { joint })?;
    cholesky::solve(matrix, x);
    Ok(())
}
