#![allow(clippy::unwrap_used)]
use std::vec;
use std::vec::Vec;

use super::*;
use crate::multibody::samples::{Sample, relative_difference};
use crate::multibody::*;

/// A random chain of all axes, of which some follow: the joints' own chain, and which axes follow.
struct Geared {
    all: Sample,
    chain: Chain<f64>,
    /// Rows by link.
    parameters: Vec<[f64; COLUMNS]>,
    /// Positions of all axes are matrix·q + offset.
    matrix: Vec<Vec<f64>>,
    offset: Vec<f64>,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

/// Which axes follow which axis, by which ratio and offset.
type Gears = &'static [(usize, usize, f64, f64)];

/// Followers beside their joint, before it, at the end, at the base, and several of one joint.
const CASES: [(usize, Gears); 6] = [
    (3, &[(2, 1, -1.0, 0.0)]),
    (4, &[(2, 0, 0.5, 0.3)]),
    (4, &[(0, 2, -1.0, -0.2)]),
    (5, &[(1, 0, 2.0, 0.1), (4, 3, -0.7, 0.0)]),
    (6, &[(2, 1, -1.0, 0.0), (3, 1, 0.5, 0.4), (5, 4, 1.0, 0.0)]),
    (8, &[(6, 0, 0.5, 0.0), (7, 0, -1.5, 1.0)]),
];

impl Geared {
    fn new(axes: usize, gears: Gears, seed: u64) -> Self {
        let all = Sample::random(axes, seed);
        let follows = |axis: usize| gears.iter().find(|own| own.0 == axis);
        let joints: Vec<usize> = (0..axes).filter(|axis| follows(*axis).is_none()).collect();
        let joint_of = |axis: usize| joints.iter().position(|own| *own == axis).unwrap();
        let followers: Vec<Follower> = (gears.iter())
            .map(|&(axis, master, ratio, offset)| Follower {
                geometry: all.geometry[axis],
                before: joints.iter().filter(|own| **own < axis).count(),
                master: joint_of(master),
                ratio,
                offset,
            })
            .collect();
        let geometry: Vec<JointGeometry> = joints.iter().map(|own| all.geometry[*own]).collect();
        let chain = Chain::with_followers(&geometry, &followers, all.gravity).unwrap();
        let mut parameters: Vec<_> = joints.iter().map(|own| all.parameters[*own]).collect();
        parameters.extend(gears.iter().map(|own| all.parameters[own.0]));
        let mut matrix = vec![vec![0.0; joints.len()]; axes];
        let mut offset = vec![0.0; axes];
        for axis in 0..axes {
            let (master, ratio, shift) =
                follows(axis).map_or((axis, 1.0, 0.0), |own| (own.1, own.2, own.3));
            matrix[axis][joint_of(master)] = ratio;
            offset[axis] = shift;
        }
        let own = |list: &[f64]| joints.iter().map(|axis| list[*axis]).collect::<Vec<_>>();
        let (q, qd, qdd) = (own(&all.q), own(&all.qd), own(&all.qdd));
        // A follower has no drive and no friction of its own.
        let mut all = all;
        for (axis, ..) in gears {
            all.parameters[*axis][column::DRIVE_INERTIA..].fill(0.0);
        }
        Self {
            all,
            chain,
            parameters,
            matrix,
            offset,
            q,
            qd,
            qdd,
        }
    }

    fn many() -> impl Iterator<Item = Self> {
        (CASES.into_iter())
            .flat_map(|(axes, gears)| (0..4).map(move |seed| Self::new(axes, gears, seed)))
    }

    fn n(&self) -> usize {
        self.q.len()
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let dot = |row: &Vec<f64>| row.iter().zip(x).map(|(a, b)| a * b).sum();
        self.matrix.iter().map(dot).collect()
    }

    fn position(&self, q: &[f64]) -> Vec<f64> {
        self.times(q)
            .iter()
            .zip(&self.offset)
            .map(|(a, b)| a + b)
            .collect()
    }

    /// Kinetic minus potential energy of the chain of all axes.
    fn lagrangian(&self, q: &[f64], qd: &[f64]) -> f64 {
        let (chain, rows) = (self.all.chain(), &self.all.parameters);
        let (q, qd) = (self.position(q), self.times(qd));
        kinetic_energy(&chain, rows, &q, &qd).unwrap() - potential_energy(&chain, rows, &q).unwrap()
    }

    fn torque(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
        let mut tau = vec![0.0; self.n()];
        inverse_dynamics(&self.chain, &self.parameters, q, qd, qdd, &mut tau).unwrap();
        tau
    }

    fn flat(&self) -> Vec<f64> {
        self.parameters.concat()
    }
}

fn moved(x: &[f64], along: &[f64], h: f64) -> Vec<f64> {
    x.iter().zip(along).map(|(x, d)| x + h * d).collect()
}

fn slope(of: impl Fn(f64) -> f64, h: f64) -> f64 {
    (8.0 * (of(h) - of(-h)) - (of(2.0 * h) - of(-2.0 * h))) / (12.0 * h)
}

fn unit(n: usize, k: usize) -> Vec<f64> {
    let mut e = vec![0.0; n];
    e[k] = 1.0;
    e
}

fn by_row(matrix: &[f64], width: usize, x: &[f64]) -> Vec<f64> {
    let dot = |row: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum();
    matrix.chunks(width).map(dot).collect()
}

/// Lagrange's equations in the coordinates, from the energies of the chain of all axes and difference quotients.
#[test]
fn torques_are_those_of_lagrange_in_the_coordinates() {
    let mut worst = 0.0_f64;
    for case in Geared::many() {
        let n = case.n();
        let momentum = |k: usize, q: &[f64], qd: &[f64]| {
            slope(|h| case.lagrangian(q, &moved(qd, &unit(n, k), h)), 1e-2)
        };
        let expected: Vec<f64> = (0..n)
            .map(|k| {
                let along = |h: f64| {
                    let half: Vec<f64> = moved(&case.qd, &case.qdd, 0.5 * h);
                    momentum(k, &moved(&case.q, &half, h), &moved(&case.qd, &case.qdd, h))
                };
                let row = &case.parameters[k];
                slope(along, 1e-3)
                    - slope(
                        |h| case.lagrangian(&moved(&case.q, &unit(n, k), h), &case.qd),
                        1e-3,
                    )
                    + row[column::VISCOUS] * case.qd[k]
                    + row[column::COULOMB] * case.qd[k].signum()
                    + row[column::OFFSET]
            })
            .collect();
        let found = case.torque(&case.q, &case.qd, &case.qdd);
        worst = worst.max(relative_difference(&found, &expected));
    }
    // Difference quotients of fourth order.
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn regressors_times_parameters_are_the_quantities() {
    for case in Geared::many() {
        let (n, flat) = (case.n(), case.flat());
        let width = case.chain.parameter_count();
        let mut regressor = vec![0.0; n * width];
        differential_regressor(&case.chain, &case.q, &case.qd, &case.qdd, &mut regressor).unwrap();
        let tau = case.torque(&case.q, &case.qd, &case.qdd);
        assert!(relative_difference(&by_row(&regressor, width, &flat), &tau) < 1e-11);

        let mut matrix = vec![0.0; n * n];
        inertia_matrix(&case.chain, &case.parameters, &case.q, &mut matrix).unwrap();
        momentum_regressor(&case.chain, &case.q, &case.qd, &mut regressor).unwrap();
        let momentum = by_row(&matrix, n, &case.qd);
        assert!(relative_difference(&by_row(&regressor, width, &flat), &momentum) < 1e-11);

        let mut row = vec![0.0; width];
        energy_regressor(&case.chain, &case.q, &case.qd, &mut row).unwrap();
        let energy = kinetic_energy(&case.chain, &case.parameters, &case.q, &case.qd).unwrap()
            + potential_energy(&case.chain, &case.parameters, &case.q).unwrap();
        assert!(relative_difference(&by_row(&row, width, &flat), &[energy]) < 1e-11);

        power_regressor(&case.chain, &case.q, &case.qd, &case.qdd, &mut row).unwrap();
        let power: f64 = case.qd.iter().zip(&tau).map(|(a, b)| a * b).sum();
        assert!(relative_difference(&by_row(&row, width, &flat), &[power]) < 1e-11);
    }
}

/// The momentum changes by the torque that the loss leaves.
#[test]
fn loss_is_torque_minus_rate_of_the_momentum() {
    for case in Geared::many() {
        let (n, flat, width) = (case.n(), case.flat(), case.chain.parameter_count());
        let at = |h: f64, k: usize| {
            let half: Vec<f64> = moved(&case.qd, &case.qdd, 0.5 * h);
            let (q, qd) = (moved(&case.q, &half, h), moved(&case.qd, &case.qdd, h));
            let mut regressor = vec![0.0; n * width];
            momentum_regressor(&case.chain, &q, &qd, &mut regressor).unwrap();
            by_row(&regressor, width, &flat)[k]
        };
        let mut loss = vec![0.0; n * width];
        momentum_loss_regressor(&case.chain, &case.q, &case.qd, &mut loss).unwrap();
        let loss = by_row(&loss, width, &flat);
        let sum: Vec<f64> = (0..n)
            .map(|k| slope(|h| at(h, k), 1e-3) + loss[k])
            .collect();
        let tau = case.torque(&case.q, &case.qd, &case.qdd);
        assert!(relative_difference(&sum, &tau) < 1e-8);
    }
}

#[test]
fn accelerations_undo_torques_and_the_coriolis_matrix_is_passive() {
    for case in Geared::many() {
        let n = case.n();
        let tau = case.torque(&case.q, &case.qd, &case.qdd);
        for solve in [forward_dynamics, articulated_forward_dynamics] {
            let mut qdd = vec![0.0; n];
            solve(
                &case.chain,
                &case.parameters,
                &case.q,
                &case.qd,
                &tau,
                &mut qdd,
            )
            .unwrap();
            assert!(relative_difference(&qdd, &case.qdd) < 1e-8);
        }
        let mut coriolis = vec![0.0; n * n];
        coriolis_matrix(
            &case.chain,
            &case.parameters,
            &case.q,
            &case.qd,
            &mut coriolis,
        )
        .unwrap();
        let still = vec![0.0; n];
        let bias = case.torque(&case.q, &case.qd, &still);
        let friction: Vec<f64> = (0..n)
            .map(|k| {
                let row = &case.parameters[k];
                row[column::VISCOUS] * case.qd[k]
                    + row[column::COULOMB] * case.qd[k].signum()
                    + row[column::OFFSET]
            })
            .collect();
        let mut gravity = vec![0.0; n];
        gravity_vector(&case.chain, &case.parameters, &case.q, &mut gravity).unwrap();
        let sum: Vec<f64> = by_row(&coriolis, n, &case.qd)
            .iter()
            .zip(&gravity)
            .zip(&friction)
            .map(|((a, b), c)| a + b + c)
            .collect();
        assert!(relative_difference(&sum, &bias) < 1e-10);
        let matrix = |h: f64| {
            let mut out = vec![0.0; n * n];
            let q = moved(&case.q, &case.qd, h);
            inertia_matrix(&case.chain, &case.parameters, &q, &mut out).unwrap();
            out
        };
        for i in 0..n {
            for j in 0..n {
                let rate = slope(|h| matrix(h)[i * n + j], 1e-3);
                let skew = rate - coriolis[i * n + j] - coriolis[j * n + i];
                assert!(skew.abs() < 1e-7 * (1.0 + rate.abs()), "{skew:e}");
            }
        }
    }
}

/// Without drives' torques and friction nothing feeds energy in or takes it: Runge and Kutta's fourth order, 0.2 s.
#[test]
fn free_motion_keeps_its_energy() {
    for mut case in Geared::many() {
        for row in &mut case.parameters {
            row[column::VISCOUS..].fill(0.0);
        }
        let n = case.n();
        let still = vec![0.0; n];
        let rate = |x: &[f64]| {
            let mut qdd = vec![0.0; n];
            let (q, qd) = x.split_at(n);
            forward_dynamics(&case.chain, &case.parameters, q, qd, &still, &mut qdd).unwrap();
            [qd, &qdd].concat()
        };
        let energy = |x: &[f64]| {
            let (q, qd) = x.split_at(n);
            kinetic_energy(&case.chain, &case.parameters, q, qd).unwrap()
                + potential_energy(&case.chain, &case.parameters, q).unwrap()
        };
        // A slow start: fast light links need shorter steps.
        let slow: Vec<f64> = case.qd.iter().map(|x| 0.3 * x).collect();
        let mut x = [case.q.clone(), slow].concat();
        let (before, h) = (energy(&x), 1e-4);
        let mut largest = before.abs();
        for _ in 0..2000 {
            let a = rate(&x);
            let b = rate(&moved(&x, &a, 0.5 * h));
            let c = rate(&moved(&x, &b, 0.5 * h));
            let d = rate(&moved(&x, &c, h));
            for (k, x) in x.iter_mut().enumerate() {
                *x += h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
            }
            let (q, qd) = x.split_at(n);
            let kinetic = kinetic_energy(&case.chain, &case.parameters, q, qd).unwrap();
            largest = largest.max(kinetic);
        }
        let off = (energy(&x) - before).abs() / largest;
        assert!(off < 1e-8, "{off:e}");
    }
}

/// Gradients and Jacobians against difference quotients, poses against those of the chain of all axes.
#[test]
fn gradients_and_jacobians_are_slopes() {
    for case in Geared::many() {
        let (n, width) = (case.n(), case.chain.parameter_count());
        // The sign of a velocity counts as constant, but not in a difference quotient next to rest.
        let smooth = |k: usize| k % COLUMNS != column::COULOMB;
        let weights: Vec<f64> = (0..n * width)
            .map(|k| f64::from(u8::from(smooth(k))) * (1.7 * k as f64).sin())
            .collect();
        let sum = |q: &[f64], qd: &[f64], qdd: &[f64]| {
            let mut regressor = vec![0.0; n * width];
            differential_regressor(&case.chain, q, qd, qdd, &mut regressor).unwrap();
            regressor
                .iter()
                .zip(&weights)
                .map(|(a, b)| a * b)
                .sum::<f64>()
        };
        let [mut a, mut b, mut c] = [(); 3].map(|()| vec![0.0; n]);
        let (q, qd, qdd) = (&case.q, &case.qd, &case.qdd);
        regressor_gradient(&case.chain, q, qd, qdd, &weights, &mut a, &mut b, &mut c).unwrap();
        let of =
            |f: &dyn Fn(&[f64]) -> f64| -> Vec<f64> { (0..n).map(|k| f(&unit(n, k))).collect() };
        let by_q = of(&|e| slope(|h| sum(&moved(q, e, h), qd, qdd), 1e-3));
        let by_qd = of(&|e| slope(|h| sum(q, &moved(qd, e, h), qdd), 1e-3));
        let by_qdd = of(&|e| slope(|h| sum(q, qd, &moved(qdd, e, h)), 1e-3));
        assert!(relative_difference(&a, &by_q) < 1e-8);
        assert!(relative_difference(&b, &by_qd) < 1e-8);
        assert!(relative_difference(&c, &by_qdd) < 1e-8);

        let link = case.chain.last_link();
        let axis = case.all.n() - 1;
        let point = [0.2, -0.1, 0.3];
        let mut jacobian = vec![[0.0; 3]; n];
        let place = point_position(&case.chain, q, link, point, &mut jacobian).unwrap();
        let mut own = vec![[0.0; 3]; axis + 1];
        let there = case.position(q);
        let same = point_position(&case.all.chain(), &there, axis, point, &mut own).unwrap();
        assert!(relative_difference(&place, &same) < 1e-13);
        let at = |q: &[f64]| {
            point_position(&case.chain, q, link, point, &mut vec![[0.0; 3]; n]).unwrap()
        };
        for (k, column) in jacobian.iter().enumerate() {
            for x in 0..3 {
                let found = slope(|h| at(&moved(q, &unit(n, k), h))[x], 1e-3);
                assert!((found - column[x]).abs() < 1e-9, "{found} {}", column[x]);
            }
        }
        let fixed = Pose {
            position: point,
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        };
        let mut twists = vec![[0.0; 6]; n];
        let pose = frame_pose(&case.chain, q, link, &fixed, &mut twists).unwrap();
        assert!(relative_difference(&pose.position, &place) < 1e-13);
        for (twist, column) in twists.iter().zip(&jacobian) {
            assert!(relative_difference(&twist[..3], column) < 1e-12);
        }
    }
}

#[test]
fn impossible_followers_are_refused() {
    let all = Sample::random(2, 1);
    let good = Follower {
        geometry: all.geometry[0],
        before: 1,
        master: 0,
        ratio: 0.5,
        offset: 0.0,
    };
    let build = |own: Follower| Chain::<f64>::with_followers(&all.geometry, &[own], all.gravity);
    assert_eq!(build(good).unwrap().link_count(), 3);
    for (own, named) in [
        (Follower { master: 2, ..good }, "master"),
        (Follower { before: 3, ..good }, "before"),
        (Follower { ratio: 0.0, ..good }, "ratio"),
        (
            Follower {
                offset: f64::NAN,
                ..good
            },
            "offset",
        ),
    ] {
        let found = build(own).unwrap_err();
        assert_eq!(
            found,
            ChainError::Follower {
                follower: 0,
                parameter: named
            }
        );
    }
    let many = vec![good; MAX_JOINTS - 1];
    let found = Chain::<f64>::with_followers(&all.geometry, &many, all.gravity).unwrap_err();
    assert_eq!(
        found,
        ChainError::TooManyJoints {
            found: MAX_JOINTS + 1
        }
    );
    // Rows are those of the links.
    let chain = build(good).unwrap();
    let mut tau = [0.0; 2];
    let wrong = inverse_dynamics(&chain, &all.parameters, &all.q, &all.qd, &all.qdd, &mut tau);
    assert!(wrong.is_err());
}

#[test]
fn the_acceleration_at_constant_velocities_is_the_rate_of_the_jacobian() {
    let fixed = Pose {
        position: [0.1, -0.2, 0.3],
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    for (seed, (axes, gears)) in (300..).zip(CASES) {
        let own = Geared::new(axes, gears, seed);
        let n = own.q.len();
        let last = own.chain.last_link();
        let velocity = |at: f64, axis: usize| {
            let mut jacobian = vec![[0.0; 6]; n];
            let q = moved(&own.q, &own.qd, at);
            frame_pose(&own.chain, &q, last, &fixed, &mut jacobian).unwrap();
            let columns = jacobian.iter().zip(&own.qd);
            columns.map(|(column, v)| column[axis] * v).sum::<f64>()
        };
        let found = convective_acceleration(&own.chain, [&own.q, &own.qd], last, &fixed).unwrap();
        for axis in 0..3 {
            let expected = slope(|at| velocity(at, axis), 1e-5);
            let off = (found[axis] - expected).abs();
            assert!(
                off < 1e-5 * (1.0 + expected.abs()),
                "{seed}: {found:?} {expected}"
            );
        }
    }
}
