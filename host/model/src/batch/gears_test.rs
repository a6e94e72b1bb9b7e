//! Batches of chains with followers against the functions of one sample, and derivatives against difference quotients.
#![allow(clippy::unwrap_used)]

use rig_shared::multibody::{
    COLUMNS, Chain, Follower, energy_regressor, forward_dynamics, gravity_vector, inertia_matrix,
    inverse_dynamics,
};

use crate::batch::tests::{Made, made};
use crate::batch::{BLOCK, BatchError, ChainBatch, Derivatives, ModelBatch, Number, lower};

/// A chain of `n` joints with two followers: one behind the first joint, one at the end or before all joints.
fn geared(n: usize, samples: usize, seed: u64, at_end: bool) -> Made {
    let mut all = made(n + 2, samples, seed);
    let axes = all.joints.clone();
    let follower = |axis: usize, before, master, ratio, offset| Follower {
        geometry: axes[axis],
        before,
        master,
        ratio,
        offset,
    };
    let followers = [
        follower(n, 1, 0, -1.0, 0.2),
        follower(n + 1, if at_end { n } else { 0 }, n - 1, 0.5, -0.1),
    ];
    all.joints.truncate(n);
    all.chain = Chain::with_followers(&all.joints, &followers, all.chain.gravity()).unwrap();
    all.signals.iter_mut().for_each(|own| own.truncate(n));
    all
}

fn cases() -> impl Iterator<Item = Made> {
    (0..4).flat_map(|seed| {
        [(1, true), (3, false), (5, true)].map(|(n, at_end)| geared(n, BLOCK + 7, seed, at_end))
    })
}

fn at(columns: &[Vec<f64>], k: usize) -> Vec<f64> {
    columns.iter().map(|column| column[k]).collect()
}

fn rounded<T: Number>(columns: &[Vec<f64>]) -> Vec<Vec<T>> {
    (columns.iter())
        .map(|own| own.iter().map(|x| T::from_f64(*x)).collect())
        .collect()
}

/// Compares a sample of an output with expected values.
fn alike<T: Number>(what: &str, out: &[T], samples: usize, k: usize, expected: &[f64], most: f64) {
    assert_eq!(out.len(), expected.len() * samples, "{what}");
    let scale = expected.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (c, want) in expected.iter().enumerate() {
        let found = out[c * samples + k].to_f64();
        assert!(
            (found - want).abs() <= most * scale,
            "{what} {c}: {found} {want}"
        );
    }
}

fn compare<T: Number>(most: f64) {
    for case in cases() {
        let n = case.joints.len();
        let [q, qd, qdd] = &case.signals;
        let samples = q[0].len();
        let [rq, rqd, rqdd]: [Vec<Vec<T>>; 3] = [q, qd, qdd].map(|own| rounded(own));
        let model = ModelBatch::<T>::new(&case.chain, &case.parameters).unwrap();
        let zero = T::from_f64(0.0);
        let mut tau = vec![zero; n * samples];
        model.inverse_dynamics(&rq, &rqd, &rqdd, &mut tau).unwrap();
        let mut gravity = tau.clone();
        model.gravity(&rq, &mut gravity).unwrap();
        let mut matrix = vec![zero; lower(n, 0) * samples];
        model.inertia_matrix(&rq, &mut matrix).unwrap();
        let mut accelerations = tau.clone();
        let by_joint: Vec<Vec<T>> = tau.chunks(samples).map(<[T]>::to_vec).collect();
        model
            .forward_dynamics(&rq, &rqd, &by_joint, &mut accelerations)
            .unwrap();
        let batch = ChainBatch::<T>::new(&case.chain);
        let width = case.chain.parameter_count();
        let mut energy = vec![zero; width * samples];
        batch.energy_regressor(&rq, &rqd, &mut energy).unwrap();
        let mut block = batch.block(samples);
        batch
            .differential_regressor(&rq, &rqd, &rqdd, &mut block)
            .unwrap();
        for k in (0..samples).step_by(13).chain([samples - 1]) {
            let (q, qd, qdd) = (at(q, k), at(qd, k), at(qdd, k));
            let mut one = vec![0.0; n];
            inverse_dynamics(&case.chain, &case.parameters, &q, &qd, &qdd, &mut one).unwrap();
            alike("torque", &tau, samples, k, &one, most);
            let product: Vec<T> = (0..n)
                .map(|joint| {
                    let flat = case.parameters.as_flattened();
                    let sum = (0..width)
                        .map(|c| block.column(joint, c)[k].to_f64() * flat[c])
                        .sum::<f64>();
                    T::from_f64(sum)
                })
                .collect();
            alike("regressor", &product, 1, 0, &one, most);
            gravity_vector(&case.chain, &case.parameters, &q, &mut one).unwrap();
            alike("gravity", &gravity, samples, k, &one, most);
            let mut square = vec![0.0; n * n];
            inertia_matrix(&case.chain, &case.parameters, &q, &mut square).unwrap();
            let triangle: Vec<f64> = (0..n)
                .flat_map(|i| square[i * n..=i * n + i].to_vec())
                .collect();
            alike("matrix", &matrix, samples, k, &triangle, most);
            alike(
                "acceleration",
                &accelerations,
                samples,
                k,
                &qdd,
                100.0 * most,
            );
            let mut row = vec![0.0; width];
            energy_regressor(&case.chain, &q, &qd, &mut row).unwrap();
            alike("energy", &energy, samples, k, &row, most);
        }
    }
}

#[test]
fn batches_are_the_functions_of_one_sample() {
    compare::<f64>(1e-11);
    compare::<f32>(2e-4);
}

#[test]
fn columns_that_are_zero_are_said_so_and_no_others() {
    for case in cases() {
        let batch = ChainBatch::<f64>::new(&case.chain);
        let mut block = batch.block(BLOCK);
        let [q, qd, qdd] = &case.signals;
        let width = case.chain.parameter_count();
        let mut largest = vec![vec![0.0_f64; width]; case.joints.len()];
        batch
            .each_differential_block(q, qd, qdd, &mut block, |part| {
                for (joint, largest) in largest.iter_mut().enumerate() {
                    for (c, largest) in largest.iter_mut().enumerate() {
                        let column = part.column(joint, c).iter();
                        *largest = column.fold(*largest, |m, x| m.max(x.abs()));
                    }
                }
                Ok::<(), BatchError>(())
            })
            .unwrap();
        for (joint, largest) in largest.iter().enumerate() {
            for (c, largest) in largest.iter().enumerate() {
                if batch.is_zero(joint, c) {
                    assert_eq!(*largest, 0.0, "joint {joint}, column {c}");
                }
            }
            // Own friction, and that of no other joint.
            assert!(largest[joint * COLUMNS + 11] > 0.0);
        }
    }
}

fn difference(of: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let h = 1e-3;
    let [a, b, c, d] = [h, -h, 2.0 * h, -2.0 * h].map(of);
    (0..a.len())
        .map(|i| (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h))
        .collect()
}

#[test]
fn derivatives_are_difference_quotients() {
    for mut case in cases() {
        let n = case.joints.len();
        // Coulomb friction counts as constant; a difference quotient next to rest would not.
        case.parameters.iter_mut().for_each(|row| row[12] = 0.0);
        let [q, qd, qdd] = &case.signals;
        let samples = q[0].len();
        let model = ModelBatch::<f64>::new(&case.chain, &case.parameters).unwrap();
        let square = || vec![0.0; n * n * samples];
        for forward in [false, true] {
            let (mut a, mut b, mut c) = (square(), square(), vec![0.0; lower(n, 0) * samples]);
            let mut out = Derivatives {
                position: &mut a,
                velocity: &mut b,
                input: &mut c,
            };
            if forward {
                model
                    .forward_dynamics_derivatives(q, qd, qdd, &mut out)
                    .unwrap();
            } else {
                model
                    .inverse_dynamics_derivatives(q, qd, qdd, &mut out)
                    .unwrap();
            }
            for k in (0..samples).step_by(31) {
                let state = [at(q, k), at(qd, k), at(qdd, k)];
                let result = |by: usize, joint: usize, h: f64| {
                    let mut moved = state.clone();
                    moved[by][joint] += h;
                    let [q, qd, input] = &moved;
                    let mut out = vec![0.0; n];
                    let function = if forward {
                        forward_dynamics
                    } else {
                        inverse_dynamics
                    };
                    function(&case.chain, &case.parameters, q, qd, input, &mut out).unwrap();
                    out
                };
                for (by, found) in [(0, &a), (1, &b)] {
                    for joint in 0..n {
                        let slope = difference(|h| result(by, joint, h));
                        let size = slope.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
                        for (i, slope) in slope.iter().enumerate() {
                            let own = found[(i * n + joint) * samples + k];
                            let off = (own - slope).abs() / size;
                            assert!(off < 1e-6, "{forward} {by}: {own} {slope}");
                        }
                    }
                }
                for joint in 0..n {
                    let slope = difference(|h| result(2, joint, h));
                    for i in joint..n {
                        let own = c[lower(i, joint) * samples + k];
                        assert!((own - slope[i]).abs() < 1e-7 * (1.0 + slope[i].abs()));
                    }
                }
            }
        }
    }
}
