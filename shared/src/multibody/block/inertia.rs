//! Inertia matrix of a block.

use super::super::spatial::Vector3;
use super::frame::{MINUS_QUARTER, NONE, Place, QUARTER, at_each_lane, spin_back};
use super::{Body, Frame, JointBlock, LANES, Lane, Lane3, ZERO, ZERO3, get, set};

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
    let mut composite = Composite {
        mass: 0.0,
        first_moment: ZERO3,
        inertia: [ZERO; 6],
    };
    let (mut force, mut moment) = (ZERO3, ZERO3);
    for (i, frame) in frames.iter().enumerate().rev() {
        let body = &bodies[i];
        add(body, &mut composite);
        start(
            frame.prismatic,
            body,
            &composite,
            &mut force,
            &mut moment,
            &mut out[lower(i, i)],
        );
        for j in (0..i).rev() {
            let (joint, between) = (&work[j + 1], &frames[j + 1]);
            let entry = &mut out[lower(i, j)];
            match (j, frames[j].prismatic) {
                (0, false) => at_each_lane!(between, &q[j + 1], place =>
                    end::<_, _, _, false>(place, joint, &force, &moment, entry)),
                (0, true) => at_each_lane!(between, &q[j + 1], place =>
                    end::<_, _, _, true>(place, joint, &force, &moment, entry)),
                (_, prismatic) => {
                    at_each_lane!(between, &q[j + 1], place => inwards(place, joint, &mut force, &mut moment));
                    *entry = if prismatic { force[2] } else { moment[2] };
                }
            }
        }
        match i {
            0 => {}
            // Of the whole arm as one body the turn about the first axis is all that is asked for.
            1 if !frames[0].prismatic => at_each_lane!(frame, &q[i], place =>
                to_parent::<_, _, _, true>(place, &work[i], &mut composite)),
            _ => at_each_lane!(frame, &q[i], place =>
                to_parent::<_, _, _, false>(place, &work[i], &mut composite)),
        }
    }
}

#[inline(always)]
fn add(body: &Body, composite: &mut Composite) {
    let i = body.inertia;
    composite.mass += body.mass;
    for (lane, own) in composite.first_moment.iter_mut().zip(body.first_moment) {
        for k in 0..LANES {
            lane[k] += own;
        }
    }
    for (lane, own) in composite
        .inertia
        .iter_mut()
        .zip([i.xx, i.xy, i.xz, i.yy, i.yz, i.zz])
    {
        for k in 0..LANES {
            lane[k] += own;
        }
    }
}

/// Wrench of the composite body at unit acceleration along its joint, and the entry on the diagonal.
#[inline(always)]
fn start(
    prismatic: bool,
    body: &Body,
    composite: &Composite,
    force: &mut Lane3,
    moment: &mut Lane3,
    entry: &mut Lane,
) {
    let [hx, hy, _] = &composite.first_moment;
    if prismatic {
        *force = [ZERO, ZERO, [composite.mass; LANES]];
        for k in 0..LANES {
            set(moment, k, Vector3([hy[k], -hx[k], 0.0]));
            entry[k] = composite.mass + body.drive;
        }
    } else {
        let [_, _, xz, _, yz, zz] = &composite.inertia;
        for k in 0..LANES {
            set(force, k, Vector3([-hy[k], hx[k], 0.0]));
            set(moment, k, Vector3([xz[k], yz[k], zz[k]]));
            entry[k] = zz[k] + body.drive;
        }
    }
}

/// The wrench in the frame before.
#[inline(always)]
fn inwards<const TWIST: u8, const A: bool, const D: bool>(
    place: impl Fn(usize) -> Place<TWIST, A, D>,
    joint: &JointBlock,
    force: &mut Lane3,
    moment: &mut Lane3,
) {
    for k in 0..LANES {
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let (f, m) = place(k).wrench_back(s, c, get(force, k), get(moment, k));
        set(force, k, f);
        set(moment, k, m);
    }
}

/// The wrench's part along the first joint.
#[inline(always)]
fn end<const TWIST: u8, const A: bool, const D: bool, const PRISMATIC: bool>(
    place: impl Fn(usize) -> Place<TWIST, A, D>,
    joint: &JointBlock,
    force: &Lane3,
    moment: &Lane3,
    entry: &mut Lane,
) {
    for k in 0..LANES {
        let (s, c) = (joint.sin[k], joint.cos[k]);
        let (f, m) = place(k).wrench_back(s, c, get(force, k), get(moment, k));
        entry[k] = if PRISMATIC { f.z() } else { m.z() };
    }
}

/// The composite body in the frame before; of it, no more than the inertia about z where `ZZ`.
#[inline(always)]
fn to_parent<const TWIST: u8, const A: bool, const D: bool, const ZZ: bool>(
    place: impl Fn(usize) -> Place<TWIST, A, D>,
    joint: &JointBlock,
    composite: &mut Composite,
) {
    let mass = composite.mass;
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
        zz[k] = turned[5];
        if !ZZ {
            [hx[k], hy[k], hz[k]] = moved.0;
            [xx[k], xy[k], xz[k], yy[k], yz[k], _] = turned;
        }
    }
}
