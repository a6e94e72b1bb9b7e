//! The convex problem on rows without noise, and properties of its solution.

use super::arms::{Chance, arm};
use super::*;
use crate::bodies::consistent::consistent;
use crate::bodies::hints::Hints;
use crate::bodies::prior::Prior;
use crate::bodies::pseudo_inertia::least_eigenvalue;
use crate::bodies::quadratic::{Quadratic, quadratic};
use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{COLUMNS, differential_regressor};

/// Factor of the base columns' rows at random states, with the torques of `pi`.
fn factor(robot: &Robot, base: &Base, pi: &[f64], weight: f64) -> TriangularFactor {
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let mut chance = Chance::new(77);
    let mut all = TriangularFactor::new(base.len());
    let width = n * COLUMNS;
    let mut out = vec![0.0; n * width];
    for _ in 0..60 * n {
        let [q, qd, qdd] =
            [2.0, 2.0, 5.0].map(|s| (0..n).map(|_| s * chance.even()).collect::<Vec<_>>());
        differential_regressor(&chain, &q, &qd, &qdd, &mut out).unwrap();
        for row in out.chunks(width) {
            let tau: f64 = row.iter().zip(pi).map(|(a, b)| a * b).sum();
            let x: Vec<f64> = base.columns.iter().map(|&c| row[c]).collect();
            all.push(&x, tau, weight);
        }
    }
    all
}

fn unknown(robot: &Robot, columns: usize) -> Prior {
    let n = robot.joints.len();
    let mut silent = robot.clone();
    for joint in &mut silent.joints {
        (joint.inertial, joint.friction, joint.drive) = (None, None, None);
    }
    let hints = Hints {
        values: vec![f64::NAN; columns],
        torque: vec![5.0; n],
        speed: vec![1.0; n],
        acceleration: vec![3.0; n],
    };
    Prior::of(&silent, columns, &hints, 1.0)
}

#[test]
fn exact_rows_give_the_exact_combinations_and_bodies_for_the_rest() {
    for n in 1..=7 {
        let robot = arm(n, 40 + n as u64);
        let base = Base::structural(&robot, ModelKind::Differential, 1).unwrap();
        let pi = robot.standard_parameters().concat();
        // Rows of a sensor with a noise of a ten-millionth of a newton metre.
        let rows = factor(&robot, &base, &pi, 1e7);
        let prior = unknown(&robot, base.combination.ncols());
        let found = consistent(&quadratic(&rows, &base), &prior).unwrap();
        let k = &base.combination;
        let truth = k * DVector::from_column_slice(&pi);
        let values = k * DVector::from_vec(found.parameters.clone());
        let worst = (&values - &truth).amax() / truth.amax();
        println!("{n} joints: {worst:.1e} in {} steps", found.steps);
        assert!(worst < 1e-9, "{worst}");
        for link in found.parameters.chunks(COLUMNS) {
            assert!(least_eigenvalue(&link[..10]) > 0.0);
            assert!(link[10..13].iter().all(|x| *x > 0.0));
        }
    }
}

/// Data of impossible links: the solution lies on the boundary of the consistent set, and no admissible direction
/// lowers the objective.
#[test]
fn impossible_data_lead_to_the_nearest_possible_set() {
    for n in 2..=5 {
        let robot = arm(n, 60 + n as u64);
        let base = Base::structural(&robot, ModelKind::Differential, 1).unwrap();
        let columns = base.combination.ncols();
        let mut pi = robot.standard_parameters().concat();
        // The last link's inertia is below what its first moments require; a friction coefficient is negative.
        let last = (n - 1) * COLUMNS;
        for c in [4, 7, 9] {
            pi[last + c] *= 0.2;
        }
        pi[last + 11] = -0.3;
        let rows = factor(&robot, &base, &pi, 20.0);
        let mut prior = unknown(&robot, columns);
        prior.strength = 1e-3;
        let data = quadratic(&rows, &base);
        let found = consistent(&data, &prior).unwrap();
        for link in found.parameters.chunks(COLUMNS) {
            assert!(least_eigenvalue(&link[..10]) > 0.0);
            assert!(link[10..13].iter().all(|x| *x > 0.0));
        }
        assert!(found.squares > 1.0, "{}", found.squares);
        let cost = |pi: &[f64]| cost_of(&data, pi);
        let here = cost(&found.parameters);
        let mut chance = Chance::new(n as u64);
        let other = consistent(
            &Quadratic {
                matrix: DMatrix::zeros(1, columns),
                right: DVector::zeros(1),
            },
            &prior,
        )
        .unwrap()
        .parameters;
        // Mixtures with other consistent sets are consistent (convexity), and none is better by more than the pull.
        for _ in 0..200 {
            let mut mixed = found.parameters.clone();
            for (i, link) in super::arms::bodies(&mut chance, n).iter().enumerate() {
                let share = 0.02 * (1.0 + chance.even());
                for c in 0..COLUMNS {
                    let target = if c < 10 {
                        link[c]
                    } else {
                        other[i * COLUMNS + c]
                    };
                    mixed[i * COLUMNS + c] =
                        (1.0 - share) * mixed[i * COLUMNS + c] + share * target;
                }
            }
            assert!(cost(&mixed) > here - 0.2, "{} {here}", cost(&mixed));
        }
    }
}

fn cost_of(data: &Quadratic, pi: &[f64]) -> f64 {
    (&data.matrix * DVector::from_column_slice(pi) - &data.right).norm_squared()
}
