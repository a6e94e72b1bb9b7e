//! Inertia matrix of a block.

use super::super::spatial::Vector3;
use super::body::Body;
use super::columns::{Columns, Section};
use super::frame::{
    Frame, LinkTransform, MINUS_QUARTER, NONE, QUARTER, at_each_lane, rotate_z_back,
};
use super::inverse::JointBlock;
use super::lane::{LANES, Lane, Lane3, get, set};
use crate::lanes::{Element, MulAdd};

/// Buffer for the links from a joint outwards, as one body in its frame, and for its wrench at unit acceleration.
#[derive(Clone, Copy, Debug)]
pub struct CompositeBlock<T> {
    first_moment: Lane3<T>,
    /// xx xy xz yy yz zz
    inertia: [Lane<T>; 6],
    force: Lane3<T>,
    moment: Lane3<T>,
}

impl<T: Element> CompositeBlock<T> {
    /// All zero.
    pub const ZERO: Self = Self {
        first_moment: [Lane::ZERO; 3],
        inertia: [Lane::ZERO; 6],
        force: [Lane::ZERO; 3],
        moment: [Lane::ZERO; 3],
    };
}

/// Returns the index of the entry (i, j), j ≤ i, of a lower triangle stored row by row.
#[inline(always)]
pub const fn lower(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// Computes the lower triangle of the inertia matrix, row by row, with drive inertias: composite-rigid-body algorithm
/// (Walker & Orin 1982) on gathered bodies.
///
/// `frames`, `bodies`, `q` and `work` have one entry per joint, `out` has n(n + 1)/2 columns, each written once. The
/// initial content of `composite` does not matter.
#[inline(always)]
pub fn inertia_matrix<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    bodies: &[Body<T>],
    q: &[Lane<T>],
    work: &mut [JointBlock<T>],
    composite: &mut CompositeBlock<T>,
    out: &mut Section<T>,
) {
    // The position of the first joint does not matter.
    for ((frame, q), joint) in frames.iter().zip(q).zip(&mut *work).skip(1) {
        frame.angle::<F>(q, &mut joint.sin, &mut joint.cos);
    }
    composite_bodies::<T, F>(frames, bodies, q, work, composite, out);
}

/// The same with sines and cosines already in `work`.
#[inline(always)]
pub(super) fn composite_bodies<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    bodies: &[Body<T>],
    q: &[Lane<T>],
    work: &[JointBlock<T>],
    composite: &mut CompositeBlock<T>,
    out: &mut (impl Columns<T> + ?Sized),
) {
    let (Some(tip), Some(last)) = (bodies.last(), frames.last()) else {
        return;
    };
    let n = frames.len();
    out.lane(lower(n - 1, n - 1)).fill(own_diagonal(last, tip));
    if n == 2 {
        composite.first_moment = tip.first_moment.map(|x| Lane([x; LANES]));
        composite.inertia = six(tip).map(|x| Lane([x; LANES]));
    }
    // The mass does not depend on the sample.
    let mut mass = tip.mass;
    for i in (1..n).rev() {
        let (frame, joint, slides) = (&frames[i], &work[i], frames[i - 1].prismatic);
        let [diagonal, entry] = out.two(lower(i - 1, i - 1), lower(i, i - 1));
        let own = &bodies[i - 1];
        if i == 1 {
            at_each_lane!(T, F, frame, &q[i], link => inwards::<_, _, _, _, _, false, true>(
                link, frame.prismatic, slides, joint, mass, tip, own, composite, entry, diagonal));
        } else if i == n - 1 {
            at_each_lane!(T, F, frame, &q[i], link => inwards::<_, _, _, _, _, true, false>(
                link, frame.prismatic, slides, joint, mass, tip, own, composite, entry, diagonal));
        } else {
            at_each_lane!(T, F, frame, &q[i], link => inwards::<_, _, _, _, _, false, false>(
                link, frame.prismatic, slides, joint, mass, tip, own, composite, entry, diagonal));
        }
        for j in (0..i - 1).rev() {
            let (joint, between, slides) = (&work[j + 1], &frames[j + 1], frames[j].prismatic);
            let entry = out.lane(lower(i, j));
            if j == 0 {
                at_each_lane!(T, F, between, &q[j + 1], link =>
                    onwards::<_, _, _, _, _, true>(link, slides, joint, composite, entry));
            } else {
                at_each_lane!(T, F, between, &q[j + 1], link =>
                    onwards::<_, _, _, _, _, false>(link, slides, joint, composite, entry));
            }
        }
        mass += own.mass;
    }
}

/// Returns the inertia of a body, entry by entry.
#[inline(always)]
fn six<T: Element>(body: &Body<T>) -> [T; 6] {
    let i = body.inertia;
    [i.xx, i.xy, i.xz, i.yy, i.yz, i.zz]
}

/// Returns the inertia of a body and its drive at the body's own joint.
#[inline(always)]
fn own_diagonal<T: Element>(frame: &Frame<T>, body: &Body<T>) -> T {
    let inertia = if frame.prismatic {
        body.mass
    } else {
        body.inertia.zz
    };
    inertia + body.drive
}

/// Moves inwards across a joint. Computes the wrench of the composite body at unit acceleration along the joint, in the
/// frame before, with its part along that frame's joint (`entry`). Also computes the composite body in that frame with
/// the frame's `own`, and its inertia at that frame's joint (`diagonal`).
///
/// The body has the given `mass` and is the `TIP` or `composite`. If the frame before is the `LAST`, only the entries
/// are needed. The turn about z is computed once for both.
#[inline(always)]
fn inwards<
    T: Element,
    F: MulAdd<T>,
    const TWIST: u8,
    const A: bool,
    const D: bool,
    const TIP: bool,
    const LAST: bool,
>(
    link: impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    prismatic: bool,
    slides: bool,
    joint: &JointBlock<T>,
    mass: T,
    tip: &Body<T>,
    own: &Body<T>,
    composite: &mut CompositeBlock<T>,
    entry: &mut [T; LANES],
    diagonal: &mut [T; LANES],
) {
    let total = mass + own.mass + own.drive;
    let (first_moment, inertia) = (own.first_moment, six(own));
    let (tip_moment, tip_inertia) = (tip.first_moment, six(tip));
    let CompositeBlock {
        first_moment: [hx, hy, hz],
        inertia: [xx, xy, xz, yy, yz, zz],
        force,
        moment,
    } = composite;
    for k in 0..LANES {
        let link = link(k);
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let ([hxk, hyk, hzk], [xxk, xyk, xzk, yyk, yzk, zzk]) = if TIP {
            (tip_moment, tip_inertia)
        } else {
            (
                [hx[k], hy[k], hz[k]],
                [xx[k], xy[k], xz[k], yy[k], yz[k], zz[k]],
            )
        };
        let moment_back = rotate_z_back::<T, F>(s, c, Vector3([hxk, hyk, hzk]));
        let Vector3([ixz, iyz, izz]) = rotate_z_back::<T, F>(s, c, Vector3([xzk, yzk, zzk]));

        let (f, m) = if prismatic {
            started_slide(&link, [s, c], mass, [hxk, hyk])
        } else {
            started_turn(&link, moment_back, [ixz, iyz, izz])
        };
        entry[k] = if slides { f.z() } else { m.z() };
        if !LAST {
            set(force, k, f);
            set(moment, k, m);
        }

        let [ixx, ixy, iyy] = turned::<T, F>(s, c, xxk, xyk, yyk);
        let [ixx, ixy, ixz, iyy, iyz, izz] =
            moved_inertia(&link, mass, moment_back, [ixx, ixy, ixz, iyy, iyz, izz]);
        let about_z = izz + inertia[5];
        diagonal[k] = if slides { total } else { about_z + own.drive };
        if !LAST {
            let Vector3([mx, my, mz]) = moment_back;
            let moved = Vector3([
                F::mul_add(mass, link.a, mx),
                my,
                F::mul_add(mass, link.d, mz),
            ]);
            let [x, y, z] = link.rotate_back(moved).0;
            hx[k] = x + first_moment[0];
            hy[k] = y + first_moment[1];
            hz[k] = z + first_moment[2];
            xx[k] = ixx + inertia[0];
            xy[k] = ixy + inertia[1];
            xz[k] = ixz + inertia[2];
            // Gathered bodies have no yy.
            yy[k] = iyy;
            yz[k] = iyz + inertia[4];
            zz[k] = about_z;
        }
    }
}

/// Returns force and moment, in the frame before, that move the composite body at unit acceleration along its joint, from sine
/// and cosine of the joint, its mass and first moments across the axis.
#[inline(always)]
fn started_slide<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    link: &LinkTransform<T, F, TWIST, A, D>,
    [s, c]: [T; 2],
    mass: T,
    [hx, hy]: [T; 2],
) -> (Vector3<T>, Vector3<T>) {
    let force = Vector3([T::ZERO, T::ZERO, mass]);
    link.wrench_back(s, c, force, Vector3([hy, -hx, T::ZERO]))
}

/// Returns force and moment, in the frame before, that turn the composite body at unit acceleration about its joint,
/// from its first `moment` and the entries xz, yz, zz of its `inertia`, both after the turn back about z.
#[inline(always)]
fn started_turn<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    link: &LinkTransform<T, F, TWIST, A, D>,
    moment: Vector3<T>,
    inertia: [T; 3],
) -> (Vector3<T>, Vector3<T>) {
    let Vector3([mx, my, _]) = moment;
    let [mut x, mut y, mut z] = inertia;
    if A {
        z = F::mul_add(link.a, mx, z);
    }
    if D {
        x = F::mul_add(-link.d, mx, x);
        y = F::mul_add(-link.d, my, y);
    }
    (
        link.rotate_back(Vector3([-my, mx, T::ZERO])),
        link.rotate_back(Vector3([x, y, z])),
    )
}

/// Returns the inertia of the composite body (xx, xy, xz, yy, yz, zz) about the origin of the frame before and along its
/// axes. `mass`, first `moment` and inertia of the body are given after the turn back about z.
#[inline(always)]
fn moved_inertia<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    link: &LinkTransform<T, F, TWIST, A, D>,
    mass: T,
    moment: Vector3<T>,
    inertia: [T; 6],
) -> [T; 6] {
    let Vector3([mx, my, mz]) = moment;
    let [mut ixx, mut ixy, mut ixz, mut iyy, mut iyz, mut izz] = inertia;
    // Parallel axes with p = (a, 0, d): the mixed term of p with m·c + m·p/2.
    let bx = F::mul_add(T::HALF * mass, link.a, mx);
    let bz = F::mul_add(T::HALF * mass, link.d, mz);
    if A {
        ixy = F::mul_add(-link.a, my, ixy);
        ixz = F::mul_add(-link.a, bz, ixz);
        iyy = F::mul_add(link.a + link.a, bx, iyy);
        izz = F::mul_add(link.a + link.a, bx, izz);
    }
    if D {
        ixx = F::mul_add(link.d + link.d, bz, ixx);
        ixz = F::mul_add(-link.d, bx, ixz);
        iyy = F::mul_add(link.d + link.d, bz, iyy);
        iyz = F::mul_add(-link.d, my, iyz);
    }
    match TWIST {
        NONE => [ixx, ixy, ixz, iyy, iyz, izz],
        QUARTER => [ixx, -ixz, ixy, izz, -iyz, iyy],
        MINUS_QUARTER => [ixx, ixz, -ixy, izz, -iyz, iyy],
        _ => {
            let (s, c) = (link.sin_alpha, link.cos_alpha);
            let [iyy, iyz, izz] = turned::<T, F>(s, c, iyy, iyz, izz);
            [
                ixx,
                F::mul_add(c, ixy, -(s * ixz)),
                F::mul_add(s, ixy, c * ixz),
                iyy,
                iyz,
                izz,
            ]
        }
    }
}

/// Returns the entries xx, xy, yy of a tensor after a turn back by an angle about z, given its sine and cosine.
#[inline(always)]
fn turned<T: Element, F: MulAdd<T>>(s: T, c: T, xx: T, xy: T, yy: T) -> [T; 3] {
    let u = F::mul_add(s, xx - yy, c * (xy + xy));
    [
        F::mul_add(-s, u, xx),
        F::mul_add(c, u, -xy),
        F::mul_add(s, u, yy),
    ]
}

/// Transforms the wrench to the next frame inwards.
#[inline(always)]
fn onwards<
    T: Element,
    F: MulAdd<T>,
    const TWIST: u8,
    const A: bool,
    const D: bool,
    const LAST: bool,
>(
    link: impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    slides: bool,
    joint: &JointBlock<T>,
    composite: &mut CompositeBlock<T>,
    entry: &mut [T; LANES],
) {
    let CompositeBlock { force, moment, .. } = composite;
    for k in 0..LANES {
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let (f, m) = link(k).wrench_back(s, c, get(force, k), get(moment, k));
        entry[k] = if slides { f.z() } else { m.z() };
        if !LAST {
            set(force, k, f);
            set(moment, k, m);
        }
    }
}
