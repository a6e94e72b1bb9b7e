//! The inertia matrix by the composite-rigid-body algorithm.

use super::capacity::with_capacity;
use super::chain::{Chain, MultibodyError, check};
use super::parameters::{COLUMNS, column, inertia};
use super::spatial::{Inertia, Transform};
use crate::scalar::Real;

/// Computes the inertia matrix A(q), n × n row-major and symmetric, with the drive inertias Ia on its diagonal:
/// composite-rigid-body algorithm (Walker & Orin 1982; Featherstone 2008, table 6.2).
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn inertia_matrix<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.matrix(parameters, [q], out, |axes, rows, [q], wide| {
            inertia_matrix(axes, rows, q, wide)
        });
    }
    let n = chain.joint_count();
    check("parameters", n, parameters.len())?;
    check("q", n, q.len())?;
    check("out", n * n, out.len())?;
    with_capacity!(n, composite_bodies(chain, parameters, q, out));
    Ok(())
}

/// All slices have the lengths checked above; the chain has at most `CAPACITY` joints.
fn composite_bodies<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    out: &mut [T],
) {
    let n = chain.joint_count();
    let mut transforms = [Transform::IDENTITY; CAPACITY];
    for (i, joint) in chain.joints.iter().enumerate() {
        transforms[i] = joint.transform(q[i]);
    }
    // The links from i outwards as one body, in frame i.
    let mut carried: Option<Inertia<T>> = None;
    for (i, joint) in chain.joints.iter().enumerate().rev() {
        let own = inertia(&parameters[i]);
        let composite = carried.map_or(own, |outer| own.plus(outer));
        let mut wrench = composite.times(joint.axis());
        out[i * n + i] = joint.project(wrench) + parameters[i][column::DRIVE_INERTIA];
        for j in (0..i).rev() {
            wrench = transforms[j + 1].wrench_to_parent(wrench);
            let entry = chain.joints[j].project(wrench);
            out[i * n + j] = entry;
            out[j * n + i] = entry;
        }
        carried = Some(transforms[i].inertia_to_parent(composite));
    }
}
