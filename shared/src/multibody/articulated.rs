//! Forward dynamics by articulated bodies.

use super::capacity::with_capacity;
use super::chain::{Chain, Joint, JointKind, MultibodyError, check};
use super::forward::forward_dynamics;
use super::parameters::{COLUMNS, column, inertia};
use super::spatial::{Inertia, Motion, Symmetric3, Transform, Vector3, Wrench};
use crate::scalar::{Mask, Real};

/// Computes the accelerations q̈ (length n) under the torques `tau` by the articulated-body algorithm (Featherstone
/// 2008, table 7.1), with drive inertias, friction and offsets as in [`super::forward_dynamics`]. Both agree.
///
/// Takes O(n) operations. For single samples it needs a tenth less time than [`super::forward_dynamics`] with six
/// joints, and a quarter less with twelve (`host/model/benches/dynamics.rs` prints both). Blocks of samples
/// ([`super::block`]) use composite bodies, which share the work of the inverse dynamics before them.
///
/// # Errors
/// [`MultibodyError::WrongLength`]; [`MultibodyError::NotPositiveDefinite`] if the free links from some joint outwards
/// have no positive inertia along it (in some lane), also if a number is NaN. `qdd` is then untouched.
pub fn articulated_forward_dynamics<T: Real>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    tau: &[T],
    qdd: &mut [T],
) -> Result<(), MultibodyError> {
    if chain.has_followers() {
        // A follower moves with a joint anywhere in the chain, which the recursion over free links does not cover.
        return forward_dynamics(chain, parameters, q, qd, tau, qdd);
    }
    let n = chain.joint_count();
    check("parameters", n, parameters.len())?;
    check("q", n, q.len())?;
    check("qd", n, qd.len())?;
    check("tau", n, tau.len())?;
    check("qdd", n, qdd.len())?;
    with_capacity!(n, articulated_bodies(chain, parameters, q, qd, tau, qdd))
}

/// Results of the outward and the inward pass at a joint.
#[derive(Clone, Copy)]
struct Link<T> {
    transform: Transform<T>,
    /// Acceleration due to velocity, v × s·q̇.
    drift: Motion<T>,
    body: ArticulatedBody<T>,
    bias: Wrench<T>,
    /// Wrench of the articulated body at unit acceleration along the joint.
    axis_wrench: Wrench<T>,
    /// Inverse of the inertia that the drive moves.
    compliance: T,
    /// Torque that remains for acceleration.
    free: T,
}

/// All slices have the lengths checked above; the chain has at most `CAPACITY` joints.
fn articulated_bodies<T: Real, const CAPACITY: usize>(
    chain: &Chain<T>,
    parameters: &[[T; COLUMNS]],
    q: &[T],
    qd: &[T],
    tau: &[T],
    qdd: &mut [T],
) -> Result<(), MultibodyError> {
    let mut links = [Link {
        transform: Transform::IDENTITY,
        drift: Motion::ZERO,
        body: ArticulatedBody::NOTHING,
        bias: Wrench::ZERO,
        axis_wrench: Wrench::ZERO,
        compliance: T::ZERO,
        free: T::ZERO,
    }; CAPACITY];
    let mut velocity = Motion::ZERO;
    for (i, joint) in chain.joints.iter().enumerate() {
        let transform = joint.transform(q[i]);
        velocity = joint.velocity(&transform, velocity, qd[i]);
        let body = inertia(&parameters[i]);
        links[i].transform = transform;
        links[i].drift = velocity.cross(joint.axis().scaled(qd[i]));
        links[i].bias = velocity.cross_wrench(body.times(velocity));
        links[i].body = ArticulatedBody::rigid(body);
    }
    for (i, joint) in chain.joints.iter().enumerate().rev() {
        let (before, link) = links.split_at_mut(i);
        let link = &mut link[0];
        let row = &parameters[i];
        link.axis_wrench = link.body.axis_wrench(joint);
        let axis_inertia = joint.project(link.axis_wrench) + row[column::DRIVE_INERTIA];
        // NaN fails this comparison too.
        if !T::ZERO.lt(axis_inertia).all() {
            return Err(MultibodyError::NotPositiveDefinite { joint: i });
        }
        link.compliance = T::ONE / axis_inertia;
        link.free = tau[i]
            - row[column::VISCOUS] * qd[i]
            - row[column::COULOMB] * qd[i].sgn()
            - row[column::OFFSET]
            - joint.project(link.bias);
        if let Some(parent) = before.last_mut() {
            let body = link.body.without_joint(link.axis_wrench, link.compliance);
            let bias = link
                .bias
                .plus(body.times(link.drift))
                .plus(link.axis_wrench.scaled(link.compliance * link.free));
            parent.body = parent.body.plus(body.to_parent(&link.transform));
            parent.bias = parent.bias.plus(link.transform.wrench_to_parent(bias));
        }
    }
    let mut acceleration = Motion {
        angular: Vector3::ZERO,
        linear: -chain.gravity,
    };
    for (i, joint) in chain.joints.iter().enumerate() {
        let link = &links[i];
        let carried = link
            .transform
            .motion_to_child(acceleration)
            .plus(link.drift);
        qdd[i] = (link.free - carried.dot(link.axis_wrench)) * link.compliance;
        acceleration = carried.plus(joint.axis().scaled(qdd[i]));
    }
    Ok(())
}

/// Apparent inertia of links that are free to move about the joints between them (Featherstone 2008, sec. 7.1):
/// force = mass·a + couplingᵀ·ω̇, moment = coupling·a + inertia·ω̇.
#[derive(Clone, Copy)]
struct ArticulatedBody<T> {
    mass: Symmetric3<T>,
    /// By rows.
    coupling: [Vector3<T>; 3],
    inertia: Symmetric3<T>,
}

impl<T: Real> ArticulatedBody<T> {
    const NOTHING: Self = Self {
        mass: Symmetric3::ZERO,
        coupling: [Vector3::ZERO; 3],
        inertia: Symmetric3::ZERO,
    };

    fn rigid(body: Inertia<T>) -> Self {
        let Vector3([x, y, z]) = body.first_moment;
        let m = body.mass;
        Self {
            mass: Symmetric3 {
                xx: m,
                yy: m,
                zz: m,
                ..Symmetric3::ZERO
            },
            coupling: [
                Vector3([T::ZERO, -z, y]),
                Vector3([z, T::ZERO, -x]),
                Vector3([-y, x, T::ZERO]),
            ],
            inertia: body.inertia,
        }
    }

    fn plus(self, other: Self) -> Self {
        let [a, b, c] = self.coupling;
        let [x, y, z] = other.coupling;
        Self {
            mass: self.mass.plus(other.mass),
            coupling: [a + x, b + y, c + z],
            inertia: self.inertia.plus(other.inertia),
        }
    }

    fn times(&self, motion: Motion<T>) -> Wrench<T> {
        let [a, b, c] = self.coupling;
        let Vector3([x, y, z]) = motion.angular;
        Wrench {
            force: self.mass.times(motion.linear) + a.scaled(x) + b.scaled(y) + c.scaled(z),
            moment: Vector3([
                a.dot(motion.linear),
                b.dot(motion.linear),
                c.dot(motion.linear),
            ]) + self.inertia.times(motion.angular),
        }
    }

    /// Returns the wrench at unit acceleration along a joint.
    fn axis_wrench(&self, joint: &Joint<T>) -> Wrench<T> {
        let [a, b, c] = self.coupling;
        match joint.kind {
            JointKind::Revolute => Wrench {
                force: c,
                moment: Vector3([self.inertia.xz, self.inertia.yz, self.inertia.zz]),
            },
            JointKind::Prismatic => Wrench {
                force: Vector3([self.mass.xz, self.mass.yz, self.mass.zz]),
                moment: Vector3([a.z(), b.z(), c.z()]),
            },
        }
    }

    /// Returns the body seen through a free joint: minus u·uᵀ·compliance.
    fn without_joint(&self, u: Wrench<T>, compliance: T) -> Self {
        let Wrench { force, moment } = u.scaled(compliance);
        let [x, y, z] = moment.0;
        let [a, b, c] = self.coupling;
        Self {
            mass: self.mass.minus_outer(force, u.force),
            coupling: [
                a - u.force.scaled(x),
                b - u.force.scaled(y),
                c - u.force.scaled(z),
            ],
            inertia: self.inertia.minus_outer(moment, u.moment),
        }
    }

    /// Returns the body about the origin of frame i − 1, in that frame.
    fn to_parent(self, transform: &Transform<T>) -> Self {
        let mass = transform.symmetric_to_parent(self.mass);
        // R·H·Rᵀ: rotates the rows, then the columns of the result.
        let rows = transposed(self.coupling.map(|row| transform.direction_to_parent(row)));
        let h = transposed(rows.map(|column| transform.direction_to_parent(column)));
        // H + [p]×·M, column by column of M (equal to its rows, as M is symmetric).
        let m = mass.rows();
        let shifted = transposed(m.map(|column| transform.origin.cross(column)));
        let coupling = [h[0] + shifted[0], h[1] + shifted[1], h[2] + shifted[2]];
        // −H·[p]× and its transpose, and −[p]×·M·[p]×: row r of K·[p]× is (row r of K) × p.
        let p = transform.origin;
        let one = h.map(|row| row.cross(p));
        let two = shifted.map(|row| row.cross(p));
        let turned = transform.symmetric_to_parent(self.inertia);
        let entry = |i: usize, j: usize| -(one[i].0[j] + one[j].0[i] + two[i].0[j]);
        Self {
            mass,
            coupling,
            inertia: turned.plus(Symmetric3 {
                xx: entry(0, 0),
                xy: entry(0, 1),
                xz: entry(0, 2),
                yy: entry(1, 1),
                yz: entry(1, 2),
                zz: entry(2, 2),
            }),
        }
    }
}

fn transposed<T: Real>(rows: [Vector3<T>; 3]) -> [Vector3<T>; 3] {
    let [a, b, c] = rows.map(|row| row.0);
    [
        Vector3([a[0], b[0], c[0]]),
        Vector3([a[1], b[1], c[1]]),
        Vector3([a[2], b[2], c[2]]),
    ]
}
