//! The differential model without acceleration: momentum and its rate.
//!
//! Lagrange's equations are d/dt (A(q)·q̇) = τ + ∂T/∂q − g(q) − friction. All terms are linear in the parameters, so
//!
//! τ = d/dt (P(q, q̇))·π + R(q, q̇)·π
//!
//! Any low-pass F(s) on both sides gives F(τ) = (s·F(P) + F(R))·π, and the filter's state gives s·F. This is a
//! regressor of the differential model without q̈ (Hsu, Bodson, Sastry & Paden 1987; Slotine & Li 1991, sec. 9.2). The
//! caller has the filter, which must be the same for torque, P and R.

use super::capacity::with_capacity;
use super::chain::{Chain, MultibodyError, check};
use super::inverse::LinkMotion;
use super::parameters::{COLUMNS, column};
use super::regressor::link_columns;
use super::spatial::{Motion, Vector3};
use crate::scalar::Real;

/// Computes the regressor P of the momentum, A(q)·q̇ = P·π with the drives' Ia·q̇, n × 14n row-major like
/// [`super::differential_regressor`]; its friction and offset columns are 0.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn momentum_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.projected([q, qd], out, |axes, [q, qd], wide| {
            momentum_regressor(axes, q, qd, wide)
        });
    }
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("out", n * chain.parameter_count(), out.len())?;
    with_capacity!(n, momentum(chain, q, qd, out));
    Ok(())
}

/// Computes the regressor R of the torque that does not change the momentum: g(q) − ∂T/∂q + fv·q̇ + fc·sgn q̇ + off =
/// R·π, n × 14n row-major.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn momentum_loss_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.projected([q, qd], out, |axes, [q, qd], wide| {
            momentum_loss_regressor(axes, q, qd, wide)
        });
    }
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("out", n * chain.parameter_count(), out.len())?;
    with_capacity!(n, loss(chain, q, qd, out));
    Ok(())
}

/// The chain has at most `CAPACITY` joints.
fn momentum<T: Real, const CAPACITY: usize>(chain: &Chain<T>, q: &[T], qd: &[T], out: &mut [T]) {
    let width = chain.parameter_count();
    let mut axes = [Motion::ZERO; CAPACITY];
    let mut velocity = Motion::ZERO;
    out.fill(T::ZERO);
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        velocity = joint.velocity(&transform, velocity, qd[i]);
        // The momentum is the inertial wrench of a start from rest with the velocity as acceleration.
        let start = LinkMotion {
            velocity: Vector3::ZERO,
            acceleration: velocity.angular,
            proper: velocity.linear,
        };
        for axis in &mut axes[..i] {
            *axis = transform.motion_to_child(*axis);
        }
        axes[i] = joint.axis();
        for (j, axis) in axes[..=i].iter().enumerate() {
            let at = j * width + i * COLUMNS;
            link_columns(&start, axis, &mut out[at..at + COLUMNS]);
        }
        out[i * width + i * COLUMNS + column::DRIVE_INERTIA] = qd[i];
    }
}

/// The chain has at most `CAPACITY` joints.
fn loss<T: Real, const CAPACITY: usize>(chain: &Chain<T>, q: &[T], qd: &[T], out: &mut [T]) {
    let width = chain.parameter_count();
    let mut axes = [Motion::ZERO; CAPACITY];
    // Velocity of the link before joint j, transformed like the axes.
    let mut before = [Motion::ZERO; CAPACITY];
    let mut velocity = Motion::ZERO;
    let mut gravity = chain.gravity;
    out.fill(T::ZERO);
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        for (axis, motion) in axes[..i].iter_mut().zip(&mut before[..i]) {
            *axis = transform.motion_to_child(*axis);
            *motion = transform.motion_to_child(*motion);
        }
        axes[i] = joint.axis();
        before[i] = transform.motion_to_child(velocity);
        velocity = joint.velocity(&transform, velocity, qd[i]);
        gravity = transform.direction_to_child(gravity);
        let rest = LinkMotion {
            velocity: Vector3::ZERO,
            acceleration: Vector3::ZERO,
            proper: -gravity,
        };
        for j in 0..=i {
            let at = j * width + i * COLUMNS;
            let block = &mut out[at..at + COLUMNS];
            link_columns(&rest, &axes[j], block);
            // Seen from link i, a motion of joint j reverses the motion of the joints before j: ∂v/∂q_j = v_before ×
            // s_j.
            let slope = before[j].cross(axes[j]);
            let Vector3([hx, hy, hz]) =
                slope.linear.cross(velocity.angular) + velocity.linear.cross(slope.angular);
            let ([dx, dy, dz], [wx, wy, wz]) = (slope.angular.0, velocity.angular.0);
            let values = [
                slope.linear.dot(velocity.linear),
                hx,
                hy,
                hz,
                dx * wx,
                dx * wy + dy * wx,
                dx * wz + dz * wx,
                dy * wy,
                dy * wz + dz * wy,
                dz * wz,
            ];
            for (entry, value) in block.iter_mut().zip(values) {
                *entry -= value;
            }
        }
        let own = i * width + i * COLUMNS;
        out[own + column::VISCOUS] = qd[i];
        out[own + column::COULOMB] = qd[i].sgn();
        out[own + column::OFFSET] = T::ONE;
    }
}
