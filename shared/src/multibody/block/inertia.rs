//! Inertia matrix of a block.

use super::super::spatial::Vector3;
use super::frame::{MINUS_QUARTER, NONE, Place, QUARTER, at_each_lane, spin_back};
use super::{Body, Frame, JointBlock, LANES, Lane, Lane3, ZERO3, get, set};

/// The links from one joint outwards as one body in that joint's frame; its mass does not depend on the sample.
struct Composite {
    mass: f64,
    first_moment: Lane3,
    /// xx xy xz yy yz zz
    inertia: [Lane; 6],
}

/// Place of the entry (i, j), j ≤ i, of a lower triangle stored row by row.
#[inline(always)]
pub const fn lower(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// Lower triangle of the inertia matrix, row by row, drive inertias included: composite-rigid-body algorithm (Walker &
/// Orin 1982) on gathered bodies.
///
/// `frames`, `bodies`, `q` and `work` have one entry a joint, `out` has n(n + 1)/2.
#[inline(always)]
pub fn inertia_matrix(
    frames: &[Frame],
    bodies: &[Body],
    q: &[Lane],
    work: &mut [JointBlock],
    out: &mut [Lane],
) {
    for ((frame, q), joint) in frames.iter().zip(q).zip(&mut *work) {
        frame.angle(q, &mut joint.sin, &mut joint.cos);
    }
    composite_bodies(frames, bodies, q, work, out);
}

/// The same with the sines and cosines already in `work`.
#[inline(always)]
pub(super) fn composite_bodies(
    frames: &[Frame],
    bodies: &[Body],
    q: &[Lane],
    work: &[JointBlock],
    out: &mut [Lane],
) {
    let Some(tip) = bodies.last() else {
        return;
    };
    let mut composite = Composite {
        mass: tip.mass,
        first_moment: tip.first_moment.map(|x| [x; LANES]),
        inertia: six(tip).map(|x| [x; LANES]),
    };
    let (mut force, mut moment) = (ZERO3, ZERO3);
    for (i, frame) in frames.iter().enumerate().rev() {
        diagonal(
            frame.prismatic,
            &bodies[i],
            &composite,
            &mut out[lower(i, i)],
        );
        if i == 0 {
            break;
        }
        let (joint, slides) = (&work[i], frames[i - 1].prismatic);
        let entry = &mut out[lower(i, i - 1)];
        if i == 1 {
            at_each_lane!(frame, &q[i], place => begin::<_, _, _, true>(
                place, frame.prismatic, slides, joint, &composite, &mut force, &mut moment, entry));
        } else {
            at_each_lane!(frame, &q[i], place => begin::<_, _, _, false>(
                place, frame.prismatic, slides, joint, &composite, &mut force, &mut moment, entry));
        }
        for j in (0..i - 1).rev() {
            let (joint, between, slides) = (&work[j + 1], &frames[j + 1], frames[j].prismatic);
            let entry = &mut out[lower(i, j)];
            if j == 0 {
                at_each_lane!(between, &q[j + 1], place =>
                    onwards::<_, _, _, true>(place, slides, joint, &mut force, &mut moment, entry));
            } else {
                at_each_lane!(between, &q[j + 1], place =>
                    onwards::<_, _, _, false>(place, slides, joint, &mut force, &mut moment, entry));
            }
        }
        // Of the whole arm as one body the turn about the first axis is all that is asked for.
        if i == 1 && !frames[0].prismatic {
            at_each_lane!(frame, &q[i], place =>
                to_parent::<_, _, _, true>(place, joint, &bodies[i - 1], &mut composite));
        } else {
            at_each_lane!(frame, &q[i], place =>
                to_parent::<_, _, _, false>(place, joint, &bodies[i - 1], &mut composite));
        }
    }
}

/// The inertia of a body, entry by entry.
#[inline(always)]
fn six(body: &Body) -> [f64; 6] {
    let i = body.inertia;
    [i.xx, i.xy, i.xz, i.yy, i.yz, i.zz]
}

/// The entry on the diagonal.
#[inline(always)]
fn diagonal(prismatic: bool, body: &Body, composite: &Composite, entry: &mut Lane) {
    if prismatic {
        entry.fill(composite.mass + body.drive);
    } else {
        for k in 0..LANES {
            entry[k] = composite.inertia[5][k] + body.drive;
        }
    }
}

/// Wrench of the composite body at unit acceleration along its joint, in the frame before, and its part along that
/// frame's joint; that part alone where it is the `LAST`.
#[inline(always)]
fn begin<const TWIST: u8, const A: bool, const D: bool, const LAST: bool>(
    place: impl Fn(usize) -> Place<TWIST, A, D>,
    prismatic: bool,
    slides: bool,
    joint: &JointBlock,
    composite: &Composite,
    force: &mut Lane3,
    moment: &mut Lane3,
    entry: &mut Lane,
) {
    let [hx, hy, _] = &composite.first_moment;
    let [_, _, xz, _, yz, zz] = &composite.inertia;
    for k in 0..LANES {
        let (f, m) = if prismatic {
            ([0.0, 0.0, composite.mass], [hy[k], -hx[k], 0.0])
        } else {
            ([-hy[k], hx[k], 0.0], [xz[k], yz[k], zz[k]])
        };
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let (f, m) = place(k).wrench_back(s, c, Vector3(f), Vector3(m));
        entry[k] = if slides { f.z() } else { m.z() };
        if !LAST {
            set(force, k, f);
            set(moment, k, m);
        }
    }
}

/// The wrench one frame further.
#[inline(always)]
fn onwards<const TWIST: u8, const A: bool, const D: bool, const LAST: bool>(
    place: impl Fn(usize) -> Place<TWIST, A, D>,
    slides: bool,
    joint: &JointBlock,
    force: &mut Lane3,
    moment: &mut Lane3,
    entry: &mut Lane,
) {
    for k in 0..LANES {
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let (f, m) = place(k).wrench_back(s, c, get(force, k), get(moment, k));
        entry[k] = if slides { f.z() } else { m.z() };
        if !LAST {
            set(force, k, f);
            set(moment, k, m);
        }
    }
}

/// The composite body in the frame before, with that frame's own; of it, no more than the inertia about z where `ZZ`.
#[inline(always)]
fn to_parent<const TWIST: u8, const A: bool, const D: bool, const ZZ: bool>(
    place: impl Fn(usize) -> Place<TWIST, A, D>,
    joint: &JointBlock,
    own: &Body,
    composite: &mut Composite,
) {
    let mass = composite.mass;
    let (first_moment, inertia) = (own.first_moment, six(own));
    composite.mass += own.mass;
    let [h, i] = [&mut composite.first_moment[..], &mut composite.inertia[..]];
    let ([hx, hy, hz], [xx, xy, xz, yy, yz, zz]) = (h, i) else {
        return;
    };
    for k in 0..LANES {
        let place = place(k);
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let Vector3([mx, my, mz]) = spin_back(s, c, Vector3([hx[k], hy[k], hz[k]]));
        // The turn about z acts on the upper left of the tensor with twice the angle.
        let (s2, c2) = (2.0 * (s * c), (c - s) * (c + s));
        let (mean, half) = (0.5 * (xx[k] + yy[k]), 0.5 * (xx[k] - yy[k]));
        let difference = c2 * half - s2 * xy[k];
        let [mut ixx, mut ixy, mut iyy] =
            [mean + difference, s2 * half + c2 * xy[k], mean - difference];
        let (mut ixz, mut iyz) = (c * xz[k] - s * yz[k], s * xz[k] + c * yz[k]);
        let mut izz = zz[k];
        // Parallel axes with p = (a, 0, d): the mixed term of p with m·c + m·p/2.
        let (bx, bz) = (mx + 0.5 * mass * place.a, mz + 0.5 * mass * place.d);
        if A {
            let twice = 2.0 * place.a * bx;
            ixy -= place.a * my;
            ixz -= place.a * bz;
            iyy += twice;
            izz += twice;
        }
        if D {
            let twice = 2.0 * place.d * bz;
            ixx += twice;
            ixz -= place.d * bx;
            iyy += twice;
            iyz -= place.d * my;
        }
        let moved = Vector3([mx + mass * place.a, my, mz + mass * place.d]);
        let moved = place.turn_back(moved);
        let turned = match TWIST {
            NONE => [ixx, ixy, ixz, iyy, iyz, izz],
            QUARTER => [ixx, -ixz, ixy, izz, -iyz, iyy],
            MINUS_QUARTER => [ixx, ixz, -ixy, izz, -iyz, iyy],
            _ => {
                let (s, c) = (place.sin_alpha, place.cos_alpha);
                let (s2, c2) = (2.0 * (s * c), (c - s) * (c + s));
                let (mean, half) = (0.5 * (iyy + izz), 0.5 * (iyy - izz));
                let difference = c2 * half - s2 * iyz;
                [
                    ixx,
                    c * ixy - s * ixz,
                    s * ixy + c * ixz,
                    mean + difference,
                    s2 * half + c2 * iyz,
                    mean - difference,
                ]
            }
        };
        zz[k] = turned[5] + inertia[5];
        if !ZZ {
            let [x, y, z] = moved.0;
            hx[k] = x + first_moment[0];
            hy[k] = y + first_moment[1];
            hz[k] = z + first_moment[2];
            xx[k] = turned[0] + inertia[0];
            xy[k] = turned[1] + inertia[1];
            xz[k] = turned[2] + inertia[2];
            yy[k] = turned[3] + inertia[3];
            yz[k] = turned[4] + inertia[4];
        }
    }
}
