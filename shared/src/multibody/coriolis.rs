//! The matrix of Coriolis and centrifugal torques.

use super::capacity::with_capacity;
use super::chain::{Chain, MultibodyError, check};
use super::parameters::{COLUMNS, inertia};
use super::spatial::{Motion, Wrench};
use crate::scalar::Real;

/// Computes the matrix C(q, q̇), n × n row-major, by the Christoffel symbols. C(q, q̇)·q̇ are the Coriolis and
/// centrifugal torques, and Ȧ − 2C is skew-symmetric, as the stability proof of Slotine & Li (1987) requires.
///
/// Built from the links' Jacobians J (body frames): C = Σ Jᵀ·(M·J̇ + B·J) with
/// 2·B·w = M·(v × w) + v ×* (M·w) + w ×* (M·v), the Levi-Civita connection of the kinetic energy of one free
/// body (Echeandia & Wensing 2021 give the same matrix). Drive inertias are constant and add nothing.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn coriolis_matrix<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        // C = Mᵀ·C_axes·M: M is constant, so Ȧ − 2C stays skew-symmetric.
        return chain.matrix(parameters, [q, qd], out, |axes, rows, [q, qd], wide| {
            coriolis_matrix(axes, rows, q, qd, wide)
        });
    }
    let n = chain.joint_count();
    check("parameters", n, parameters.len())?;
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("out", n * n, out.len())?;
    with_capacity!(n, christoffel(chain, parameters, q, qd, out));
    Ok(())
}

/// All slices have the lengths checked above; the chain has at most `CAPACITY` joints.
fn christoffel<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    out: &mut [T],
) {
    let n = chain.joint_count();
    let half = T::from_f64(0.5);
    let mut axes = [Motion::ZERO; CAPACITY];
    let mut rates = [Motion::ZERO; CAPACITY];
    let mut velocity = Motion::ZERO;
    out.fill(T::ZERO);
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        let step = joint.axis().scaled(-qd[i]);
        velocity = joint.velocity(&transform, velocity, qd[i]);
        for (axis, rate) in axes[..i].iter_mut().zip(&mut rates[..i]) {
            *axis = transform.motion_to_child(*axis);
            // In frame i, an axis fixed below moves backwards as joint i moves forwards.
            *rate = transform.motion_to_child(*rate).plus(step.cross(*axis));
        }
        axes[i] = joint.axis();
        let body = inertia(&parameters[i]);
        let momentum = body.times(velocity);
        for k in 0..=i {
            let (axis, rate) = (axes[k], rates[k]);
            let connection: Wrench<T> = body
                .times(velocity.cross(axis))
                .plus(velocity.cross_wrench(body.times(axis)))
                .plus(axis.cross_wrench(momentum));
            let wrench = body.times(rate).plus(connection.scaled(half));
            for (j, row) in axes[..=i].iter().enumerate() {
                out[j * n + k] += row.dot(wrench);
            }
        }
    }
}
