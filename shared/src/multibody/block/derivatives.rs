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
use super::lane::{LANES, Lane, Lane3, ZERO, ZERO3, get, set};
use crate::lanes::MulAdd;

type Vector = Vector3<f64>;

/// Buffer for a joint: its axis with both rates, and the links from it outwards.
#[derive(Clone, Copy, Debug)]
pub struct DerivativeBlock {
    /// S
    axis: MotionLanes,
    /// 2·Ψ̇
    rate: MotionLanes,
    /// Ψ̈
    second_rate: MotionLanes,
    links: LinksBlock,
}

impl DerivativeBlock {
    /// All zero.
    pub const ZERO: Self = Self {
        axis: MotionLanes::ZERO,
        rate: MotionLanes::ZERO,
        second_rate: MotionLanes::ZERO,
        links: LinksBlock {
            first_moment: ZERO3,
            second_moment: [ZERO; 6],
            turned: [ZERO3; 3],
            momentum: ZERO3,
            force: ZERO3,
            moment: ZERO3,
        },
    };
}

/// Angular and linear part of a motion.
#[derive(Clone, Copy, Debug)]
struct MotionLanes {
    angular: Lane3,
    linear: Lane3,
}

impl MotionLanes {
    const ZERO: Self = Self {
        angular: ZERO3,
        linear: ZERO3,
    };

    #[inline(always)]
    fn at(&self, k: usize) -> [Vector; 2] {
        [get(&self.angular, k), get(&self.linear, k)]
    }

    #[inline(always)]
    fn put(&mut self, k: usize, [angular, linear]: [Vector; 2]) {
        set(&mut self.angular, k, angular);
        set(&mut self.linear, k, linear);
    }
}

/// Sums over links.
#[derive(Clone, Copy, Debug)]
struct LinksBlock {
    /// h
    first_moment: Lane3,
    /// Σ: xx xy xz yy yz zz
    second_moment: [Lane; 6],
    /// Columns of D.
    turned: [Lane3; 3],
    /// l
    momentum: Lane3,
    /// Wrench of the motion.
    force: Lane3,
    moment: Lane3,
}

/// Pose and motion of a link.
struct Link {
    /// Rows of its rotation: the directions of the base in its frame.
    rows: [Lane3; 3],
    origin: Lane3,
    velocity: MotionLanes,
    acceleration: MotionLanes,
}

/// Computes the derivatives of the torques by position and velocity, and the inertia matrix.
///
/// `frames`, `bodies`, `work` and the signals q, q̇, q̈ have one entry per joint. Column i·n + j of `by_position` and `by_velocity` is ∂τ_i/∂q_j and ∂τ_i/∂q̇_j; `inertia` has the lower triangle as
/// [`super::inertia_matrix`] writes it. Coulomb friction counts as constant.
#[inline(always)]
pub fn inverse_dynamics_derivatives<F: MulAdd>(
    frames: &[Frame],
    gravity: [f64; 3],
    bodies: &[Body],
    signals: [&[Lane]; 3],
    work: &mut [DerivativeBlock],
    by_position: &mut Section,
    by_velocity: &mut Section,
    inertia: &mut Section,
) {
    derivatives::<F>(
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
pub(super) fn derivatives<F: MulAdd>(
    frames: &[Frame],
    gravity: [f64; 3],
    bodies: &[Body],
    [q, qd, qdd]: [&[Lane]; 3],
    work: &mut [DerivativeBlock],
    by_position: &mut (impl Columns + ?Sized),
    by_velocity: &mut (impl Columns + ?Sized),
    inertia: &mut (impl Columns + ?Sized),
) {
    let n = frames.len();
    let row = |r: usize| core::array::from_fn(|c| Lane([f64::from(u8::from(r == c)); LANES]));
    let mut link = Link {
        rows: [row(0), row(1), row(2)],
        origin: ZERO3,
        velocity: MotionLanes::ZERO,
        acceleration: MotionLanes {
            angular: ZERO3,
            linear: gravity.map(|g| Lane([-g; LANES])),
        },
    };
    let (mut sin, mut cos) = (ZERO, ZERO);
    for (i, frame) in frames.iter().enumerate() {
        frame.angle::<F>(&q[i], &mut sin, &mut cos);
        at_each_lane!(F, frame, &q[i], transform => place(transform, &sin, &cos, &mut link));
        move_link::<F>(frame.prismatic, &qd[i], &qdd[i], &mut link, &mut work[i]);
        mass_moments::<F>(&bodies[i], &link, &mut work[i].links);
        momenta::<F>(&bodies[i], &link, &mut work[i].links);
    }
    let mut mass = 0.0;
    let mut row = RowBlock::ZERO;
    for i in (0..n).rev() {
        mass += bodies[i].mass;
        let (before, after) = work.split_at_mut(i + 1);
        let own = &mut before[i];
        if let Some(next) = after.first() {
            own.links.add(&next.links);
        }
        row_of::<F>(mass, own, &mut row);
        if i > 0 {
            column_of::<F>(mass, own, &mut row);
        }
        for (j, other) in before.iter().enumerate() {
            let m = inertia.lane(lower(i, j));
            if j == i {
                let (q, qd) = (by_position.lane(i * n + i), by_velocity.lane(i * n + i));
                let body = &bodies[i];
                along_row::<F>(&row, other, q, qd, m);
                for k in 0..LANES {
                    qd[k] += body.viscous;
                    m[k] += body.drive;
                }
            } else {
                let [q_above, q] = by_position.two(j * n + i, i * n + j);
                let [qd_above, qd] = by_velocity.two(j * n + i, i * n + j);
                along_row::<F>(&row, other, q, qd, m);
                along_column::<F>(&row, other, q_above, qd_above);
            }
        }
    }
}

/// Moves the pose across a joint.
#[inline(always)]
fn place<F: MulAdd, const TWIST: u8, const A: bool, const D: bool>(
    transform: impl Fn(usize) -> LinkTransform<F, TWIST, A, D>,
    sin: &Lane,
    cos: &Lane,
    link: &mut Link,
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
            set(row, k, rotate_z::<F>(sin[k], cos[k], turned));
        }
    }
}

/// Sets the axis of a joint and its rates, and moves the motion across it.
#[inline(always)]
fn move_link<F: MulAdd>(
    prismatic: bool,
    qd: &Lane,
    qdd: &Lane,
    link: &mut Link,
    joint: &mut DerivativeBlock,
) {
    for k in 0..LANES {
        let along = Vector3(core::array::from_fn(|r| link.rows[r][2][k]));
        let axis = if prismatic {
            [Vector::ZERO, along]
        } else {
            [along, cross::<F>(get(&link.origin, k), along)]
        };
        let velocity = link.velocity.at(k);
        let acceleration = link.acceleration.at(k);
        let rate = cross_motion::<F>(velocity, axis, [Vector::ZERO; 2]);
        let second = cross_motion::<F>(velocity, rate, [Vector::ZERO; 2]);
        let second = cross_motion::<F>(acceleration, axis, second);
        joint.axis.put(k, axis);
        joint.rate.put(k, rate.map(|part| part + part));
        joint.second_rate.put(k, second);
        let moved = |start: [Vector; 2], change: [Vector; 2], by: f64| {
            [0, 1].map(|part| scaled_add::<F>(by, change[part], start[part]))
        };
        link.velocity.put(k, moved(velocity, axis, qd[k]));
        let acceleration = moved(acceleration, axis, qdd[k]);
        link.acceleration.put(k, moved(acceleration, rate, qd[k]));
    }
}

/// Computes the mass moments of a link.
#[inline(always)]
fn mass_moments<F: MulAdd>(body: &Body, link: &Link, links: &mut LinksBlock) {
    let i = body.inertia;
    // Σ = tr(J)/2·1 − J in the link's frame.
    let half = 0.5 * (i.xx + i.yy + i.zz);
    let second = [
        Vector3([half - i.xx, -i.xy, -i.xz]),
        Vector3([-i.xy, half - i.yy, -i.yz]),
        Vector3([-i.xz, -i.yz, half - i.zz]),
    ];
    let first = Vector3(body.first_moment);
    for k in 0..LANES {
        let rows = [0, 1, 2].map(|r| get(&link.rows[r], k));
        let origin = get(&link.origin, k);
        let turned = Vector3(rows.map(|row| dot::<F>(row, first, 0.0)));
        // Parallel axes: the mixed term of the origin with h + m·o/2.
        let mixed = scaled_add::<F>(0.5 * body.mass, origin, turned);
        set(
            &mut links.first_moment,
            k,
            scaled_add::<F>(body.mass, origin, turned),
        );
        let half_turned = rows.map(|row| Vector3(second.map(|line| dot::<F>(line, row, 0.0))));
        for (entry, (r, c)) in ENTRIES.into_iter().enumerate() {
            let parallel = F::mul_add(origin.0[r], mixed.0[c], mixed.0[r] * origin.0[c]);
            links.second_moment[entry][k] = dot::<F>(half_turned[r], rows[c], parallel);
        }
    }
}

/// Row and column of the entries of a symmetric matrix.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Computes D, momentum and wrench of a link from its mass moments.
#[inline(always)]
fn momenta<F: MulAdd>(body: &Body, link: &Link, links: &mut LinksBlock) {
    for k in 0..LANES {
        let [w, v] = link.velocity.at(k);
        let [e, a] = link.acceleration.at(k);
        let h = get(&links.first_moment, k);
        let second = links.second_moment_at(k);
        let momentum = cross_add::<F>(w, h, v.scaled(body.mass));
        let along = dot::<F>(v, h, 0.0);
        let mut moment = inertia_times::<F>(second, e, cross::<F>(h, a));
        for c in 0..3 {
            let mut column = cross_add::<F>(second[c], w, v.scaled(-h.0[c]));
            column.0[c] += along;
            set(&mut links.turned[c], k, column);
            moment = scaled_add::<F>(w.0[c], column, moment);
        }
        let force = cross_add::<F>(e, h, a.scaled(body.mass));
        set(&mut links.momentum, k, momentum);
        set(&mut links.force, k, cross_add::<F>(w, momentum, force));
        set(&mut links.moment, k, moment);
    }
}

impl LinksBlock {
    /// Returns the rows of Σ.
    #[inline(always)]
    fn second_moment_at(&self, k: usize) -> [Vector; 3] {
        let [xx, xy, xz, yy, yz, zz] = core::array::from_fn(|c| self.second_moment[c][k]);
        [
            Vector3([xx, xy, xz]),
            Vector3([xy, yy, yz]),
            Vector3([xz, yz, zz]),
        ]
    }

    /// Returns I·motion + `plus` as moment and force.
    #[inline(always)]
    fn inertia_times<F: MulAdd>(
        &self,
        mass: f64,
        k: usize,
        [w, v]: [Vector; 2],
        plus: [Vector; 2],
    ) -> [Vector; 2] {
        let h = get(&self.first_moment, k);
        let second = self.second_moment_at(k);
        [
            inertia_times::<F>(second, w, cross_add::<F>(h, v, plus[0])),
            scaled_add::<F>(mass, v, cross_add::<F>(w, h, plus[1])),
        ]
    }

    /// Returns B·(w, ·) as moment and force.
    #[inline(always)]
    fn coriolis_times<F: MulAdd>(&self, k: usize, w: Vector) -> [Vector; 2] {
        let [a, b, c] = [0, 1, 2].map(|c| get(&self.turned[c], k));
        let [x, y, z] = w.0;
        let moment = scaled_add::<F>(y, b, a.scaled(x));
        [
            scaled_add::<F>(z, c, moment),
            cross::<F>(w, get(&self.momentum, k)),
        ]
    }

    /// Adds the links further outwards.
    #[inline(always)]
    fn add(&mut self, other: &Self) {
        #[inline(always)]
        fn sum(a: &mut [Lane], b: &[Lane]) {
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
struct RowBlock {
    /// Bᵀ·S_i, which is angular.
    turned: Lane3,
    /// I·S_i as moment and force, in the order of a motion's parts.
    inertial: MotionLanes,
    /// 2·B·Ψ̇_i + I·Ψ̈_i + S_i ×* f, likewise.
    by_position: MotionLanes,
    /// 2·(B·S_i + I·Ψ̇_i), likewise.
    by_velocity: MotionLanes,
}

impl RowBlock {
    const ZERO: Self = Self {
        turned: ZERO3,
        inertial: MotionLanes::ZERO,
        by_position: MotionLanes::ZERO,
        by_velocity: MotionLanes::ZERO,
    };
}

/// Computes what the derivatives of the torque at joint i need; `mass` is that of the links from it outwards.
#[inline(always)]
fn row_of<F: MulAdd>(mass: f64, joint: &DerivativeBlock, row: &mut RowBlock) {
    let links = &joint.links;
    for k in 0..LANES {
        let axis @ [z, arm] = joint.axis.at(k);
        let side = cross::<F>(get(&links.momentum, k), arm).0;
        let turned = core::array::from_fn(|c| dot::<F>(get(&links.turned[c], k), z, side[c]));
        set(&mut row.turned, k, Vector3(turned));
        let inertial = links.inertia_times::<F>(mass, k, axis, [Vector::ZERO; 2]);
        row.inertial.put(k, inertial);
    }
}

/// Computes what the derivatives of the other torques by the motion of joint i need.
#[inline(always)]
fn column_of<F: MulAdd>(mass: f64, joint: &DerivativeBlock, row: &mut RowBlock) {
    let links = &joint.links;
    for k in 0..LANES {
        let [z, arm] = joint.axis.at(k);
        let rate = joint.rate.at(k);
        let turned = links.coriolis_times::<F>(k, z + z);
        let by_velocity = links.inertia_times::<F>(mass, k, rate, turned);
        row.by_velocity.put(k, by_velocity);
        let [moment, force] = links.coriolis_times::<F>(k, rate[0]);
        let (carried, turning) = (get(&links.force, k), get(&links.moment, k));
        let moment = cross_add::<F>(arm, carried, cross_add::<F>(z, turning, moment));
        let force = cross_add::<F>(z, carried, force);
        let second = joint.second_rate.at(k);
        let by_position = links.inertia_times::<F>(mass, k, second, [moment, force]);
        row.by_position.put(k, by_position);
    }
}

/// Computes ∂τ_i/∂q_j, ∂τ_i/∂q̇_j and the entry (i, j) of the inertia matrix.
#[inline(always)]
fn along_row<F: MulAdd>(
    row: &RowBlock,
    other: &DerivativeBlock,
    by_position: &mut [f64; LANES],
    by_velocity: &mut [f64; LANES],
    inertia: &mut [f64; LANES],
) {
    for k in 0..LANES {
        let turned = get(&row.turned, k);
        let inertial = row.inertial.at(k);
        let [axis, rate, second] = [&other.axis, &other.rate, &other.second_rate].map(|m| m.at(k));
        let doubled = turned + turned;
        by_position[k] = power::<F>(inertial, second, dot::<F>(turned, rate[0], 0.0));
        by_velocity[k] = power::<F>(inertial, rate, dot::<F>(doubled, axis[0], 0.0));
        inertia[k] = power::<F>(inertial, axis, 0.0);
    }
}

/// Computes ∂τ_j/∂q_i and ∂τ_j/∂q̇_i.
#[inline(always)]
fn along_column<F: MulAdd>(
    row: &RowBlock,
    other: &DerivativeBlock,
    by_position: &mut [f64; LANES],
    by_velocity: &mut [f64; LANES],
) {
    for k in 0..LANES {
        let axis = other.axis.at(k);
        by_position[k] = power::<F>(row.by_position.at(k), axis, 0.0);
        by_velocity[k] = power::<F>(row.by_velocity.at(k), axis, 0.0);
    }
}

/// a·b + c
#[inline(always)]
fn dot<F: MulAdd>(a: Vector, b: Vector, c: f64) -> f64 {
    let ([x, y, z], [p, q, r]) = (a.0, b.0);
    F::mul_add(x, p, F::mul_add(y, q, F::mul_add(z, r, c)))
}

/// Moment and force along a motion, plus `c`.
#[inline(always)]
fn power<F: MulAdd>(wrench: [Vector; 2], motion: [Vector; 2], c: f64) -> f64 {
    dot::<F>(wrench[0], motion[0], dot::<F>(wrench[1], motion[1], c))
}

/// a × b
#[inline(always)]
fn cross<F: MulAdd>(a: Vector, b: Vector) -> Vector {
    let ([x, y, z], [p, q, r]) = (a.0, b.0);
    Vector3([
        F::mul_add(y, r, -(z * q)),
        F::mul_add(z, p, -(x * r)),
        F::mul_add(x, q, -(y * p)),
    ])
}

/// a × b + c
#[inline(always)]
fn cross_add<F: MulAdd>(a: Vector, b: Vector, c: Vector) -> Vector {
    let ([x, y, z], [p, q, r], [cx, cy, cz]) = (a.0, b.0, c.0);
    Vector3([
        F::mul_add(y, r, F::mul_add(-z, q, cx)),
        F::mul_add(z, p, F::mul_add(-x, r, cy)),
        F::mul_add(x, q, F::mul_add(-y, p, cz)),
    ])
}

/// a × b + c of motions (Featherstone 2008, eq. 2.31).
#[inline(always)]
fn cross_motion<F: MulAdd>(a: [Vector; 2], b: [Vector; 2], c: [Vector; 2]) -> [Vector; 2] {
    [
        cross_add::<F>(a[0], b[0], c[0]),
        cross_add::<F>(a[0], b[1], cross_add::<F>(a[1], b[0], c[1])),
    ]
}

/// factor·a + c
#[inline(always)]
fn scaled_add<F: MulAdd>(factor: f64, a: Vector, c: Vector) -> Vector {
    let ([x, y, z], [cx, cy, cz]) = (a.0, c.0);
    Vector3([
        F::mul_add(factor, x, cx),
        F::mul_add(factor, y, cy),
        F::mul_add(factor, z, cz),
    ])
}

/// J·w + c with J = tr(Σ)·1 − Σ, from the rows of Σ.
#[inline(always)]
fn inertia_times<F: MulAdd>(second: [Vector; 3], w: Vector, c: Vector) -> Vector {
    let trace = second[0].0[0] + second[1].0[1] + second[2].0[2];
    let start = scaled_add::<F>(trace, w, c).0;
    Vector3(core::array::from_fn(|r| dot::<F>(-second[r], w, start[r])))
}
