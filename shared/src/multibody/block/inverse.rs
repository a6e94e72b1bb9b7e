//! Inverse dynamics of a block.

use super::super::spatial::Vector3;
use super::body::Body;
use super::frame::{
    Frame, GENERAL, LinkTransform, at_each_lane, prismatic_transform, rotate_z, with_link_transform,
};
use super::lane::{LANES, Lane, Lane3, get, set};
use crate::lanes::{Element, MulAdd};

/// Results of the outward pass at a joint for the inward pass.
#[derive(Clone, Copy, Debug)]
pub struct JointBlock<T> {
    pub(super) sin: Lane<T>,
    pub(super) cos: Lane<T>,
    /// Torques in of the inertial wrench of the link.
    pub(super) force: Lane3<T>,
    pub(super) moment: Lane3<T>,
}

impl<T: Element> JointBlock<T> {
    /// All zero.
    pub const ZERO: Self = Self {
        sin: Lane::ZERO,
        cos: Lane::ZERO,
        force: [Lane::ZERO; 3],
        moment: [Lane::ZERO; 3],
    };
}

/// Angular velocity and acceleration of a link, and the acceleration of its origin minus gravity, in its frame.
struct MotionBlock<T> {
    angular_velocity: Lane3<T>,
    angular_acceleration: Lane3<T>,
    proper: Lane3<T>,
}

/// Computes the torques of the links and drives, friction and offsets: recursive Newton–Euler (Luh, Walker & Paul 1980)
/// in its customised form (Khalil & Kleinfinger 1987).
///
/// `frames`, `bodies`, `work` and the signals have one entry per joint; without `qdd` the accelerations are zero.
#[inline(always)]
pub fn inverse_dynamics<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    gravity: [T; 3],
    bodies: &[Body<T>],
    q: &[Lane<T>],
    qd: &[Lane<T>],
    qdd: Option<&[Lane<T>]>,
    work: &mut [JointBlock<T>],
    tau: &mut [Lane<T>],
) {
    let still = Lane::ZERO;
    let qdd = |i: usize| qdd.map_or(&still, |qdd| &qdd[i]);
    let mut motion = MotionBlock {
        angular_velocity: [Lane::ZERO; 3],
        angular_acceleration: [Lane::ZERO; 3],
        proper: gravity.map(|g| Lane([-g; LANES])),
    };
    for (i, frame) in frames.iter().enumerate() {
        let joint = &mut work[i];
        frame.angle::<F>(&q[i], &mut joint.sin, &mut joint.cos);
        if i == 0 && !frame.prismatic {
            first_revolute::<T, F>(
                frame,
                gravity,
                &bodies[i],
                &qd[i],
                qdd(i),
                &mut motion,
                joint,
            );
        } else if frame.prismatic {
            outwards_prismatic::<T, F>(
                frame,
                &bodies[i],
                &q[i],
                &qd[i],
                qdd(i),
                &mut motion,
                joint,
            );
        } else {
            with_link_transform!(T, F, frame, transform => outwards(transform, &bodies[i], &qd[i], qdd(i), &mut motion, joint));
        }
    }
    for (i, frame) in frames.iter().enumerate().rev() {
        let body = &bodies[i];
        let (before, joint) = work.split_at_mut(i);
        let joint = &joint[0];
        let along = if frame.prismatic {
            &joint.force[2]
        } else {
            &joint.moment[2]
        };
        let qdd = qdd(i);
        for k in 0..LANES {
            tau[i][k] = along[k]
                + body.drive * qdd[k]
                + body.viscous * qd[i][k]
                + body.coulomb * qd[i][k].sgn()
                + body.offset;
        }
        if let Some(parent) = before.last_mut() {
            if i == 1 && !frames[0].prismatic {
                at_each_lane!(T, F, frame, &q[i], transform => inwards_along_axis(transform, joint, parent));
            } else {
                at_each_lane!(T, F, frame, &q[i], transform => inwards(transform, joint, parent));
            }
        }
    }
}

/// Moves across a revolute joint to the next link outwards, and computes that link's inertial wrench.
#[inline(always)]
fn outwards<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    transform: LinkTransform<T, F, TWIST, A, D>,
    body: &Body<T>,
    qd: &Lane<T>,
    qdd: &Lane<T>,
    motion: &mut MotionBlock<T>,
    joint: &mut JointBlock<T>,
) {
    let [mx, my, _] = body.first_moment;
    let i = body.inertia;
    for k in 0..LANES {
        let w = transform.rotate(get(&motion.angular_velocity, k));
        let e = transform.rotate(get(&motion.angular_acceleration, k));
        let v = transform.shift_acceleration(transform.rotate(get(&motion.proper, k)), w, e);
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let [wx, wy, wz] = rotate_z::<T, F>(s, c, w).0;
        let [ex, ey, ez] = rotate_z::<T, F>(s, c, e).0;
        let v = rotate_z::<T, F>(s, c, v);
        let (ex, ey, ez) = (ex + wy * qd[k], ey - wx * qd[k], ez + qdd[k]);
        let wz = wz + qd[k];
        set(&mut motion.angular_velocity, k, Vector3([wx, wy, wz]));
        set(&mut motion.angular_acceleration, k, Vector3([ex, ey, ez]));
        set(&mut motion.proper, k, v);
        let [vx, vy, vz] = v.0;
        let (xx, yy, zz) = (wx * wx, wy * wy, wz * wz);
        let (xy, xz, yz) = (wx * wy, wx * wz, wy * wz);
        // The matrix of the acceleration field, ė× + ω×ω×. Its entries serve force and moment.
        let (u21, u12) = (xy + ez, xy - ez);
        let (u31, u13) = (xz - ey, xz + ey);
        let (u32, u23) = (yz + ex, yz - ex);
        let force = Vector3([
            u12 * my - (yy + zz) * mx,
            u21 * mx - (xx + zz) * my,
            u31 * mx + u32 * my,
        ]);
        // ∫ r × (U·r) dm, and first moment × acceleration of the origin.
        let moment = Vector3([
            i.xx * ex - i.xy * u31 + i.xz * u21 + i.yz * (yy - zz) + i.zz * yz + my * vz,
            i.xx * xz + i.xy * u32 - i.yz * u12 + i.xz * (zz - xx) - i.zz * xz - mx * vz,
            i.zz * ez - i.xz * u23 + i.yz * u13 + i.xy * (xx - yy) - i.xx * xy
                + (mx * vy - my * vx),
        ]);
        set(&mut joint.force, k, force);
        set(&mut joint.moment, k, moment);
    }
}

/// The same for a revolute first joint: the base does not move, and only the moment of the link's wrench along the
/// joint is needed.
#[inline(always)]
fn first_revolute<T: Element, F: MulAdd<T>>(
    frame: &Frame<T>,
    gravity: [T; 3],
    body: &Body<T>,
    qd: &Lane<T>,
    qdd: &Lane<T>,
    motion: &mut MotionBlock<T>,
    joint: &mut JointBlock<T>,
) {
    let [mx, my, _] = body.first_moment;
    let up = LinkTransform::<T, F, GENERAL, true, true>::new(frame).rotate(-Vector3(gravity));
    for k in 0..LANES {
        let v = rotate_z::<T, F>(joint.sin[k], joint.cos[k], up);
        set(
            &mut motion.angular_velocity,
            k,
            Vector3([T::ZERO, T::ZERO, qd[k]]),
        );
        set(
            &mut motion.angular_acceleration,
            k,
            Vector3([T::ZERO, T::ZERO, qdd[k]]),
        );
        set(&mut motion.proper, k, v);
        let [vx, vy, _] = v.0;
        joint.moment[2][k] = body.inertia.zz * qdd[k] + (mx * vy - my * vx);
    }
}

/// The same for a prismatic joint.
#[inline(always)]
fn outwards_prismatic<T: Element, F: MulAdd<T>>(
    frame: &Frame<T>,
    body: &Body<T>,
    q: &Lane<T>,
    qd: &Lane<T>,
    qdd: &Lane<T>,
    motion: &mut MotionBlock<T>,
    joint: &mut JointBlock<T>,
) {
    let [mx, my, mz] = body.first_moment;
    for k in 0..LANES {
        let transform = prismatic_transform::<T, F>(frame, q[k]);
        let w = transform.rotate(get(&motion.angular_velocity, k));
        let e = transform.rotate(get(&motion.angular_acceleration, k));
        let v = transform.shift_acceleration(transform.rotate(get(&motion.proper, k)), w, e);
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let w = rotate_z::<T, F>(s, c, w);
        let e = rotate_z::<T, F>(s, c, e);
        let v = (rotate_z::<T, F>(s, c, v) + w.cross_z(qd[k] + qd[k])).plus_z(qdd[k]);
        set(&mut motion.angular_velocity, k, w);
        set(&mut motion.angular_acceleration, k, e);
        set(&mut motion.proper, k, v);
        let m = Vector3([mx, my, mz]);
        set(
            &mut joint.force,
            k,
            v.scaled(body.mass) + e.cross(m) + w.cross(w.cross(m)),
        );
        set(&mut joint.moment, k, m.cross(v));
    }
}

/// Adds a link's wrench to that of the link before.
#[inline(always)]
fn inwards<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    transform: impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    joint: &JointBlock<T>,
    parent: &mut JointBlock<T>,
) {
    for k in 0..LANES {
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let (f, m) = transform(k).wrench_back(s, c, get(&joint.force, k), get(&joint.moment, k));
        let (force, moment) = (get(&parent.force, k) + f, get(&parent.moment, k) + m);
        set(&mut parent.force, k, force);
        set(&mut parent.moment, k, moment);
    }
}

/// The same if only the moment along the parent's axis is needed.
#[inline(always)]
fn inwards_along_axis<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    transform: impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    joint: &JointBlock<T>,
    parent: &mut JointBlock<T>,
) {
    for k in 0..LANES {
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let (_, m) = transform(k).wrench_back(s, c, get(&joint.force, k), get(&joint.moment, k));
        parent.moment[2][k] += m.z();
    }
}
