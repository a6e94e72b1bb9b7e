//! The regressor of the differential model: τ = Y(q, q̇, q̈)·π.

use super::capacity::with_capacity;
use super::chain::{Chain, MultibodyError, check};
use super::inverse::LinkMotion;
use super::parameters::{COLUMNS, column};
use super::spatial::{Motion, Vector3};
use crate::scalar::Real;

/// Computes the regressor Y of the differential model (Atkeson, An & Hollerbach 1986; Khalil & Dombre 2002, ch. 12),
/// with gravity, so that τ = Y·π. π holds the parameters of all joints one after the other.
///
/// `q`, `qd`, `qdd` have length n; `out` is n × 14n, row-major: entry (j, 14·i + k) multiplies parameter k of
/// joint i in the torque of joint j. It is 0 for j > i: a link does not load the joints beyond it.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn differential_regressor<T: Real>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    out: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        return chain.projected([q, qd, qdd], out, |axes, [q, qd, qdd], wide| {
            differential_regressor(axes, q, qd, qdd, wide)
        });
    }
    let n = chain.joint_count();
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("qdd", n, qdd.len())?;
    check("out", n * chain.parameter_count(), out.len())?;
    with_capacity!(n, regressor(chain, q, qd, qdd, out));
    Ok(())
}

/// One pass outwards, which transforms the axes of the joints below to the frame of the current link, two vectors each.
/// A pass inwards would have to transform ten wrenches of each link to every joint.
fn regressor<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    out: &mut [T],
) {
    let width = chain.parameter_count();
    let mut axes = [Motion::ZERO; CAPACITY];
    let mut motion = LinkMotion::base(chain.gravity);
    out.fill(T::ZERO);
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        motion = motion.next(joint, &transform, qd[i], qdd[i]);
        for axis in &mut axes[..i] {
            *axis = transform.motion_to_child(*axis);
        }
        axes[i] = joint.axis();
        for (j, axis) in axes[..=i].iter().enumerate() {
            let start = j * width + i * COLUMNS;
            link_columns(&motion, axis, &mut out[start..start + COLUMNS]);
        }
        let own = i * width + i * COLUMNS;
        out[own + column::DRIVE_INERTIA] = qdd[i];
        out[own + column::VISCOUS] = qd[i];
        out[own + column::COULOMB] = qd[i].sgn();
        out[own + column::OFFSET] = T::ONE;
    }
}

/// Computes the power of each of the ten unit wrenches of a link along a joint axis in the link's frame.
#[inline(always)]
pub(super) fn link_columns<T: Real>(motion: &LinkMotion<T>, axis: &Motion<T>, block: &mut [T]) {
    let (angular_velocity, angular_acceleration, proper) =
        (motion.velocity, motion.acceleration, motion.proper);
    let Vector3([hx, hy, hz]) = proper.cross(axis.angular)
        - angular_acceleration.cross(axis.linear)
        + angular_velocity.cross(angular_velocity.cross(axis.linear));
    // s·(I·ω̇ + ω × I·ω) = s·I·ω̇ + (s × ω)·I·ω: two symmetric forms in the entries of I.
    let Vector3([sx, sy, sz]) = axis.angular;
    let Vector3([ux, uy, uz]) = axis.angular.cross(angular_velocity);
    let Vector3([wx, wy, wz]) = angular_velocity;
    let Vector3([ax, ay, az]) = angular_acceleration;
    let values = [
        axis.linear.dot(proper),
        hx,
        hy,
        hz,
        sx * ax + ux * wx,
        sx * ay + sy * ax + ux * wy + uy * wx,
        sx * az + sz * ax + ux * wz + uz * wx,
        sy * ay + uy * wy,
        sy * az + sz * ay + uy * wz + uz * wy,
        sz * az + uz * wz,
    ];
    for (entry, value) in block.iter_mut().zip(values) {
        *entry = value;
    }
}
