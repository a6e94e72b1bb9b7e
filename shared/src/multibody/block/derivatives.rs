//! Derivatives of the inverse dynamics of a block.
//!
//! All vectors are in the axes of the base and about its origin, so that sums over links need no transform. With the
//! joint axis S_j as a motion, velocity v and acceleration a of the link before it (gravity included), the two rates
//!
//! Ψ̇_j = v × S_j and Ψ̈_j = a × S_j + v × Ψ̇_j
//!
//! and the sums over the links from joint i outwards of inertia I, Coriolis matrix B and wrench f, for j ≤ i
//!
//! ∂τ_i/∂q_j = S_i·(2·B·Ψ̇_j + I·Ψ̈_j), ∂τ_j/∂q_i = S_j·(2·B·Ψ̇_i + I·Ψ̈_i + S_i ×* f)
//!
//! ∂τ_i/∂q̇_j = 2·S_i·(B·S_j + I·Ψ̇_j), ∂τ_j/∂q̇_i = 2·S_j·(B·S_i + I·Ψ̇_i), ∂τ_i/∂q̈_j = S_i·I·S_j
//!
//! (Singh, Russell & Wensing 2022, eqs. 36 to 39, for joints of one degree of freedom; there Ṡ_j = Ψ̇_j.)
//!
//! For a rigid body with the mass moments m, h = ∫x dm and Σ = ∫x·xᵀ dm, and the velocity ẋ = v + ω × x of its points, B
//! has 12 entries. It turns only angular velocities: B·(ω', v') has the moment D·ω' and the force ω' × l, with the
//! momentum l = ∫ẋ dm and D = ∫((x·ẋ)·1 − ẋ·xᵀ) dm = (v·h)·1 − v·hᵀ − ω × Σ. The same matrices give the wrench of the
//! body: moment J·ω̇ + h × a + D·ω and force m·a + ω̇ × h + ω × l, with J = tr(Σ)·1 − Σ.

use super::super::spatial::Vector3;
use super::body::Body;
use super::columns::{Columns, Section};
use super::frame::{Frame, LinkTransform, at_each_lane, rotate_z};
use super::inertia::lower;
use super::lane::{LANES, Lane, Lane3, get, set};
use crate::lanes::{Element, MulAdd};

// No closures over products here: one that the compiler leaves in a function of its own is not compiled for the caller's
// instruction set.

type Vector<T> = Vector3<T>;

/// Buffer for a joint: its axis with both rates, and the links from it outwards.
#[derive(Clone, Copy, Debug)]
pub struct DerivativeBlock<T> {
    /// S
    axis: MotionLanes<T>,
    /// 2·Ψ̇
    rate: MotionLanes<T>,
    /// Ψ̈
    second_rate: MotionLanes<T>,
    links: LinksBlock<T>,
}

impl<T: Element> DerivativeBlock<T> {
    /// All zero.
    pub const ZERO: Self = Self {
        axis: MotionLanes::ZERO,
        rate: MotionLanes::ZERO,
        second_rate: MotionLanes::ZERO,
        links: LinksBlock {
            first_moment: [Lane::ZERO; 3],
            second_moment: [Lane::ZERO; 6],
            turned: [[Lane::ZERO; 3]; 3],
            momentum: [Lane::ZERO; 3],
            force: [Lane::ZERO; 3],
            moment: [Lane::ZERO; 3],
        },
    };
}

/// Angular and linear part of a motion.
#[derive(Clone, Copy, Debug)]
struct MotionLanes<T> {
    angular: Lane3<T>,
    linear: Lane3<T>,
}

impl<T: Element> MotionLanes<T> {
    const ZERO: Self = Self {
        angular: [Lane::ZERO; 3],
        linear: [Lane::ZERO; 3],
    };

    #[inline(always)]
    fn at(&self, k: usize) -> [Vector<T>; 2] {
        [get(&self.angular, k), get(&self.linear, k)]
    }

    #[inline(always)]
    fn put(&mut self, k: usize, [angular, linear]: [Vector<T>; 2]) {
        set(&mut self.angular, k, angular);
        set(&mut self.linear, k, linear);
    }
}

/// Sums over links.
#[derive(Clone, Copy, Debug)]
struct LinksBlock<T> {
    /// h
    first_moment: Lane3<T>,
    /// Σ: xx xy xz yy yz zz
    second_moment: [Lane<T>; 6],
    /// Columns of D.
    turned: [Lane3<T>; 3],
    /// l
    momentum: Lane3<T>,
    /// Wrench of the motion.
    force: Lane3<T>,
    moment: Lane3<T>,
}

/// Pose and motion of a link.
struct Link<T> {
    /// Rows of its rotation: the directions of the base in its frame.
    rows: [Lane3<T>; 3],
    origin: Lane3<T>,
    velocity: MotionLanes<T>,
    acceleration: MotionLanes<T>,
}

/// Computes the derivatives of the torques by position and velocity, and the inertia matrix.
///
/// `frames`, `bodies`, `work` and the signals q, q̇, q̈ have one entry per joint. Column i·n + j of `by_position` and `by_velocity` is ∂τ_i/∂q_j and ∂τ_i/∂q̇_j; `inertia` has the lower triangle as
/// [`super::inertia_matrix`] writes it. Coulomb friction counts as constant.
#[inline(always)]
pub fn inverse_dynamics_derivatives<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    gravity: [T; 3],
    bodies: &[Body<T>],
    signals: [&[Lane<T>]; 3],
    work: &mut [DerivativeBlock<T>],
    by_position: &mut Section<T>,
    by_velocity: &mut Section<T>,
    inertia: &mut Section<T>,
) {
    derivatives::<T, F>(
        frames,
        gravity,
        bodies,
        signals,
        work,
        by_position,
        by_velocity,
        inertia,
    );
}

/// The same into any columns.
#[inline(always)]
pub(super) fn derivatives<T: Element, F: MulAdd<T>>(
    frames: &[Frame<T>],
    gravity: [T; 3],
    bodies: &[Body<T>],
    [q, qd, qdd]: [&[Lane<T>]; 3],
    work: &mut [DerivativeBlock<T>],
    by_position: &mut (impl Columns<T> + ?Sized),
    by_velocity: &mut (impl Columns<T> + ?Sized),
    inertia: &mut (impl Columns<T> + ?Sized),
) {
    let n = frames.len();
    let row =
        |r: usize| core::array::from_fn(|c| Lane([if r == c { T::ONE } else { T::ZERO }; LANES]));
    let mut link = Link {
        rows: [row(0), row(1), row(2)],
        origin: [Lane::ZERO; 3],
        velocity: MotionLanes::ZERO,
        acceleration: MotionLanes {
            angular: [Lane::ZERO; 3],
            linear: gravity.map(|g| Lane([-g; LANES])),
        },
    };
    let (mut sin, mut cos) = (Lane::ZERO, Lane::ZERO);
    for (i, frame) in frames.iter().enumerate() {
        frame.angle::<F>(&q[i], &mut sin, &mut cos);
        at_each_lane!(T, F, frame, &q[i], transform => place(transform, &sin, &cos, &mut link));
        move_link::<T, F>(frame.prismatic, &qd[i], &qdd[i], &mut link, &mut work[i]);
        mass_moments::<T, F>(&bodies[i], &link, &mut work[i].links);
        momenta::<T, F>(&bodies[i], &link, &mut work[i].links);
    }
    let mut mass = T::ZERO;
    let mut row = RowBlock::ZERO;
    for i in (0..n).rev() {
        mass += bodies[i].mass;
        let (before, after) = work.split_at_mut(i + 1);
        let own = &mut before[i];
        if let Some(next) = after.first() {
            own.links.add(&next.links);
        }
        row_of::<T, F>(mass, own, &mut row);
        if i > 0 {
            column_of::<T, F>(mass, own, &mut row);
        }
        for (j, other) in before.iter().enumerate() {
            let m = inertia.lane(lower(i, j));
            if j == i {
                let (q, qd) = (by_position.lane(i * n + i), by_velocity.lane(i * n + i));
                let body = &bodies[i];
                along_row::<T, F>(&row, other, q, qd, m);
                for k in 0..LANES {
                    qd[k] += body.viscous;
                    m[k] += body.drive;
                }
            } else {
                let [q_above, q] = by_position.two(j * n + i, i * n + j);
                let [qd_above, qd] = by_velocity.two(j * n + i, i * n + j);
                along_row::<T, F>(&row, other, q, qd, m);
                along_column::<T, F>(&row, other, q_above, qd_above);
            }
        }
    }
}

/// Moves the pose across a joint.
#[inline(always)]
fn place<T: Element, F: MulAdd<T>, const TWIST: u8, const A: bool, const D: bool>(
    transform: impl Fn(usize) -> LinkTransform<T, F, TWIST, A, D>,
    sin: &Lane<T>,
    cos: &Lane<T>,
    link: &mut Link<T>,
) {
    for (row, origin) in link.rows.iter_mut().zip(&mut link.origin) {
        for k in 0..LANES {
            let transform = transform(k);
            let turned = transform.rotate(get(row, k));
            let [x, _, z] = turned.0;
            if A {
                origin[k] = F::mul_add(transform.a, x, origin[k]);
            }
            if D {
                origin[k] = F::mul_add(transform.d, z, origin[k]);
            }
            set(row, k, rotate_z::<T, F>(sin[k], cos[k], turned));
        }
    }
}

/// Sets the axis of a joint and its rates, and moves the motion across it.
#[inline(always)]
fn move_link<T: Element, F: MulAdd<T>>(
    prismatic: bool,
    qd: &Lane<T>,
    qdd: &Lane<T>,
    link: &mut Link<T>,
    joint: &mut DerivativeBlock<T>,
) {
    for k in 0..LANES {
        let [x, y, z] = &link.rows;
        let along = Vector3([x[2][k], y[2][k], z[2][k]]);
        let axis = if prismatic {
            [Vector::ZERO, along]
        } else {
            [along, cross::<T, F>(get(&link.origin, k), along)]
        };
        let velocity = link.velocity.at(k);
        let acceleration = link.acceleration.at(k);
        let rate = cross_motion::<T, F>(velocity, axis, [Vector::ZERO; 2]);
        let second = cross_motion::<T, F>(velocity, rate, [Vector::ZERO; 2]);
        let second = cross_motion::<T, F>(acceleration, axis, second);
        joint.axis.put(k, axis);
        joint.rate.put(k, [rate[0] + rate[0], rate[1] + rate[1]]);
        joint.second_rate.put(k, second);
        link.velocity
            .put(k, scaled_motion::<T, F>(qd[k], axis, velocity));
        let acceleration = scaled_motion::<T, F>(qdd[k], axis, acceleration);
        link.acceleration
            .put(k, scaled_motion::<T, F>(qd[k], rate, acceleration));
    }
}

/// Computes the mass moments of a link.
#[inline(always)]
fn mass_moments<T: Element, F: MulAdd<T>>(
    body: &Body<T>,
    link: &Link<T>,
    links: &mut LinksBlock<T>,
) {
    let i = body.inertia;
    // Σ = tr(J)/2·1 − J in the link's frame.
    let half = T::HALF * (i.xx + i.yy + i.zz);
    let second = [
        Vector3([half - i.xx, -i.xy, -i.xz]),
        Vector3([-i.xy, half - i.yy, -i.yz]),
        Vector3([-i.xz, -i.yz, half - i.zz]),
    ];
    let first = Vector3(body.first_moment);
    for k in 0..LANES {
        let rows = three(&link.rows, k);
        let origin = get(&link.origin, k);
        let turned = times::<T, F>(rows, first);
        // Parallel axes: the mixed term of the origin with h + m·o/2.
        let mixed = scaled_add::<T, F>(T::HALF * body.mass, origin, turned);
        set(
            &mut links.first_moment,
            k,
            scaled_add::<T, F>(body.mass, origin, turned),
        );
        let [x, y, z] = rows;
        let half_turned = [
            times::<T, F>(second, x),
            times::<T, F>(second, y),
            times::<T, F>(second, z),
        ];
        for (entry, (r, c)) in ENTRIES.into_iter().enumerate() {
            let parallel = F::mul_add(origin.0[r], mixed.0[c], mixed.0[r] * origin.0[c]);
            links.second_moment[entry][k] = dot::<T, F>(half_turned[r], rows[c], parallel);
        }
    }
}

/// Row and column of the entries of a symmetric matrix.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Computes D, momentum and wrench of a link from its mass moments.
#[inline(always)]
fn momenta<T: Element, F: MulAdd<T>>(body: &Body<T>, link: &Link<T>, links: &mut LinksBlock<T>) {
    for k in 0..LANES {
        let [w, v] = link.velocity.at(k);
        let [e, a] = link.acceleration.at(k);
        let h = get(&links.first_moment, k);
        let second = links.second_moment_at(k);
        let momentum = cross_add::<T, F>(w, h, v.scaled(body.mass));
        let along = dot::<T, F>(v, h, T::ZERO);
        let mut moment = inertia_times::<T, F>(second, e, cross::<T, F>(h, a));
        for c in 0..3 {
            let mut column = cross_add::<T, F>(second[c], w, v.scaled(-h.0[c]));
            column.0[c] += along;
            set(&mut links.turned[c], k, column);
            moment = scaled_add::<T, F>(w.0[c], column, moment);
        }
        let force = cross_add::<T, F>(e, h, a.scaled(body.mass));
        set(&mut links.momentum, k, momentum);
        set(&mut links.force, k, cross_add::<T, F>(w, momentum, force));
        set(&mut links.moment, k, moment);
    }
}

impl<T: Element> LinksBlock<T> {
    /// Returns the rows of Σ.
    #[inline(always)]
    fn second_moment_at(&self, k: usize) -> [Vector<T>; 3] {
        let [xx, xy, xz, yy, yz, zz] = &self.second_moment;
        let (xx, xy, xz, yy, yz, zz) = (xx[k], xy[k], xz[k], yy[k], yz[k], zz[k]);
        [
            Vector3([xx, xy, xz]),
            Vector3([xy, yy, yz]),
            Vector3([xz, yz, zz]),
        ]
    }

    /// Returns I·motion + `plus` as moment and force.
    #[inline(always)]
    fn inertia_times<F: MulAdd<T>>(
        &self,
        mass: T,
        k: usize,
        [w, v]: [Vector<T>; 2],
        plus: [Vector<T>; 2],
    ) -> [Vector<T>; 2] {
        let h = get(&self.first_moment, k);
        let second = self.second_moment_at(k);
        [
            inertia_times::<T, F>(second, w, cross_add::<T, F>(h, v, plus[0])),
            scaled_add::<T, F>(mass, v, cross_add::<T, F>(w, h, plus[1])),
        ]
    }

    /// Returns B·(w, ·) as moment and force.
    #[inline(always)]
    fn coriolis_times<F: MulAdd<T>>(&self, k: usize, w: Vector<T>) -> [Vector<T>; 2] {
        let [a, b, c] = three(&self.turned, k);
        let [x, y, z] = w.0;
        let moment = scaled_add::<T, F>(y, b, a.scaled(x));
        [
            scaled_add::<T, F>(z, c, moment),
            cross::<T, F>(w, get(&self.momentum, k)),
        ]
    }

    /// Adds the links further outwards.
    #[inline(always)]
    fn add(&mut self, other: &Self) {
        #[inline(always)]
        fn sum<T: Element>(a: &mut [Lane<T>], b: &[Lane<T>]) {
            for (a, b) in a.iter_mut().zip(b) {
                for k in 0..LANES {
                    a[k] += b[k];
                }
            }
        }
        sum(&mut self.first_moment, &other.first_moment);
        sum(&mut self.second_moment, &other.second_moment);
        for (own, other) in self.turned.iter_mut().zip(&other.turned) {
            sum(own, other);
        }
        sum(&mut self.momentum, &other.momentum);
        sum(&mut self.force, &other.force);
        sum(&mut self.moment, &other.moment);
    }
}

/// What the pairs with one joint i have in common.
struct RowBlock<T> {
    /// Bᵀ·S_i, which is angular.
    turned: Lane3<T>,
    /// I·S_i as moment and force, in the order of a motion's parts.
    inertial: MotionLanes<T>,
    /// 2·B·Ψ̇_i + I·Ψ̈_i + S_i ×* f, likewise.
    by_position: MotionLanes<T>,
    /// 2·(B·S_i + I·Ψ̇_i), likewise.
    by_velocity: MotionLanes<T>,
}

impl<T: Element> RowBlock<T> {
    const ZERO: Self = Self {
        turned: [Lane::ZERO; 3],
        inertial: MotionLanes::ZERO,
        by_position: MotionLanes::ZERO,
        by_velocity: MotionLanes::ZERO,
    };
}

/// Computes what the derivatives of the torque at joint i need; `mass` is that of the links from it outwards.
#[inline(always)]
fn row_of<T: Element, F: MulAdd<T>>(mass: T, joint: &DerivativeBlock<T>, row: &mut RowBlock<T>) {
    let links = &joint.links;
    for k in 0..LANES {
        let axis @ [z, arm] = joint.axis.at(k);
        let side = cross::<T, F>(get(&links.momentum, k), arm).0;
        let [a, b, c] = three(&links.turned, k);
        let turned = Vector3([
            dot::<T, F>(a, z, side[0]),
            dot::<T, F>(b, z, side[1]),
            dot::<T, F>(c, z, side[2]),
        ]);
        set(&mut row.turned, k, turned);
        let inertial = links.inertia_times::<F>(mass, k, axis, [Vector::ZERO; 2]);
        row.inertial.put(k, inertial);
    }
}

/// Computes what the derivatives of the other torques by the motion of joint i need.
#[inline(always)]
fn column_of<T: Element, F: MulAdd<T>>(mass: T, joint: &DerivativeBlock<T>, row: &mut RowBlock<T>) {
    let links = &joint.links;
    for k in 0..LANES {
        let [z, arm] = joint.axis.at(k);
        let rate = joint.rate.at(k);
        let turned = links.coriolis_times::<F>(k, z + z);
        let by_velocity = links.inertia_times::<F>(mass, k, rate, turned);
        row.by_velocity.put(k, by_velocity);
        let [moment, force] = links.coriolis_times::<F>(k, rate[0]);
        let (carried, turning) = (get(&links.force, k), get(&links.moment, k));
        let moment = cross_add::<T, F>(arm, carried, cross_add::<T, F>(z, turning, moment));
        let force = cross_add::<T, F>(z, carried, force);
        let second = joint.second_rate.at(k);
        let by_position = links.inertia_times::<F>(mass, k, second, [moment, force]);
        row.by_position.put(k, by_position);
    }
}

/// Computes ∂τ_i/∂q_j, ∂τ_i/∂q̇_j and the entry (i, j) of the inertia matrix.
#[inline(always)]
fn along_row<T: Element, F: MulAdd<T>>(
    row: &RowBlock<T>,
    other: &DerivativeBlock<T>,
    by_position: &mut [T; LANES],
    by_velocity: &mut [T; LANES],
    inertia: &mut [T; LANES],
) {
    for k in 0..LANES {
        let turned = get(&row.turned, k);
        let inertial = row.inertial.at(k);
        let (axis, rate) = (other.axis.at(k), other.rate.at(k));
        let second = other.second_rate.at(k);
        let doubled = turned + turned;
        by_position[k] = power::<T, F>(inertial, second, dot::<T, F>(turned, rate[0], T::ZERO));
        by_velocity[k] = power::<T, F>(inertial, rate, dot::<T, F>(doubled, axis[0], T::ZERO));
        inertia[k] = power::<T, F>(inertial, axis, T::ZERO);
    }
}

/// Computes ∂τ_j/∂q_i and ∂τ_j/∂q̇_i.
#[inline(always)]
fn along_column<T: Element, F: MulAdd<T>>(
    row: &RowBlock<T>,
    other: &DerivativeBlock<T>,
    by_position: &mut [T; LANES],
    by_velocity: &mut [T; LANES],
) {
    for k in 0..LANES {
        let axis = other.axis.at(k);
        by_position[k] = power::<T, F>(row.by_position.at(k), axis, T::ZERO);
        by_velocity[k] = power::<T, F>(row.by_velocity.at(k), axis, T::ZERO);
    }
}

/// a·b + c
#[inline(always)]
fn dot<T: Element, F: MulAdd<T>>(a: Vector<T>, b: Vector<T>, c: T) -> T {
    let ([x, y, z], [p, q, r]) = (a.0, b.0);
    F::mul_add(x, p, F::mul_add(y, q, F::mul_add(z, r, c)))
}

/// Moment and force along a motion, plus `c`.
#[inline(always)]
fn power<T: Element, F: MulAdd<T>>(wrench: [Vector<T>; 2], motion: [Vector<T>; 2], c: T) -> T {
    dot::<T, F>(wrench[0], motion[0], dot::<T, F>(wrench[1], motion[1], c))
}

/// a × b
#[inline(always)]
fn cross<T: Element, F: MulAdd<T>>(a: Vector<T>, b: Vector<T>) -> Vector<T> {
    let ([x, y, z], [p, q, r]) = (a.0, b.0);
    Vector3([
        F::mul_add(y, r, -(z * q)),
        F::mul_add(z, p, -(x * r)),
        F::mul_add(x, q, -(y * p)),
    ])
}

/// a × b + c
#[inline(always)]
fn cross_add<T: Element, F: MulAdd<T>>(a: Vector<T>, b: Vector<T>, c: Vector<T>) -> Vector<T> {
    let ([x, y, z], [p, q, r], [cx, cy, cz]) = (a.0, b.0, c.0);
    Vector3([
        F::mul_add(y, r, F::mul_add(-z, q, cx)),
        F::mul_add(z, p, F::mul_add(-x, r, cy)),
        F::mul_add(x, q, F::mul_add(-y, p, cz)),
    ])
}

/// a × b + c of motions (Featherstone 2008, eq. 2.31).
#[inline(always)]
fn cross_motion<T: Element, F: MulAdd<T>>(
    a: [Vector<T>; 2],
    b: [Vector<T>; 2],
    c: [Vector<T>; 2],
) -> [Vector<T>; 2] {
    [
        cross_add::<T, F>(a[0], b[0], c[0]),
        cross_add::<T, F>(a[0], b[1], cross_add::<T, F>(a[1], b[0], c[1])),
    ]
}

/// factor·a + c
#[inline(always)]
fn scaled_add<T: Element, F: MulAdd<T>>(factor: T, a: Vector<T>, c: Vector<T>) -> Vector<T> {
    let ([x, y, z], [cx, cy, cz]) = (a.0, c.0);
    Vector3([
        F::mul_add(factor, x, cx),
        F::mul_add(factor, y, cy),
        F::mul_add(factor, z, cz),
    ])
}

/// factor·a + c of motions.
#[inline(always)]
fn scaled_motion<T: Element, F: MulAdd<T>>(
    factor: T,
    a: [Vector<T>; 2],
    c: [Vector<T>; 2],
) -> [Vector<T>; 2] {
    [
        scaled_add::<T, F>(factor, a[0], c[0]),
        scaled_add::<T, F>(factor, a[1], c[1]),
    ]
}

/// Returns three vectors of one sample.
#[inline(always)]
fn three<T: Element>(vectors: &[Lane3<T>; 3], k: usize) -> [Vector<T>; 3] {
    let [a, b, c] = vectors;
    [get(a, k), get(b, k), get(c, k)]
}

/// The product of a matrix, given by its rows, and a vector.
#[inline(always)]
fn times<T: Element, F: MulAdd<T>>(rows: [Vector<T>; 3], v: Vector<T>) -> Vector<T> {
    let [x, y, z] = rows;
    Vector3([
        dot::<T, F>(x, v, T::ZERO),
        dot::<T, F>(y, v, T::ZERO),
        dot::<T, F>(z, v, T::ZERO),
    ])
}

/// J·w + c with J = tr(Σ)·1 − Σ, from the rows of Σ.
#[inline(always)]
fn inertia_times<T: Element, F: MulAdd<T>>(
    second: [Vector<T>; 3],
    w: Vector<T>,
    c: Vector<T>,
) -> Vector<T> {
    let trace = second[0].0[0] + second[1].0[1] + second[2].0[2];
    let start = scaled_add::<T, F>(trace, w, c).0;
    let [x, y, z] = second;
    Vector3([
        dot::<T, F>(-x, w, start[0]),
        dot::<T, F>(-y, w, start[1]),
        dot::<T, F>(-z, w, start[2]),
    ])
}
