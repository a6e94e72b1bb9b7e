//! Regressors of a block.

use super::super::parameters::{COLUMNS, column};
use super::frame::{Place, at_each_lane, spin};
use super::{Frame, LANES, Lane, Lane3, ZERO, ZERO3, get, set};
use crate::lanes::MulAdd;
use crate::scalar::Real;

/// How a link moves: what all its columns are made of.
struct LinkBlock {
    /// Angular velocity.
    spin: Lane3,
    /// Angular acceleration.
    turning: Lane3,
    /// Acceleration of the origin less gravity.
    proper: Lane3,
}

/// A joint's axis in the frame of some link further out: rotation, and velocity of that frame's origin.
#[derive(Clone, Copy, Debug)]
pub struct AxisBlock {
    angular: Lane3,
    linear: Lane3,
}

impl AxisBlock {
    /// All zero.
    pub const ZERO: Self = Self {
        angular: ZERO3,
        linear: ZERO3,
    };
}

/// Regressor of the differential model (Atkeson, An & Hollerbach 1986), every torque linear in the 14·n parameters.
///
/// Column c of joint j goes to `out[column_of(j, c)]`'s first [`LANES`] entries from `at` on; only columns that are not
/// zero for every motion are written: those of the links from j outwards, and of drive, friction and offset
/// those of joint j itself. `frames`, `axes` and the signals have one entry a joint.
#[inline(always)]
pub fn differential_regressor<F: MulAdd>(
    frames: &[Frame],
    gravity: [f64; 3],
    q: &[Lane],
    qd: &[Lane],
    qdd: &[Lane],
    axes: &mut [AxisBlock],
    out: &mut impl FnMut(usize, usize, &Lane),
) {
    let mut motion = LinkBlock {
        spin: ZERO3,
        turning: ZERO3,
        proper: gravity.map(|g| [-g; LANES]),
    };
    let (mut sin, mut cos) = (ZERO, ZERO);
    let mut block = [ZERO; 10];
    for (i, frame) in frames.iter().enumerate() {
        frame.angle::<F>(&q[i], &mut sin, &mut cos);
        at_each_lane!(F, frame, &q[i], place => {
            next_link(&place, frame.prismatic, &sin, &cos, &qd[i], &qdd[i], &mut motion);
            for (j, axis) in axes[..i].iter_mut().enumerate() {
                carried_axis(&place, &sin, &cos, axis, &motion, &mut block);
                for (c, lane) in block.iter().enumerate() {
                    out(j, i * COLUMNS + c, lane);
                }
            }
        });
        own_axis(frame.prismatic, &motion, &mut axes[i], &mut block);
        for (c, lane) in block.iter().enumerate() {
            out(i, i * COLUMNS + c, lane);
        }
        out(i, i * COLUMNS + column::DRIVE_INERTIA, &qdd[i]);
        out(i, i * COLUMNS + column::VISCOUS, &qd[i]);
        let mut sign = ZERO;
        for k in 0..LANES {
            sign[k] = qd[i][k].sgn();
        }
        out(i, i * COLUMNS + column::COULOMB, &sign);
        out(i, i * COLUMNS + column::OFFSET, &[1.0; LANES]);
    }
}

/// Over a joint to the next link outwards (Luh, Walker & Paul 1980).
#[inline(always)]
fn next_link<F: MulAdd, const TWIST: u8, const A: bool, const D: bool>(
    place: &impl Fn(usize) -> Place<F, TWIST, A, D>,
    prismatic: bool,
    sin: &Lane,
    cos: &Lane,
    qd: &Lane,
    qdd: &Lane,
    motion: &mut LinkBlock,
) {
    // Both kinds in one body: what belongs to the other kind is multiplied by 0.
    let (turns, slides) = if prismatic { (0.0, 1.0) } else { (1.0, 0.0) };
    for k in 0..LANES {
        let place = place(k);
        let w = place.turn(get(&motion.spin, k));
        let e = place.turn(get(&motion.turning, k));
        let v = place.carry(place.turn(get(&motion.proper, k)), w, e);
        let (s, c) = (sin[k], cos[k]);
        let (w, e, v) = (spin::<F>(s, c, w), spin::<F>(s, c, e), spin::<F>(s, c, v));
        let (turn, slide) = (turns * qd[k], slides * qd[k]);
        set(&mut motion.spin, k, w.plus_z(turn));
        set(
            &mut motion.turning,
            k,
            (e + w.cross_z(turn)).plus_z(turns * qdd[k]),
        );
        set(
            &mut motion.proper,
            k,
            (v + w.cross_z(slide + slide)).plus_z(slides * qdd[k]),
        );
    }
}

/// Carries a joint's axis over to this link, and the power of the link's ten unit wrenches along it.
#[inline(always)]
fn carried_axis<F: MulAdd, const TWIST: u8, const A: bool, const D: bool>(
    place: &impl Fn(usize) -> Place<F, TWIST, A, D>,
    sin: &Lane,
    cos: &Lane,
    axis: &mut AxisBlock,
    motion: &LinkBlock,
    block: &mut [Lane; 10],
) {
    let [m, mx, my, mz, ixx, ixy, ixz, iyy, iyz, izz] = block;
    for k in 0..LANES {
        let place = place(k);
        let (s, c) = (sin[k], cos[k]);
        let turned = place.turn(get(&axis.angular, k));
        let swept = place.sweep(place.turn(get(&axis.linear, k)), turned);
        let (angular, linear) = (spin::<F>(s, c, turned), spin::<F>(s, c, swept));
        set(&mut axis.angular, k, angular);
        set(&mut axis.linear, k, linear);
        let ([sx, sy, sz], [lx, ly, lz]) = (angular.0, linear.0);
        let field = Field::of(motion, k);
        let [vx, vy, vz] = field.proper;
        let Field {
            xx,
            yy,
            zz,
            xy,
            xz,
            yz,
            ..
        } = field;
        let [ex, ey, ez] = field.turning;
        m[k] = lx * vx + ly * vy + lz * vz;
        mx[k] = (vy * sz - vz * sy) + (field.u21 * ly + field.u31 * lz - (yy + zz) * lx);
        my[k] = (vz * sx - vx * sz) + (field.u12 * lx + field.u32 * lz - (xx + zz) * ly);
        mz[k] = (vx * sy - vy * sx) + (field.u13 * lx + field.u23 * ly - (xx + yy) * lz);
        ixx[k] = ex * sx + xz * sy - xy * sz;
        ixy[k] = field.u32 * sy - field.u31 * sx + (xx - yy) * sz;
        ixz[k] = field.u21 * sx + (zz - xx) * sy - field.u23 * sz;
        iyy[k] = ey * sy - yz * sx + xy * sz;
        iyz[k] = (yy - zz) * sx - field.u12 * sy + field.u13 * sz;
        izz[k] = yz * sx - xz * sy + ez * sz;
    }
}

/// The same for the joint that carries the link, whose axis is z of the frame.
#[inline(always)]
fn own_axis(prismatic: bool, motion: &LinkBlock, axis: &mut AxisBlock, block: &mut [Lane; 10]) {
    let z = [ZERO, ZERO, [1.0; LANES]];
    *axis = if prismatic {
        AxisBlock {
            angular: ZERO3,
            linear: z,
        }
    } else {
        AxisBlock {
            angular: z,
            linear: ZERO3,
        }
    };
    let [m, mx, my, mz, inertia @ ..] = block;
    if prismatic {
        for k in 0..LANES {
            let field = Field::of(motion, k);
            m[k] = field.proper[2];
            mx[k] = field.u31;
            my[k] = field.u32;
            mz[k] = -(field.xx + field.yy);
        }
        inertia.fill(ZERO);
        return;
    }
    *m = ZERO;
    *mz = ZERO;
    let [ixx, ixy, ixz, iyy, iyz, izz] = inertia;
    for k in 0..LANES {
        let field = Field::of(motion, k);
        mx[k] = field.proper[1];
        my[k] = -field.proper[0];
        ixx[k] = -field.xy;
        ixy[k] = field.xx - field.yy;
        ixz[k] = -field.u23;
        iyy[k] = field.xy;
        iyz[k] = field.u13;
        izz[k] = field.turning[2];
    }
}

/// Accelerations of the points of a link at one sample: proper + U·r with U = ė× + ω×ω×.
struct Field {
    proper: [f64; 3],
    turning: [f64; 3],
    xx: f64,
    yy: f64,
    zz: f64,
    xy: f64,
    xz: f64,
    yz: f64,
    u21: f64,
    u12: f64,
    u31: f64,
    u13: f64,
    u32: f64,
    u23: f64,
}

impl Field {
    #[inline(always)]
    fn of(motion: &LinkBlock, k: usize) -> Self {
        let [wx, wy, wz] = get(&motion.spin, k).0;
        let turning = get(&motion.turning, k).0;
        let [ex, ey, ez] = turning;
        let (xy, xz, yz) = (wx * wy, wx * wz, wy * wz);
        Self {
            proper: get(&motion.proper, k).0,
            turning,
            xx: wx * wx,
            yy: wy * wy,
            zz: wz * wz,
            xy,
            xz,
            yz,
            u21: xy + ez,
            u12: xy - ez,
            u31: xz - ey,
            u13: xz + ey,
            u32: yz + ex,
            u23: yz - ex,
        }
    }
}

/// Row of the total mechanical energy, column by column of the 14·n: `out(c, …)`. Friction and offset columns are not written.
#[inline(always)]
pub fn energy_regressor<F: MulAdd>(
    frames: &[Frame],
    gravity: [f64; 3],
    q: &[Lane],
    qd: &[Lane],
    out: &mut impl FnMut(usize, &Lane),
) {
    let (mut angular, mut linear) = (ZERO3, ZERO3);
    let mut field = gravity.map(|g| [g; LANES]);
    let mut depth = ZERO;
    let (mut sin, mut cos) = (ZERO, ZERO);
    let mut block = [ZERO; 11];
    for (i, frame) in frames.iter().enumerate() {
        frame.angle::<F>(&q[i], &mut sin, &mut cos);
        at_each_lane!(F, frame, &q[i], place => link_energy(
            place, frame.prismatic, &sin, &cos, &qd[i],
            &mut angular, &mut linear, &mut field, &mut depth, &mut block,
        ));
        for (c, lane) in block.iter().enumerate() {
            out(i * COLUMNS + c, lane);
        }
    }
}

/// Over a joint to the next link outwards, and the columns of that link's energy and of the drive's.
#[inline(always)]
fn link_energy<F: MulAdd, const TWIST: u8, const A: bool, const D: bool>(
    place: impl Fn(usize) -> Place<F, TWIST, A, D>,
    prismatic: bool,
    sin: &Lane,
    cos: &Lane,
    qd: &Lane,
    angular: &mut Lane3,
    linear: &mut Lane3,
    gravity: &mut Lane3,
    depth: &mut Lane,
    block: &mut [Lane; 11],
) {
    let (turns, slides) = if prismatic { (0.0, 1.0) } else { (1.0, 0.0) };
    let [m, mx, my, mz, ixx, ixy, ixz, iyy, iyz, izz, drive] = block;
    for k in 0..LANES {
        let place = place(k);
        let (s, c) = (sin[k], cos[k]);
        let w = place.turn(get(angular, k));
        let v = place.sweep(place.turn(get(linear, k)), w);
        let w = spin::<F>(s, c, w).plus_z(turns * qd[k]);
        let v = spin::<F>(s, c, v).plus_z(slides * qd[k]);
        let down = place.turn(get(gravity, k));
        depth[k] += down.0[0] * place.a + down.0[2] * place.d;
        let down = spin::<F>(s, c, down);
        set(angular, k, w);
        set(linear, k, v);
        set(gravity, k, down);
        let [wx, wy, wz] = w.0;
        let [gx, gy, gz] = down.0;
        let [hx, hy, hz] = v.cross(w).0;
        m[k] = 0.5 * v.dot(v) - depth[k];
        mx[k] = hx - gx;
        my[k] = hy - gy;
        mz[k] = hz - gz;
        ixx[k] = 0.5 * (wx * wx);
        ixy[k] = wx * wy;
        ixz[k] = wx * wz;
        iyy[k] = 0.5 * (wy * wy);
        iyz[k] = wy * wz;
        izz[k] = 0.5 * (wz * wz);
        drive[k] = 0.5 * (qd[k] * qd[k]);
    }
}
