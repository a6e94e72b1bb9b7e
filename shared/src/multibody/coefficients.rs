//! Coefficients of the products and squares of the joint velocities.

use super::capacity::with_capacity;
use super::chain::{Chain, MAX_JOINTS, MultibodyError, check};
use super::coriolis::coriolis_matrix;
use super::parameters::COLUMNS;
use crate::scalar::Real;

/// Computes B(q), n × n(n−1)/2, and C̄(q), n × n, row-major, so that the Coriolis and centrifugal torques are
/// B(q)·[q̇₁q̇₂, q̇₁q̇₃, …, q̇₁q̇ₙ, q̇₂q̇₃, …]ᵀ + C̄(q)·[q̇₁², …, q̇ₙ²]ᵀ
/// (Kozłowski 1998, nomenclature; Khalil & Dombre 2002, eq. 9.11; Craig 1986, sec. 6.9):
///
/// B_ijk = ∂A_ij/∂q_k + ∂A_ik/∂q_j − ∂A_jk/∂q_i for j < k, C̄_ij = ∂A_ij/∂q_j − ½·∂A_jj/∂q_i.
///
/// They are the Christoffel symbols of A, B_ijk = 2·c_ijk and C̄_ij = c_ijj. They equal the entries of
/// [`coriolis_matrix`] at unit velocities, and are exact without difference quotients.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn velocity_coefficients<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    b: &mut [T],
    c: &mut [T],
) -> Result<(), MultibodyError> {
    let n = chain.joint_count();
    check("parameters", chain.link_count(), parameters.len())?;
    check("q", n, q.len())?;
    check("b", n * (n * (n - 1) / 2), b.len())?;
    check("c", n * n, c.len())?;
    with_capacity!(n, christoffel_symbols(chain, parameters, q, b, c))
}

/// Returns the column of B that belongs to q̇ⱼ·q̇ₖ, j < k, both from 0, in a chain of n joints.
pub const fn pair_column(n: usize, j: usize, k: usize) -> usize {
    j * n - j * (j + 1) / 2 + k - j - 1
}

/// The chain has at most `CAPACITY` joints.
fn christoffel_symbols<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    b: &mut [T],
    c: &mut [T],
) -> Result<(), MultibodyError> {
    let n = chain.joint_count();
    let pairs = n * (n - 1) / 2;
    // A square with constant generics is not expressible; the rows of a CAPACITY × CAPACITY array are.
    let mut square = [[T::ZERO; CAPACITY]; CAPACITY];
    let square = &mut square.as_flattened_mut()[..n * n];
    for j in 0..n {
        let mut unit = [T::ZERO; MAX_JOINTS];
        unit[j] = T::ONE;
        coriolis_matrix(chain, parameters, q, &unit[..n], square)?;
        for i in 0..n {
            c[i * n + j] = square[i * n + j];
            for k in j + 1..n {
                let symbol = square[i * n + k];
                b[i * pairs + pair_column(n, j, k)] = symbol + symbol;
            }
        }
    }
    Ok(())
}
