//! Inverse dynamics by the recursive Newton–Euler algorithm.

use super::capacity::with_capacity;
use super::chain::{Chain, Joint, JointKind, MAX_JOINTS, MultibodyError, check};
use super::parameters::{COLUMNS, column, inertia};
use super::spatial::{Motion, Transform, Vector3, Wrench};
use crate::scalar::Real;

/// Velocity and acceleration of a link, in its frame, during an outward recursion.
#[derive(Clone, Copy)]
pub(super) struct LinkMotion<T> {
    /// Angular velocity.
    pub(super) velocity: Vector3<T>,
    /// Angular acceleration.
    pub(super) acceleration: Vector3<T>,
    /// Acceleration of the origin minus gravity: the reading of an accelerometer there.
    pub(super) proper: Vector3<T>,
}

impl<T: Real> LinkMotion<T> {
    /// Returns the base at rest: gravity enters as an upward acceleration (Luh, Walker & Paul 1980).
    #[inline(always)]
    pub(super) fn base(gravity: Vector3<T>) -> Self {
        Self {
            velocity: Vector3::ZERO,
            acceleration: Vector3::ZERO,
            proper: -gravity,
        }
    }

    /// Returns the motion of the next link outwards (Luh, Walker & Paul 1980; Khalil & Dombre 2002, ch. 9).
    #[inline(always)]
    pub(super) fn next(&self, joint: &Joint<T>, transform: &Transform<T>, qd: T, qdd: T) -> Self {
        let velocity = transform.direction_to_child(self.velocity);
        let acceleration = transform.direction_to_child(self.acceleration);
        let proper = transform.direction_to_child(
            self.proper
                + self.acceleration.cross(transform.origin)
                + self.velocity.cross(self.velocity.cross(transform.origin)),
        );
        match joint.kind {
            JointKind::Revolute => Self {
                velocity: velocity.plus_z(qd),
                acceleration: (acceleration + velocity.cross_z(qd)).plus_z(qdd),
                proper,
            },
            JointKind::Prismatic => Self {
                velocity,
                acceleration,
                proper: (proper + velocity.cross_z(qd + qd)).plus_z(qdd),
            },
        }
    }
}

/// Computes the torques τ (length n) that move the chain by `q`, `qd`, `qdd` (length n each): recursive Newton–Euler
/// (Luh, Walker & Paul 1980; Featherstone 2008, table 5.1), plus the drive inertias, friction and offsets.
///
/// `parameters` holds one row of [`COLUMNS`] per joint, in the order of [`super::COLUMN_NAMES`]. Takes O(n) operations.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn inverse_dynamics<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    qdd: &[T],
    tau: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        let out = ("tau", tau);
        return chain.torques(
            parameters,
            [q, qd, qdd],
            out,
            |axes, rows, [q, qd, qdd], wide| inverse_dynamics(axes, rows, q, qd, qdd, wide),
        );
    }
    let n = chain.joint_count();
    check("parameters", n, parameters.len())?;
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("qdd", n, qdd.len())?;
    check("tau", n, tau.len())?;
    with_capacity!(n, newton_euler(chain, parameters, q, qd, qdd, tau));
    for (i, row) in parameters.iter().enumerate() {
        tau[i] += row[column::DRIVE_INERTIA] * qdd[i]
            + row[column::VISCOUS] * qd[i]
            + row[column::COULOMB] * qd[i].sgn()
            + row[column::OFFSET];
    }
    Ok(())
}

/// Computes the torques that hold the links against gravity at `q`: g(q), without drives, friction and offsets.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn gravity_vector<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    gravity: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        let out = ("gravity", gravity);
        return chain.torques(parameters, [q], out, |axes, rows, [q], wide| {
            gravity_vector(axes, rows, q, wide)
        });
    }
    let n = chain.joint_count();
    check("parameters", n, parameters.len())?;
    check("q", n, q.len())?;
    check("gravity", n, gravity.len())?;
    let still = [T::ZERO; MAX_JOINTS];
    let still = &still[..n];
    with_capacity!(n, newton_euler(chain, parameters, q, still, still, gravity));
    Ok(())
}

/// Computes the torques at q̈ = 0: C(q, q̇)·q̇ + g(q) + fv·q̇ + fc·sgn q̇ + off, so that (A + Ia)·q̈ = τ − bias.
///
/// # Errors
/// [`MultibodyError::WrongLength`].
pub fn bias_torque<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    bias: &mut [T],
) -> Result<(), MultibodyError> {
    let n = chain.joint_count();
    check("bias", n, bias.len())?;
    let still = [T::ZERO; MAX_JOINTS];
    inverse_dynamics(chain, parameters, q, qd, &still[..n], bias)
}

/// The part of the links only. All slices have the chain's length, which is at most `CAPACITY`.
fn newton_euler<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    qdd: &[T],
    tau: &mut [T],
) {
    let mut transforms = [Transform::IDENTITY; CAPACITY];
    let mut wrenches = [Wrench::ZERO; CAPACITY];
    let mut motion = LinkMotion::base(chain.gravity);
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        motion = motion.next(joint, &transform, qd[i], qdd[i]);
        let body = inertia(&parameters[i]);
        // Newton and Euler about the frame's origin; the gyroscopic part is that of a body that turns about the origin.
        let inertial = body.times(Motion {
            angular: motion.acceleration,
            linear: motion.proper,
        });
        let spin = motion.velocity;
        wrenches[i] = Wrench {
            force: inertial.force + spin.cross(spin.cross(body.first_moment)),
            moment: inertial.moment + spin.cross(body.inertia.times(spin)),
        };
        transforms[i] = transform;
    }
    let mut carried = Wrench::ZERO;
    for (i, joint) in chain.joints.iter().enumerate().rev() {
        let total = wrenches[i].plus(carried);
        tau[i] = joint.project(total);
        carried = transforms[i].wrench_to_parent(total);
    }
}
