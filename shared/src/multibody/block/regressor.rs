//! Regressors of a block.

use super::super::parameters::{COLUMNS, column};
use super::super::spatial::Vector3;
use super::columns::{Columns, Section};
use super::frame::{Frame, LinkTransform, at_each_lane, rotate_z};
use super::lane::{LANES, Lane, Lane3, get, set};
use crate::lanes::{Element, MulAdd};

/// Motion of a link, from which all its columns are computed.
struct LinkBlock<T> {
    /// Angular velocity ω.
    angular_velocity: Lane3<T>,
    /// Angular acceleration.
    angular_acceleration: Lane3<T>,
    /// Acceleration of the origin minus gravity.
    proper: Lane3<T>,
    /// ωx·ωy, ωx·ωz, ωy·ωz
    mixed: Lane3<T>,
    /// ωy² + ωz², ωx² + ωz², ωx² + ωy²
    sums: Lane3<T>,
    /// ωx² − ωy², ωz² − ωx², ωy² − ωz²
    differences: Lane3<T>,
    /// Entries 21, 31, 32 of U = ė× + ω×ω×: the acceleration of the link's points relative to its origin.
    below: Lane3<T>,
    /// Entries 12, 13, 23 of U.
    above: Lane3<T>,
}

/// A joint's axis in the frame of a link further out: rotation, and velocity of that frame's origin.
#[derive(Clone, Copy, Debug)]
pub struct AxisBlock<T> {
    angular: Lane3<T>,
    linear: Lane3<T>,
}

impl<T: Element> AxisBlock<T> {
    /// All zero.
    pub const ZERO: Self = Self {
        angular: [Lane::ZERO; 3],
        linear: [Lane::ZERO; 3],
    };
}

/// Computes the regressor of the differential model (Atkeson, An & Hollerbach 1986), linear in the 14·n parameters.
///
/// Parameter c of joint j has the column `j * 14 * n + c` of `out`. Only columns that depend on the sample are written:
/// for joint j those of the links from j outwards, and of its own drive and friction. The others are left unchanged:
/// columns that are zero for every motion, and that of the offset, whose entries are 1. `frames`, `axes` and the
/// signals have one entry per joint.
#[inline(always)]
pub fn differential_regressor<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    gravity: [T; 3],
    q: &[Lane<T>],
    qd: &[Lane<T>],
    qdd: &[Lane<T>],
    axes: &mut [AxisBlock<T>],
    out: &mut Section<T>,
) {
    let mut motion = LinkBlock {
        angular_velocity: [Lane::ZERO; 3],
        angular_acceleration: [Lane::ZERO; 3],
        proper: gravity.map(|g| Lane([-g; LANES])),
        mixed: [Lane::ZERO; 3],
        sums: [Lane::ZERO; 3],
        differences: [Lane::ZERO; 3],
        below: [Lane::ZERO; 3],
        above: [Lane::ZERO; 3],
    };
    let width = frames.len() * COLUMNS;
    let (mut sin, mut cos) = (Lane::ZERO, Lane::ZERO);
    for (i, frame) in frames.iter().enumerate() {
        frame.angle::<F>(&q[i], &mut sin, &mut cos);
        at_each_lane!(T, F, frame, &q[i], transform => {
            next_link(&transform, frame.prismatic, &sin, &cos, &qd[i], &qdd[i], &mut motion);
            for (j, axis) in axes[..i].iter_mut().enumerate() {
                let [m, mx, my, mz, ixx, ixy, ixz, iyy, iyz, izz] = out.lanes(j * width + i * COLUMNS);
                carried_axis(
                    &transform, &sin, &cos, axis, &motion, m, mx, my, mz, ixx, ixy, ixz, iyy, iyz, izz,
                );
            }
        });
        let own = i * width + i * COLUMNS;
        own_axis(frame.prismatic, &motion, &mut axes[i], own, out);
        *out.lane(own + column::DRIVE_INERTIA) = qdd[i].0;
        *out.lane(own + column::VISCOUS) = qd[i].0;
        let sign = out.lane(own + column::COULOMB);
        for k in 0..LANES {
            sign[k] = qd[i][k].sgn();
        }
    }
}

/// Moves across a joint to the next link outwards (Luh, Walker & Paul 1980).
#[inline(always)]
fn next_link<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    transform: &impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    prismatic: bool,
    sin: &Lane<T>,
    cos: &Lane<T>,
    qd: &Lane<T>,
    qdd: &Lane<T>,
    motion: &mut LinkBlock<T>,
) {
    // Both kinds in one body: terms of the other kind are multiplied by 0.
    let (turns, slides) = if prismatic {
        (T::ZERO, T::ONE)
    } else {
        (T::ONE, T::ZERO)
    };
    for k in 0..LANES {
        let transform = transform(k);
        let w = transform.rotate(get(&motion.angular_velocity, k));
        let e = transform.rotate(get(&motion.angular_acceleration, k));
        let v = transform.shift_acceleration(transform.rotate(get(&motion.proper, k)), w, e);
        let (s, c) = (sin[k], cos[k]);
        let (w, e, v) = (
            rotate_z::<T, F>(s, c, w),
            rotate_z::<T, F>(s, c, e),
            rotate_z::<T, F>(s, c, v),
        );
        let (rotation_rate, sliding_rate) = (turns * qd[k], slides * qd[k]);
        let e = (e + w.cross_z(rotation_rate)).plus_z(turns * qdd[k]);
        let v = (v + w.cross_z(sliding_rate + sliding_rate)).plus_z(slides * qdd[k]);
        let w = w.plus_z(rotation_rate);
        set(&mut motion.angular_velocity, k, w);
        set(&mut motion.angular_acceleration, k, e);
        set(&mut motion.proper, k, v);
        let ([wx, wy, wz], [ex, ey, ez]) = (w.0, e.0);
        let (xx, yy, zz) = (wx * wx, wy * wy, wz * wz);
        let (xy, xz, yz) = (wx * wy, wx * wz, wy * wz);
        set(&mut motion.mixed, k, Vector3([xy, xz, yz]));
        set(&mut motion.sums, k, Vector3([yy + zz, xx + zz, xx + yy]));
        set(
            &mut motion.differences,
            k,
            Vector3([xx - yy, zz - xx, yy - zz]),
        );
        set(&mut motion.below, k, Vector3([xy + ez, xz - ey, yz + ex]));
        set(&mut motion.above, k, Vector3([xy - ez, xz + ey, yz - ex]));
    }
}

/// Transforms a joint's axis to this link, and computes the power of the link's ten unit wrenches along it.
// Ten parameters instead of an array of ten: only for reference parameters does the compiler know that they do not
// overlap, and only then does it vectorise the loop.
#[inline(always)]
fn carried_axis<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    transform: &impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    sin: &Lane<T>,
    cos: &Lane<T>,
    axis: &mut AxisBlock<T>,
    motion: &LinkBlock<T>,
    m: &mut [T; LANES],
    mx: &mut [T; LANES],
    my: &mut [T; LANES],
    mz: &mut [T; LANES],
    ixx: &mut [T; LANES],
    ixy: &mut [T; LANES],
    ixz: &mut [T; LANES],
    iyy: &mut [T; LANES],
    iyz: &mut [T; LANES],
    izz: &mut [T; LANES],
) {
    let dot = |a: T, x: T, b: T, y: T, c: T, z: T| F::mul_add(a, x, F::mul_add(b, y, c * z));
    for k in 0..LANES {
        let transform = transform(k);
        let (s, c) = (sin[k], cos[k]);
        let turned = transform.rotate(get(&axis.angular, k));
        let swept = transform.shift_velocity(transform.rotate(get(&axis.linear, k)), turned);
        let (angular, linear) = (
            rotate_z::<T, F>(s, c, turned),
            rotate_z::<T, F>(s, c, swept),
        );
        set(&mut axis.angular, k, angular);
        set(&mut axis.linear, k, linear);
        let ([sx, sy, sz], [lx, ly, lz]) = (angular.0, linear.0);
        let [vx, vy, vz] = get(&motion.proper, k).0;
        let [ex, ey, ez] = get(&motion.angular_acceleration, k).0;
        let [xy, xz, yz] = get(&motion.mixed, k).0;
        let [yy_zz, xx_zz, xx_yy] = get(&motion.sums, k).0;
        let [x_y, z_x, y_z] = get(&motion.differences, k).0;
        let [u21, u31, u32] = get(&motion.below, k).0;
        let [u12, u13, u23] = get(&motion.above, k).0;
        m[k] = dot(lx, vx, ly, vy, lz, vz);
        mx[k] = F::mul_add(
            vy,
            sz,
            F::mul_add(-vz, sy, dot(u21, ly, u31, lz, -yy_zz, lx)),
        );
        my[k] = F::mul_add(
            vz,
            sx,
            F::mul_add(-vx, sz, dot(u12, lx, u32, lz, -xx_zz, ly)),
        );
        mz[k] = F::mul_add(
            vx,
            sy,
            F::mul_add(-vy, sx, dot(u13, lx, u23, ly, -xx_yy, lz)),
        );
        ixx[k] = dot(ex, sx, xz, sy, -xy, sz);
        ixy[k] = dot(u32, sy, -u31, sx, x_y, sz);
        ixz[k] = dot(u21, sx, z_x, sy, -u23, sz);
        iyy[k] = dot(ey, sy, -yz, sx, xy, sz);
        iyz[k] = dot(y_z, sx, -u12, sy, u13, sz);
        izz[k] = dot(yz, sx, -xz, sy, ez, sz);
    }
}

/// The same for the joint of the link itself, whose axis is z of the frame. `own` is the first of its columns.
#[inline(always)]
fn own_axis<T: Element>(
    prismatic: bool,
    motion: &LinkBlock<T>,
    axis: &mut AxisBlock<T>,
    own: usize,
    out: &mut Section<T>,
) {
    let z = [Lane::ZERO, Lane::ZERO, Lane([T::ONE; LANES])];
    let [m, mx, my, mz, ixx, ixy, ixz, iyy, iyz, izz] = out.lanes(own);
    if prismatic {
        *axis = AxisBlock {
            angular: [Lane::ZERO; 3],
            linear: z,
        };
        *m = motion.proper[2].0;
        *mx = motion.below[1].0;
        *my = motion.below[2].0;
        negated(&motion.sums[2], mz);
    } else {
        *axis = AxisBlock {
            angular: z,
            linear: [Lane::ZERO; 3],
        };
        *mx = motion.proper[1].0;
        negated(&motion.proper[0], my);
        negated(&motion.mixed[0], ixx);
        *ixy = motion.differences[0].0;
        negated(&motion.above[2], ixz);
        *iyy = motion.mixed[0].0;
        *iyz = motion.above[1].0;
        *izz = motion.angular_acceleration[2].0;
    }
}

#[inline(always)]
fn negated<T: Element>(lane: &Lane<T>, out: &mut [T; LANES]) {
    for k in 0..LANES {
        out[k] = -lane[k];
    }
}

/// Computes the row of the total mechanical energy in 14·n columns. Friction and offset columns are not written.
#[inline(always)]
pub fn energy_regressor<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    gravity: [T; 3],
    q: &[Lane<T>],
    qd: &[Lane<T>],
    out: &mut Section<T>,
) {
    let (mut angular, mut linear) = ([Lane::ZERO; 3], [Lane::ZERO; 3]);
    let mut field = gravity.map(|g| Lane([g; LANES]));
    let mut depth = Lane::ZERO;
    let (mut sin, mut cos) = (Lane::ZERO, Lane::ZERO);
    for (i, frame) in frames.iter().enumerate() {
        frame.angle::<F>(&q[i], &mut sin, &mut cos);
        let [m, mx, my, mz, ixx, ixy, ixz, iyy, iyz, izz, drive] = out.lanes(i * COLUMNS);
        at_each_lane!(T, F, frame, &q[i], transform => link_energy(
            transform, frame.prismatic, &sin, &cos, &qd[i],
            &mut angular, &mut linear, &mut field, &mut depth,
            m, mx, my, mz, ixx, ixy, ixz, iyy, iyz, izz, drive,
        ));
    }
}

/// Moves across a joint to the next link outwards, and computes the energy columns of that link and of the drive.
#[inline(always)]
fn link_energy<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    transform: impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    prismatic: bool,
    sin: &Lane<T>,
    cos: &Lane<T>,
    qd: &Lane<T>,
    angular: &mut Lane3<T>,
    linear: &mut Lane3<T>,
    gravity: &mut Lane3<T>,
    depth: &mut Lane<T>,
    m: &mut [T; LANES],
    mx: &mut [T; LANES],
    my: &mut [T; LANES],
    mz: &mut [T; LANES],
    ixx: &mut [T; LANES],
    ixy: &mut [T; LANES],
    ixz: &mut [T; LANES],
    iyy: &mut [T; LANES],
    iyz: &mut [T; LANES],
    izz: &mut [T; LANES],
    drive: &mut [T; LANES],
) {
    let (turns, slides) = if prismatic {
        (T::ZERO, T::ONE)
    } else {
        (T::ONE, T::ZERO)
    };
    for k in 0..LANES {
        let transform = transform(k);
        let (s, c) = (sin[k], cos[k]);
        let w = transform.rotate(get(angular, k));
        let v = transform.shift_velocity(transform.rotate(get(linear, k)), w);
        let w = rotate_z::<T, F>(s, c, w).plus_z(turns * qd[k]);
        let v = rotate_z::<T, F>(s, c, v).plus_z(slides * qd[k]);
        let down = transform.rotate(get(gravity, k));
        depth[k] += down.0[0] * transform.a + down.0[2] * transform.d;
        let down = rotate_z::<T, F>(s, c, down);
        set(angular, k, w);
        set(linear, k, v);
        set(gravity, k, down);
        let [wx, wy, wz] = w.0;
        let [gx, gy, gz] = down.0;
        let [hx, hy, hz] = v.cross(w).0;
        m[k] = T::HALF * v.dot(v) - depth[k];
        mx[k] = hx - gx;
        my[k] = hy - gy;
        mz[k] = hz - gz;
        ixx[k] = T::HALF * (wx * wx);
        ixy[k] = wx * wy;
        ixz[k] = wx * wz;
        iyy[k] = T::HALF * (wy * wy);
        iyz[k] = wy * wz;
        izz[k] = T::HALF * (wz * wz);
        drive[k] = T::HALF * (qd[k] * qd[k]);
    }
}
