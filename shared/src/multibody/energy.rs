//! Energies of a chain and their regressors: the integral (energy) model.
//!
//! The integral model needs no acceleration: over any window, ∫ τᵀq̇ dt = H(end) − H(start) + ∫ (fv·q̇² + fc·|q̇| + off·q̇) dt
//! (Gautier & Khalil 1988; Khalil & Dombre 2002, ch. 12). The regressors here are the rows of H and of the integrand;
//! the caller chooses the window.

use super::chain::{Chain, MultibodyError, check};
use super::inverse::LinkMotion;
use super::parameters::{COLUMNS, column, inertia};
use super::regressor::link_columns;
use super::spatial::{Motion, Vector3};
use crate::scalar::Real;

/// Computes the row of the kinetic energy, length 14n: T = row·π, with ½·Ia·q̇² of the drives.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn kinetic_energy_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.arranged([q, qd], out, |axes, [q, qd], wide| {
            kinetic_energy_regressor(axes, q, qd, wide)
        });
    }
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("out", chain.parameter_count(), out.len())?;
    out.fill(T::ZERO);
    add_kinetic(chain, q, qd, out);
    Ok(())
}

/// Computes the row of the potential energy, length 14n: U = row·π, zero for a link at the origin of the base frame.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn potential_energy_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.arranged([q], out, |axes, [q], wide| {
            potential_energy_regressor(axes, q, wide)
        });
    }
    check("q", chain.joint_count(), q.len())?;
    check("out", chain.parameter_count(), out.len())?;
    out.fill(T::ZERO);
    add_potential(chain, q, out);
    Ok(())
}

/// Computes the row of the total mechanical energy, length 14n: H(q, q̇) = T + U = row·π. Its friction and offset
/// columns are 0; [`friction_power_regressor`] computes them.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn energy_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.arranged([q, qd], out, |axes, [q, qd], wide| {
            energy_regressor(axes, q, qd, wide)
        });
    }
    kinetic_energy_regressor(chain, q, qd, out)?;
    add_potential(chain, q, out);
    Ok(())
}

/// Computes the row of the power of friction and offsets, length 14n: fv·q̇² + fc·|q̇| + off·q̇ = row·π, all other
/// columns 0. Its integral over a window plus the difference of [`energy_regressor`] at its ends is a row of the
/// integral model for y = ∫ τᵀq̇ dt.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn friction_power_regressor<T: Real>(
    chain: &Chain<T>,
    qd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    check("qd", chain.joint_count(), qd.len())?;
    check("out", chain.parameter_count(), out.len())?;
    out.fill(T::ZERO);
    for (block, &speed) in out.chunks_exact_mut(COLUMNS).zip(qd) {
        block[column::VISCOUS] = speed.squared();
        block[column::COULOMB] = speed.abs();
        block[column::OFFSET] = speed;
    }
    Ok(())
}

/// Computes the row of the power of the torques, length 14n: q̇ᵀτ = row·π, the power model (Gautier 1997). It is the
/// rate of the energy plus the power of friction and offsets. It equals q̇ᵀ·Y of [`super::differential_regressor`] but
/// costs O(n): every wrench of a link acts on the link's own velocity.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn power_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.arranged([q, qd, qdd], out, |axes, [q, qd, qdd], wide| {
            power_regressor(axes, q, qd, qdd, wide)
        });
    }
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("qdd", n, qdd.len())?;
    check("out", chain.parameter_count(), out.len())?;
    let mut velocity = Motion::ZERO;
    let mut motion = LinkMotion::base(chain.gravity);
    for (i, (joint, block)) in chain
        .joints
        .iter()
        .zip(out.chunks_exact_mut(COLUMNS))
        .enumerate()
    {
        let transform = joint.transform(q[i]);
        velocity = joint.velocity(&transform, velocity, qd[i]);
        motion = motion.next(joint, &transform, qd[i], qdd[i]);
        link_columns(&motion, &velocity, block);
        block[column::DRIVE_INERTIA] = qd[i] * qdd[i];
        block[column::VISCOUS] = qd[i].squared();
        block[column::COULOMB] = qd[i].abs();
        block[column::OFFSET] = qd[i];
    }
    Ok(())
}

/// Returns the kinetic energy in J, drives included.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn kinetic_energy<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
) -> Result<T, MultibodyError> {
    if chain.has_followers() {
        return chain.on_bodies(parameters, [q, qd], |axes, rows, [q, qd]| {
            kinetic_energy(axes, rows, q, qd)
        });
    }
    let n = chain.joint_count();
    check("parameters", n, parameters.len())?;
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    let mut twice = T::ZERO;
    let mut velocity = Motion::ZERO;
    for (i, joint) in chain.joints.iter().enumerate() {
        velocity = joint.velocity(&joint.transform(q[i]), velocity, qd[i]);
        let row = &parameters[i];
        twice += velocity.dot(inertia(row).times(velocity))
            + row[column::DRIVE_INERTIA] * qd[i].squared();
    }
    Ok(T::from_f64(0.5) * twice)
}

/// Returns the potential energy in J, zero for a link at the origin of the base frame.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn potential_energy<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
) -> Result<T, MultibodyError> {
    if chain.has_followers() {
        return chain.on_bodies(parameters, [q], |axes, rows, [q]| {
            potential_energy(axes, rows, q)
        });
    }
    let n = chain.joint_count();
    check("parameters", n, parameters.len())?;
    check("q", n, q.len())?;
    let mut energy = T::ZERO;
    let mut field = GravityField::base(chain);
    for (i, joint) in chain.joints.iter().enumerate() {
        field = field.next(&joint.transform(q[i]));
        let body = inertia(&parameters[i]);
        energy -= body.mass * field.depth + body.first_moment.dot(field.gravity);
    }
    Ok(energy)
}

/// Gravity in a link's frame.
struct GravityField<T> {
    /// Gravity in the link's frame.
    gravity: Vector3<T>,
    /// Gravity times the position of the link's origin in the base frame.
    depth: T,
}

impl<T: Real> GravityField<T> {
    #[inline(always)]
    fn base(chain: &Chain<T>) -> Self {
        Self {
            gravity: chain.gravity,
            depth: T::ZERO,
        }
    }

    #[inline(always)]
    fn next(&self, transform: &super::spatial::Transform<T>) -> Self {
        Self {
            gravity: transform.direction_to_child(self.gravity),
            depth: self.depth + self.gravity.dot(transform.origin),
        }
    }
}

/// Adds the row of the kinetic energy; the callers check lengths.
fn add_kinetic<T: Real>(chain: &Chain<T>, q: &[T], qd: &[T], out: &mut [T]) {
    let half = T::from_f64(0.5);
    let mut velocity = Motion::ZERO;
    for (i, joint) in chain.joints.iter().enumerate() {
        velocity = joint.velocity(&joint.transform(q[i]), velocity, qd[i]);
        let Vector3([wx, wy, wz]) = velocity.angular;
        // v·(ω × m·c) = m·c·(v × ω)
        let Vector3([hx, hy, hz]) = velocity.linear.cross(velocity.angular);
        let values = [
            half * velocity.linear.dot(velocity.linear),
            hx,
            hy,
            hz,
            half * wx * wx,
            wx * wy,
            wx * wz,
            half * wy * wy,
            wy * wz,
            half * wz * wz,
            half * qd[i].squared(),
        ];
        for (entry, value) in out[i * COLUMNS..].iter_mut().zip(values) {
            *entry += value;
        }
    }
}

/// Adds the row of the potential energy; the callers check lengths.
fn add_potential<T: Real>(chain: &Chain<T>, q: &[T], out: &mut [T]) {
    let mut field = GravityField::base(chain);
    for (i, joint) in chain.joints.iter().enumerate() {
        field = field.next(&joint.transform(q[i]));
        let Vector3([gx, gy, gz]) = field.gravity;
        for (entry, value) in out[i * COLUMNS..].iter_mut().zip([field.depth, gx, gy, gz]) {
            *entry -= value;
        }
    }
}
