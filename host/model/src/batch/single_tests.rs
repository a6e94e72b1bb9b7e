//! Compares the batches of `f32` with those of `f64`.
//!
//! Signals and parameters are rounded to `f32` first, and both compute with the rounded signals: what remains is the
//! rounding of the computation.
#![allow(clippy::unwrap_used)]

use rig_shared::lanes::Element;
use rig_shared::multibody::{COLUMNS, Chain};

use super::tests::{LENGTHS, Made, at, made};
use super::{BLOCK, BatchError, ChainBatch, Derivatives, ModelBatch, Number, lower};

#[path = "../../benches/arms/mod.rs"]
mod arms;

/// Unit roundoff of `f32`.
const UNIT: f64 = 0.5 * f32::EPSILON as f64;

/// A link adds some 40 rounded operations that follow one another outwards and back, and each may err by a unit
/// roundoff of a term as large as the result. Such errors rarely all point in one direction.
fn tolerance(n: usize) -> f64 {
    10.0 * n as f64 * UNIT
}

fn rounded(columns: &[Vec<f64>]) -> Vec<Vec<f32>> {
    (columns.iter())
        .map(|column| column.iter().map(|x| *x as f32).collect())
        .collect()
}

fn widened(columns: &[Vec<f32>]) -> Vec<Vec<f64>> {
    (columns.iter())
        .map(|column| column.iter().map(|x| f64::from(*x)).collect())
        .collect()
}

/// A chain with a motion and the number of its samples.
struct Case {
    chain: Chain<f64>,
    parameters: Vec<[f64; COLUMNS]>,
    signals: [Vec<Vec<f32>>; 3],
    samples: usize,
}

/// Real arms, and random chains with prismatic joints among them; full blocks, a part of one, and less than one.
fn cases() -> Vec<Case> {
    let samples = |k: usize| [2 * BLOCK + 17, 5, BLOCK][k % 3];
    let mut cases = Vec::new();
    for (k, n) in LENGTHS.into_iter().chain(LENGTHS).enumerate() {
        let samples = samples(k);
        let Made {
            chain,
            parameters,
            signals,
            ..
        } = made(n, samples, 40 + k as u64);
        let signals = signals.each_ref().map(|s| rounded(s));
        cases.push(Case {
            chain,
            parameters,
            signals,
            samples,
        });
    }
    for (k, arm) in [arms::ur5e(), arms::panda()].into_iter().enumerate() {
        let samples = samples(k);
        let motion = made(arm.joints(), samples, 60 + k as u64).signals;
        cases.push(Case {
            chain: arm.chain(),
            signals: motion.each_ref().map(|s| rounded(s)),
            parameters: arm.parameters,
            samples,
        });
    }
    cases
}

/// Columns of three outputs: derivatives by position, velocity, and acceleration or torque.
type Three<T> = [Vec<T>; 3];

/// Every result of the batches.
struct Results<T> {
    torque: Vec<T>,
    gravity: Vec<T>,
    inertia: Vec<T>,
    acceleration: Vec<T>,
    torque_by: Three<T>,
    acceleration_by: Three<T>,
    regressor: Vec<T>,
    energy: Vec<T>,
}

/// The third signal is the acceleration, and the torque under which accelerations are computed.
fn results<T: Number>(case: &Case, [q, qd, input]: [&[Vec<T>]; 3]) -> Results<T> {
    let (n, samples) = (case.chain.joint_count(), case.samples);
    let columns = |count: usize| vec![T::ZERO; count * samples];
    let three = || [columns(n * n), columns(n * n), columns(lower(n, 0))];
    let model = ModelBatch::<T>::new(&case.chain, &case.parameters).unwrap();
    let chain = ChainBatch::<T>::new(&case.chain);
    let mut out = Results {
        torque: columns(n),
        gravity: columns(n),
        inertia: columns(lower(n, 0)),
        acceleration: columns(n),
        torque_by: three(),
        acceleration_by: three(),
        regressor: Vec::new(),
        energy: columns(n * COLUMNS),
    };
    model
        .inverse_dynamics(q, qd, input, &mut out.torque)
        .unwrap();
    model.gravity(q, &mut out.gravity).unwrap();
    model.inertia_matrix(q, &mut out.inertia).unwrap();
    model
        .forward_dynamics(q, qd, input, &mut out.acceleration)
        .unwrap();
    let [position, velocity, by] = &mut out.torque_by;
    let mut derivatives = Derivatives {
        position,
        velocity,
        input: by,
    };
    model
        .inverse_dynamics_derivatives(q, qd, input, &mut derivatives)
        .unwrap();
    let [position, velocity, by] = &mut out.acceleration_by;
    let mut derivatives = Derivatives {
        position,
        velocity,
        input: by,
    };
    model
        .forward_dynamics_derivatives(q, qd, input, &mut derivatives)
        .unwrap();
    let mut block = chain.block(samples);
    chain
        .differential_regressor(q, qd, input, &mut block)
        .unwrap();
    for entry in 0..n * n * COLUMNS {
        let (joint, c) = (entry / (n * COLUMNS), entry % (n * COLUMNS));
        out.regressor.extend_from_slice(block.column(joint, c));
    }
    chain.energy_regressor(q, qd, &mut out.energy).unwrap();
    out
}

/// One sample of columns, in `f64`.
fn row<T: Element>(columns: &[T], samples: usize, k: usize) -> Vec<f64> {
    columns
        .iter()
        .skip(k)
        .step_by(samples)
        .map(|x| x.to_f64())
        .collect()
}

/// Returns the largest difference of a sample, relative to the largest entry of all samples: terms of a motion that
/// cancel each other leave their rounding.
fn differences(found: &[f32], expected: &[f64], samples: usize) -> impl Iterator<Item = f64> {
    let scale = expected.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    (0..samples).map(move |k| {
        let (found, expected) = (row(found, samples, k), row(expected, samples, k));
        (found.iter().zip(&expected))
            .map(|(a, b)| (a - b).abs() / scale)
            .fold(0.0, f64::max)
    })
}

#[test]
fn single_precision_agrees_with_double_but_for_rounding() {
    for case in cases() {
        let (n, samples) = (case.chain.joint_count(), case.samples);
        let wide = case.signals.each_ref().map(|s| widened(s));
        let single = results(&case, case.signals.each_ref().map(Vec::as_slice));
        let double = results(&case, wide.each_ref().map(Vec::as_slice));
        for (what, a, b) in [
            ("torque", &single.torque, &double.torque),
            ("gravity", &single.gravity, &double.gravity),
            ("inertia", &single.inertia, &double.inertia),
            ("torque by q", &single.torque_by[0], &double.torque_by[0]),
            ("torque by qd", &single.torque_by[1], &double.torque_by[1]),
            ("torque by qdd", &single.torque_by[2], &double.torque_by[2]),
            ("regressor", &single.regressor, &double.regressor),
            ("energy", &single.energy, &double.energy),
        ] {
            for (k, error) in differences(a, b, samples).enumerate() {
                assert!(
                    error <= tolerance(n),
                    "{what}, {n} joints, sample {k}: {error:e}"
                );
            }
        }
    }
}

/// Returns the symmetric matrix of a lower triangle.
fn symmetric(triangle: &[f64], n: usize) -> Vec<f64> {
    (0..n * n)
        .map(|e| triangle[lower((e / n).max(e % n), (e / n).min(e % n))])
        .collect()
}

/// Returns the product of two matrices of n rows, and that of their absolute values.
fn product(a: &[f64], b: &[f64], n: usize) -> [Vec<f64>; 2] {
    let width = b.len() / n;
    let of = |f: fn(f64) -> f64| {
        (0..b.len())
            .map(|e| {
                (0..n)
                    .map(|j| f(a[e / width * n + j]) * f(b[j * width + e % width]))
                    .sum()
            })
            .collect()
    };
    [of(|x| x), of(f64::abs)]
}

/// An ill-conditioned inertia matrix A magnifies the rounding of accelerations, so these are judged by what they say
/// of the torques: a solution of A·x = b by factorisation leaves b − A·x of the size of the rounding of |A|·|x|, one by
/// the inverse of the size of that of |A|·|A⁻¹|·|b| (Higham 2002, ch. 10 and 14).
#[test]
fn accelerations_of_single_precision_leave_residuals_of_rounding() {
    for case in cases() {
        let (n, samples) = (case.chain.joint_count(), case.samples);
        let [q, qd, tau] = case.signals.each_ref().map(Vec::as_slice);
        let single = results(&case, [q, qd, tau]);
        let found: Vec<Vec<f32>> = single
            .acceleration
            .chunks_exact(samples)
            .map(<[f32]>::to_vec)
            .collect();
        let [q, qd, tau, found] = [q, qd, tau, &found].map(widened);
        let moved = results(&case, [&q, &qd, &found]);
        for k in 0..samples {
            let inertia = symmetric(&row(&moved.inertia, samples, k), n);
            let judge = |what: &str, residual: &[f64], size: &[f64]| {
                let size = size.iter().fold(1.0, |m: f64, x| m.max(*x));
                let error = residual.iter().fold(0.0, |m: f64, x| m.max(x.abs())) / size;
                assert!(
                    error <= tolerance(n),
                    "{what}, {n} joints, sample {k}: {error:e}"
                );
            };
            let (asked, given) = (at(&tau, k), row(&moved.torque, samples, k));
            let residual: Vec<f64> = asked.iter().zip(&given).map(|(a, b)| a - b).collect();
            let [_, mut size] = product(&inertia, &at(&found, k), n);
            size.extend(asked.iter().chain(&given).map(|x| x.abs()));
            judge("acceleration", &residual, &size);

            let [by_q, by_qd, by_tau] = single
                .acceleration_by
                .each_ref()
                .map(|out| row(out, samples, k));
            let inverse = symmetric(&by_tau, n);
            let [mut residual, size] = product(&inertia, &inverse, n);
            for i in 0..n {
                residual[i * n + i] -= 1.0;
            }
            judge("acceleration by tau", &residual, &size);
            for (what, x, torques) in [
                ("acceleration by q", &by_q, &moved.torque_by[0]),
                ("acceleration by qd", &by_qd, &moved.torque_by[1]),
            ] {
                // These bring their own rounding, relative to all samples.
                let largest = torques.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                let torques = row(torques, samples, k);
                let [moved, _] = product(&inertia, x, n);
                let residual: Vec<f64> = moved.iter().zip(&torques).map(|(a, b)| a + b).collect();
                let [_, size] = product(&inverse, &torques, n);
                let [_, mut size] = product(&inertia, &size, n);
                size.push(largest);
                judge(what, &residual, &size);
            }
        }
    }
}

/// Beyond the range of the vectorised sine the batch uses the slow path: the sine of the rounded sum of angles.
#[test]
fn angles_of_many_turns_are_as_right_as_small_ones_in_single_precision() {
    let arm = arms::panda();
    let mut signals = made(7, 40, 5).signals.each_ref().map(|s| rounded(s));
    for (k, x) in signals[0][2].iter_mut().enumerate() {
        *x += 1.0e3 * k as f32;
    }
    let case = Case {
        chain: arm.chain(),
        parameters: arm.parameters,
        signals,
        samples: 40,
    };
    let wide = case.signals.each_ref().map(|s| widened(s));
    let single = results(&case, case.signals.each_ref().map(Vec::as_slice));
    let double = results(&case, wide.each_ref().map(Vec::as_slice));
    for (k, error) in differences(&single.torque, &double.torque, 40).enumerate() {
        assert!(error <= tolerance(7), "sample {k}: {error:e}");
    }
}

#[test]
fn errors_are_those_of_double_precision() {
    let case = &mut cases()[3];
    let n = case.chain.joint_count();
    let model = ModelBatch::<f32>::new(&case.chain, &case.parameters).unwrap();
    let [q, qd, tau] = &mut case.signals;
    let mut short = vec![0.0; 1];
    assert_eq!(
        model.gravity(q, &mut short),
        Err(BatchError::WrongOutput {
            columns: n,
            samples: case.samples,
            found: 1
        })
    );
    q[n - 1][BLOCK + 9] = f32::NAN;
    let mut out = vec![0.0; n * case.samples];
    assert!(matches!(
        model.forward_dynamics(q, qd, tau, &mut out),
        Err(BatchError::NotPositiveDefinite { sample, .. }) if sample == BLOCK + 9
    ));
}
