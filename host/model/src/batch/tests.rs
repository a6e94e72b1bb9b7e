//! Compares the batch with the functions of one sample.
#![allow(clippy::unwrap_used)]

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rig_shared::dual::Dual;
use rig_shared::multibody::block::Lane;
use rig_shared::multibody::{
    COLUMNS, Chain, JointGeometry, JointKind, articulated_forward_dynamics, column,
    differential_regressor, energy_regressor, forward_dynamics, gravity_vector, inertia_matrix,
    inverse_dynamics,
};

use super::{BLOCK, BatchError, ChainBatch, Derivatives, ModelBatch, Number, lower, over_threads};

pub(super) struct Made {
    pub(super) joints: Vec<JointGeometry>,
    pub(super) chain: Chain<f64>,
    pub(super) parameters: Vec<[f64; COLUMNS]>,
    /// q, qd, qdd: columns.
    pub(super) signals: [Vec<Vec<f64>>; 3],
}

/// Makes a random chain with quarter twists and zero lengths, as in real robots, and `samples` of motion.
pub(super) fn made(n: usize, samples: usize, seed: u64) -> Made {
    let mut rng = Pcg64::seed_from_u64(seed * 31 + n as u64);
    let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let joints: Vec<JointGeometry> = (0..n)
        .map(|_| {
            let mut length = || match uniform(0.0, 2.0) {
                x if x < 1.0 => 0.0,
                x => x - 1.5,
            };
            let (a, d) = (length(), length());
            JointGeometry {
                kind: match uniform(0.0, 1.0) {
                    x if x < 0.75 => JointKind::Revolute,
                    _ => JointKind::Prismatic,
                },
                alpha: match uniform(0.0, 5.0) {
                    x if x < 4.0 => std::f64::consts::FRAC_PI_2 * x.floor(),
                    x => (x - 4.5) * 3.0,
                },
                a,
                theta: uniform(-3.0, 3.0),
                d,
            }
        })
        .collect();
    let gravity = [uniform(-9.0, 9.0), uniform(-9.0, 9.0), uniform(-9.0, 9.0)];
    let parameters = (0..n)
        .map(|_| {
            // A box about a point: a body that can exist.
            let m = uniform(0.5, 5.0);
            let c = [uniform(-0.3, 0.3), uniform(-0.3, 0.3), uniform(-0.3, 0.3)];
            let s = [uniform(0.01, 0.2), uniform(0.01, 0.2), uniform(0.01, 0.2)];
            let second = |i: usize, j: usize| c[i] * c[j] + if i == j { s[i] * s[i] } else { 0.0 };
            [
                m,
                m * c[0],
                m * c[1],
                m * c[2],
                m * (second(1, 1) + second(2, 2)),
                -m * second(0, 1),
                -m * second(0, 2),
                m * (second(0, 0) + second(2, 2)),
                -m * second(1, 2),
                m * (second(0, 0) + second(1, 1)),
                uniform(0.0, 0.5),
                uniform(0.0, 2.0),
                uniform(0.0, 2.0),
                uniform(-1.0, 1.0),
            ]
        })
        .collect();
    let mut signal = |range: f64| -> Vec<Vec<f64>> {
        (0..n)
            .map(|_| (0..samples).map(|_| uniform(-range, range)).collect())
            .collect()
    };
    let signals = [signal(3.0), signal(3.0), signal(10.0)];
    Made {
        chain: Chain::new(&joints, gravity).unwrap(),
        joints,
        parameters,
        signals,
    }
}

pub(super) fn at(columns: &[Vec<f64>], k: usize) -> Vec<f64> {
    columns.iter().map(|c| c[k]).collect()
}

/// Compares entry by entry with one row of expected values, relative to the row's largest.
fn compare(what: &str, out: &[f64], samples: usize, k: usize, expected: &[f64], tolerance: f64) {
    let scale = expected.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (c, value) in expected.iter().enumerate() {
        let found = out[c * samples + k];
        assert!(
            (found - value).abs() <= tolerance * scale,
            "{what}, sample {k}, entry {c}: {found} is not {value}"
        );
    }
}

pub(super) const LENGTHS: [usize; 7] = [1, 2, 3, 6, 7, 9, 16];

#[test]
fn every_function_agrees_with_that_of_one_sample() {
    for n in LENGTHS {
        for seed in 0..6 {
            // Full blocks, a part of one, and less than one.
            let count = [2 * BLOCK + 17, BLOCK, 5, 1, 3, 2 * BLOCK][seed as usize];
            let made = made(n, count, seed);
            let (chain, p) = (&made.chain, &made.parameters);
            let [q, qd, qdd] = &made.signals;
            let model = ModelBatch::new(chain, p).unwrap();
            let regressors = ChainBatch::new(chain);
            let mut tau = vec![f64::NAN; n * count];
            model.inverse_dynamics(q, qd, qdd, &mut tau).unwrap();
            let mut gravity = vec![f64::NAN; n * count];
            model.gravity(q, &mut gravity).unwrap();
            let mut inertia = vec![f64::NAN; lower(n, 0) * count];
            model.inertia_matrix(q, &mut inertia).unwrap();
            let torques: Vec<&[f64]> = tau.chunks_exact(count).collect();
            let [q_, qd_] = [q, qd].map(|s| s.iter().map(Vec::as_slice).collect::<Vec<_>>());
            let mut found = vec![f64::NAN; n * count];
            model
                .forward_dynamics(&q_, &qd_, &torques, &mut found)
                .unwrap();
            let width = n * COLUMNS;
            let mut energy = vec![f64::NAN; width * count];
            regressors.energy_regressor(q, qd, &mut energy).unwrap();
            let mut stored = regressors.block(count);
            regressors
                .differential_regressor(q, qd, qdd, &mut stored)
                .unwrap();
            for k in 0..count {
                let (a, b, c) = (at(q, k), at(qd, k), at(qdd, k));
                let mut row = vec![0.0; n];
                inverse_dynamics(chain, p, &a, &b, &c, &mut row).unwrap();
                compare("torque", &tau, count, k, &row, 1e-13);
                gravity_vector(chain, p, &a, &mut row).unwrap();
                compare("gravity", &gravity, count, k, &row, 1e-13);
                let t: Vec<f64> = torques.iter().map(|c| c[k]).collect();
                forward_dynamics(chain, p, &a, &b, &t, &mut row).unwrap();
                compare("acceleration", &found, count, k, &row, 1e-9);
                let mut square = vec![0.0; n * n];
                inertia_matrix(chain, p, &a, &mut square).unwrap();
                let triangle = triangle(&square, n);
                compare("inertia", &inertia, count, k, &triangle, 1e-13);
                assert_eq!(triangle[lower(n - 1, n / 2)], square[(n - 1) * n + n / 2]);
                let mut line = vec![0.0; width];
                energy_regressor(chain, &a, &b, &mut line).unwrap();
                compare("energy", &energy, count, k, &line, 1e-13);
                let mut wide = vec![0.0; n * width];
                differential_regressor(chain, &a, &b, &c, &mut wide).unwrap();
                let row: Vec<f64> = (0..n * width)
                    .map(|entry| stored.column(entry / width, entry % width)[k])
                    .collect();
                compare("regressor", &row, 1, 0, &wide, 1e-13);
            }
        }
    }
}

/// Dynamics of one sample: chain, parameters, three signals, result.
type Dynamics = fn(
    &Chain<Dual<f64, 1>>,
    &[[Dual<f64, 1>; COLUMNS]],
    &[Dual<f64, 1>],
    &[Dual<f64, 1>],
    &[Dual<f64, 1>],
    &mut [Dual<f64, 1>],
) -> Result<(), rig_shared::multibody::MultibodyError>;

/// Returns the matrix of derivatives by signal `by` of `dynamics`, row by row, by dual numbers.
fn derivatives(dynamics: Dynamics, made: &Made, signals: &[Vec<f64>; 3], by: usize) -> Vec<f64> {
    let n = made.joints.len();
    let chain = Chain::new(&made.joints, made.chain.gravity()).unwrap();
    let parameters: Vec<_> = (made.parameters.iter())
        .map(|row| row.map(Dual::constant))
        .collect();
    let mut matrix = vec![0.0; n * n];
    for j in 0..n {
        let mut input = signals.each_ref().map(|signal| -> Vec<Dual<f64, 1>> {
            signal.iter().map(|x| Dual::constant(*x)).collect()
        });
        input[by][j].derivative = [1.0];
        let mut out = vec![Dual::constant(0.0); n];
        let [a, b, c] = &input;
        dynamics(&chain, &parameters, a, b, c, &mut out).unwrap();
        for (i, value) in out.iter().enumerate() {
            matrix[i * n + j] = value.derivative[0];
        }
    }
    matrix
}

fn triangle(square: &[f64], n: usize) -> Vec<f64> {
    (0..n)
        .flat_map(|i| square[i * n..=i * n + i].to_vec())
        .collect()
}

/// The forward dynamics of the dual numbers are those of articulated bodies: another algorithm than the batch's.
#[test]
fn derivatives_are_those_of_dual_numbers() {
    for n in LENGTHS {
        for (seed, count) in [(10, BLOCK + 5), (11, 3), (12, 32)] {
            let made = made(n, count, seed);
            let [q, qd, input] = &made.signals;
            let model = ModelBatch::new(&made.chain, &made.parameters).unwrap();
            let [mut p, mut v] = [(); 2].map(|()| vec![f64::NAN; n * n * count]);
            let mut u = vec![f64::NAN; lower(n, 0) * count];
            for (dynamics, tolerance) in [
                (inverse_dynamics as Dynamics, 1e-12),
                (articulated_forward_dynamics, 1e-8),
            ] {
                let mut out = Derivatives {
                    position: &mut p,
                    velocity: &mut v,
                    input: &mut u,
                };
                if tolerance < 1e-10 {
                    model
                        .inverse_dynamics_derivatives(q, qd, input, &mut out)
                        .unwrap();
                } else {
                    model
                        .forward_dynamics_derivatives(q, qd, input, &mut out)
                        .unwrap();
                }
                for k in (0..count).step_by(7).chain([count - 1]) {
                    let signals = [at(q, k), at(qd, k), at(input, k)];
                    let of = |by| derivatives(dynamics, &made, &signals, by);
                    compare("by position", &p, count, k, &of(0), tolerance);
                    compare("by velocity", &v, count, k, &of(1), tolerance);
                    compare("by input", &u, count, k, &triangle(&of(2), n), tolerance);
                }
            }
        }
    }
}

#[test]
fn blocks_cover_every_sample_once_and_say_which_columns_are_zero() {
    let count = 3 * BLOCK + 5;
    let made = made(5, count, 1);
    let [q, qd, qdd] = &made.signals;
    let batch = ChainBatch::new(&made.chain);
    let mut block = batch.block(BLOCK);
    let mut next = 0;
    batch
        .each_differential_block(q, qd, qdd, &mut block, |block| {
            assert_eq!(block.start(), next);
            assert!(!block.is_empty());
            for joint in 0..5 {
                for c in 0..5 * COLUMNS {
                    let column = block.column(joint, c);
                    assert_eq!(column.len(), block.len());
                    if batch.is_zero(joint, c) {
                        assert!(column.iter().all(|x| *x == 0.0));
                    }
                }
            }
            next += block.len();
            Ok::<(), BatchError>(())
        })
        .unwrap();
    assert_eq!(next, count);
}

/// A block gives the same numbers if it holds all samples or a few. Earlier contents have no influence.
#[test]
fn a_block_used_again_holds_the_new_samples_alone() {
    let (n, count) = (4, 2 * BLOCK + 5);
    let [long, short] = [(count, 8), (7, 9)].map(|(samples, seed)| made(n, samples, seed).signals);
    let batch = ChainBatch::new(&made(n, 1, 8).chain);
    let mut stored = batch.block(count);
    for signals in [&long, &short, &long] {
        let [q, qd, qdd] = signals;
        batch
            .differential_regressor(q, qd, qdd, &mut stored)
            .unwrap();
        assert_eq!((stored.start(), stored.len()), (0, q[0].len()));
        let mut next = 0;
        batch
            .each_differential_block(q, qd, qdd, &mut batch.block(37), |part| {
                for (joint, c) in
                    (0..n * n * COLUMNS).map(|e| (e / (n * COLUMNS), e % (n * COLUMNS)))
                {
                    assert_eq!(
                        part.column(joint, c),
                        &stored.column(joint, c)[next..next + part.len()],
                        "joint {joint}, column {c}"
                    );
                }
                assert_eq!(part.start(), next);
                next += part.len();
                Ok::<(), BatchError>(())
            })
            .unwrap();
        assert_eq!(next, q[0].len());
    }
}

#[test]
fn threads_change_nothing() {
    let count = 7 * BLOCK + 11;
    let made = made(6, count, 2);
    let model = ModelBatch::new(&made.chain, &made.parameters).unwrap();
    let work = |range: std::ops::Range<usize>| {
        let [q, qd, qdd] = [0, 1, 2].map(|s| {
            made.signals[s]
                .iter()
                .map(|c| &c[range.clone()])
                .collect::<Vec<_>>()
        });
        let mut tau = vec![f64::NAN; 6 * range.len()];
        model.inverse_dynamics(&q, &qd, &qdd, &mut tau).unwrap();
        (range, tau)
    };
    let (_, whole) = work(0..count);
    for threads in [1, 2, 3, 50] {
        let mut next = 0;
        for (range, part) in over_threads(count, threads, work) {
            assert_eq!(range.start, next);
            next = range.end;
            for (joint, column) in part.chunks_exact(range.len()).enumerate() {
                assert_eq!(
                    column,
                    &whole[joint * count + range.start..joint * count + range.end]
                );
            }
        }
        assert_eq!(next, count);
    }
    assert_eq!(over_threads(0, 4, |range| range.len()), [0]);
}

#[test]
fn wrong_shapes_are_named() {
    let made = made(2, 10, 3);
    let [q, qd, qdd] = &made.signals;
    let model = ModelBatch::new(&made.chain, &made.parameters).unwrap();
    let mut out = vec![0.0; 20];
    assert_eq!(
        model.inverse_dynamics(q, &qd[..1], qdd, &mut out),
        Err(BatchError::WrongColumns {
            argument: "qd",
            expected: 2,
            found: 1
        })
    );
    let short = vec![qdd[0].clone(), vec![0.0; 9]];
    assert_eq!(
        model.inverse_dynamics(q, qd, &short, &mut out),
        Err(BatchError::WrongSamples {
            argument: "qdd",
            joint: 1,
            expected: 10,
            found: 9
        })
    );
    assert_eq!(
        model.inertia_matrix(q, &mut out),
        Err(BatchError::WrongOutput {
            columns: 3,
            samples: 10,
            found: 20
        })
    );
    let batch = ChainBatch::new(&made.chain);
    let mut block = batch.block(9);
    assert_eq!(
        batch.differential_regressor(q, qd, qdd, &mut block),
        Err(BatchError::SmallBlock {
            room: 9,
            samples: 10
        })
    );
    let mut nothing = batch.block(0);
    assert_eq!(
        batch.each_differential_block(q, qd, qdd, &mut nothing, |_| Ok::<(), BatchError>(())),
        Err(BatchError::SmallBlock {
            room: 0,
            samples: 10
        })
    );
    let other = ChainBatch::new(&self::made(3, 1, 3).chain);
    assert_eq!(
        batch.differential_regressor(q, qd, qdd, &mut other.block(10)),
        Err(BatchError::WrongBlock {
            expected: 2,
            found: 3
        })
    );
    assert!(matches!(
        ModelBatch::<f64>::new(&made.chain, &made.parameters[..1]),
        Err(BatchError::Multibody(_))
    ));
}

#[test]
fn the_first_sample_whose_inertia_matrix_is_not_positive_definite_is_named() {
    let count = 2 * BLOCK;
    let made = made(3, count, 4);
    let [mut q, qd, tau] = made.signals;
    let model = ModelBatch::new(&made.chain, &made.parameters).unwrap();
    let mut out = vec![0.0; 3 * count];
    model.forward_dynamics(&q, &qd, &tau, &mut out).unwrap();
    q[2][BLOCK + 9] = f64::NAN;
    q[2][BLOCK + 30] = f64::NAN;
    assert!(matches!(
        model.forward_dynamics(&q, &qd, &tau, &mut out),
        Err(BatchError::NotPositiveDefinite { sample, .. }) if sample == BLOCK + 9
    ));
}

/// Compares entry by entry with the portable version, relative to the largest.
fn alike<T: Number>(what: &str, chosen: &[T], portable: &[T], tolerance: f64) {
    let [chosen, portable] =
        [chosen, portable].map(|x| x.iter().map(|x| x.to_f64()).collect::<Vec<_>>());
    let scale = portable.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    assert_eq!(chosen.len(), portable.len());
    for (k, (a, b)) in chosen.iter().zip(&portable).enumerate() {
        assert!(
            (a - b).abs() <= tolerance * scale,
            "{what}, entry {k}: {a} is not {b}"
        );
    }
}

fn flat<T: Number>(lanes: &[Lane<T>]) -> Vec<T> {
    lanes.iter().flat_map(|lane| lane.0).collect()
}

/// The version for this machine may leave products unrounded. It has no other difference to the portable one.
#[test]
fn every_version_gives_the_same_results_but_for_rounding() {
    versions_agree::<f64>(0.0, 1e-13, 1e-9, 1e-8);
    // As many units in the last place. Larger drives, for with the inertia matrices of the others no digit would be left.
    versions_agree::<f32>(10.0, 5e-5, 1e-3, 1e-2);
}

/// With `drive` added to the inertia of every drive; tolerances of torques, accelerations and the derivatives of those.
fn versions_agree<T: Number>(drive: f64, close: f64, solved: f64, inverted: f64) {
    use super::dispatch::portable;
    use super::signals::{lanes, load};
    use rig_shared::multibody::block::{
        AxisBlock, Body, CompositeBlock, DerivativeBlock, Frame, JointBlock, LANES,
        derivative_buffers,
    };
    for n in LENGTHS {
        let mut made = made(n, LANES, 7);
        for row in &mut made.parameters {
            row[column::DRIVE_INERTIA] += drive;
        }
        let frames: Vec<Frame<T>> = Frame::of(&made.chain).collect();
        let mut bodies = vec![Body::NOTHING; n];
        Body::gather(&made.chain, &made.parameters, &mut bodies);
        let g = made.chain.gravity().map(T::from_f64);
        let [q, qd, qdd] = made.signals.each_ref().map(|columns| {
            let columns: Vec<Vec<T>> = (columns.iter())
                .map(|c| c.iter().map(|x| T::from_f64(*x)).collect())
                .collect();
            let mut block = lanes(n);
            load(&columns, &(0..LANES), &mut block);
            block
        });
        let mut work = vec![JointBlock::ZERO; n];
        let [mut a, mut b] = [(); 2].map(|()| lanes(n));
        T::inverse_dynamics(&frames, g, &bodies, &q, &qd, Some(&qdd), &mut work, &mut a);
        portable::inverse_dynamics(&frames, g, &bodies, &q, &qd, Some(&qdd), &mut work, &mut b);
        alike("torque", &flat(&a), &flat(&b), close);
        let tau = a;
        let mut room = CompositeBlock::ZERO;
        let [mut a, mut b] = [(); 2].map(|()| vec![T::from_f64(f64::NAN); lower(n, 0) * LANES]);
        T::inertia_matrix(&frames, &bodies, &q, &mut work, &mut room, &mut a, LANES, 0);
        portable::inertia_matrix(&frames, &bodies, &q, &mut work, &mut room, &mut b, LANES, 0);
        alike("inertia", &a, &b, close);
        let [mut ma, mut mb] = [(); 2].map(|()| lanes(lower(n, 0)));
        let [mut a, mut b] = [(); 2].map(|()| lanes(n));
        T::forward_dynamics(
            &frames, g, &bodies, &q, &qd, &tau, &mut work, &mut room, &mut ma, &mut a,
        )
        .unwrap();
        portable::forward_dynamics(
            &frames, g, &bodies, &q, &qd, &tau, &mut work, &mut room, &mut mb, &mut b,
        )
        .unwrap();
        alike("acceleration", &flat(&a), &flat(&b), solved);
        let mut turns = vec![DerivativeBlock::ZERO; n];
        let mut buffer = lanes(derivative_buffers(n));
        let out = || {
            [n * n, n * n, lower(n, 0)].map(|columns| vec![T::from_f64(f64::NAN); columns * LANES])
        };
        let [mut a, mut b] = [out(), out()];
        let [ma, mb] = [&mut a, &mut b].map(|out| out.each_mut().map(Vec::as_mut_slice));
        let motion = [&q[..], &qd, &qdd];
        T::inverse_dynamics_derivatives(&frames, g, &bodies, motion, &mut turns, ma, LANES, 0);
        portable::inverse_dynamics_derivatives(
            &frames, g, &bodies, motion, &mut turns, mb, LANES, 0,
        );
        for (a, b) in a.iter().zip(&b) {
            alike("derivatives of torques", a, b, close);
        }
        let [ma, mb] = [&mut a, &mut b].map(|out| out.each_mut().map(Vec::as_mut_slice));
        let loaded = [&q[..], &qd, &tau];
        T::forward_dynamics_derivatives(
            &frames,
            g,
            &bodies,
            loaded,
            &mut work,
            &mut room,
            &mut turns,
            &mut buffer,
            ma,
            LANES,
            0,
        )
        .unwrap();
        portable::forward_dynamics_derivatives(
            &frames,
            g,
            &bodies,
            loaded,
            &mut work,
            &mut room,
            &mut turns,
            &mut buffer,
            mb,
            LANES,
            0,
        )
        .unwrap();
        for (a, b) in a.iter().zip(&b) {
            alike("derivatives of accelerations", a, b, inverted);
        }
        let width = n * COLUMNS;
        let mut axes = vec![AxisBlock::ZERO; n];
        let [mut a, mut b] = [(); 2].map(|()| vec![T::ZERO; n * width * LANES]);
        T::differential_regressor(&frames, g, &q, &qd, &qdd, &mut axes, &mut a, LANES, 0);
        portable::differential_regressor(&frames, g, &q, &qd, &qdd, &mut axes, &mut b, LANES, 0);
        alike("regressor", &a, &b, close);
        let [mut a, mut b] = [(); 2].map(|()| vec![T::ZERO; width * LANES]);
        T::energy_regressor(&frames, g, &q, &qd, &mut a, LANES, 0);
        portable::energy_regressor(&frames, g, &q, &qd, &mut b, LANES, 0);
        alike("energy", &a, &b, close);
    }
}

/// Beyond the range of the vectorised sine the batch uses the slow path and stays correct.
#[test]
fn angles_of_many_turns_are_as_right_as_small_ones() {
    let mut made = made(6, 40, 5);
    for (k, x) in made.signals[0][2].iter_mut().enumerate() {
        *x += 1.0e7 * k as f64;
    }
    let [q, qd, qdd] = &made.signals;
    let model = ModelBatch::new(&made.chain, &made.parameters).unwrap();
    let mut tau = vec![f64::NAN; 6 * 40];
    model.inverse_dynamics(q, qd, qdd, &mut tau).unwrap();
    for k in 0..40 {
        let mut row = vec![0.0; 6];
        let (a, b, c) = (at(q, k), at(qd, k), at(qdd, k));
        inverse_dynamics(&made.chain, &made.parameters, &a, &b, &c, &mut row).unwrap();
        compare("torque", &tau, 40, k, &row, 1e-13);
    }
}

/// FNV-1a of the bits.
fn hash(numbers: &[f64]) -> u64 {
    numbers
        .iter()
        .flat_map(|x| x.to_bits().to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}

/// The portable version rounds every operation, so its bits are the same on every machine. They were stored when the
/// kernels knew `f64` alone; whoever changes the order of operations stores them again.
#[test]
fn the_portable_version_gives_the_stored_bits() {
    use super::dispatch::portable;
    use super::signals::{lanes, load};
    use rig_shared::multibody::block::{
        AxisBlock, Body, CompositeBlock, DerivativeBlock, Frame, JointBlock, LANES,
        derivative_buffers,
    };
    let mut found = [0; 7];
    for n in LENGTHS {
        let made = made(n, LANES, 21);
        let frames: Vec<Frame<f64>> = Frame::of(&made.chain).collect();
        let g = made.chain.gravity();
        let mut bodies = vec![Body::NOTHING; n];
        Body::gather(&made.chain, &made.parameters, &mut bodies);
        let [q, qd, qdd] = made.signals.each_ref().map(|columns| {
            let mut block = lanes(n);
            load(columns, &(0..LANES), &mut block);
            block
        });
        let mut work = vec![JointBlock::ZERO; n];
        let mut room = CompositeBlock::ZERO;
        let [mut tau, mut acceleration] = [(); 2].map(|()| lanes(n));
        let mut matrix = lanes(lower(n, 0));
        let mut turns = vec![DerivativeBlock::ZERO; n];
        let mut axes = vec![AxisBlock::ZERO; n];
        let mut buffer = lanes(derivative_buffers(n));
        let width = n * COLUMNS;
        let mut inertia = vec![0.0; lower(n, 0) * LANES];
        let mut wide = vec![0.0; n * width * LANES];
        let mut row = vec![0.0; width * LANES];
        portable::inverse_dynamics(
            &frames,
            g,
            &bodies,
            &q,
            &qd,
            Some(&qdd),
            &mut work,
            &mut tau,
        );
        portable::inertia_matrix(
            &frames,
            &bodies,
            &q,
            &mut work,
            &mut room,
            &mut inertia,
            LANES,
            0,
        );
        portable::forward_dynamics(
            &frames,
            g,
            &bodies,
            &q,
            &qd,
            &tau,
            &mut work,
            &mut room,
            &mut matrix,
            &mut acceleration,
        )
        .unwrap();
        portable::differential_regressor(&frames, g, &q, &qd, &qdd, &mut axes, &mut wide, LANES, 0);
        portable::energy_regressor(&frames, g, &q, &qd, &mut row, LANES, 0);
        let out = || [n * n, n * n, lower(n, 0)].map(|columns| vec![0.0; columns * LANES]);
        let [mut torques, mut accelerations] = [out(), out()];
        portable::inverse_dynamics_derivatives(
            &frames,
            g,
            &bodies,
            [&q, &qd, &qdd],
            &mut turns,
            torques.each_mut().map(Vec::as_mut_slice),
            LANES,
            0,
        );
        portable::forward_dynamics_derivatives(
            &frames,
            g,
            &bodies,
            [&q, &qd, &tau],
            &mut work,
            &mut room,
            &mut turns,
            &mut buffer,
            accelerations.each_mut().map(Vec::as_mut_slice),
            LANES,
            0,
        )
        .unwrap();
        let results = [
            flat(&tau),
            inertia,
            flat(&acceleration),
            wide,
            row,
            torques.concat(),
            accelerations.concat(),
        ];
        for (found, result) in found.iter_mut().zip(&results) {
            *found ^= hash(result).rotate_left(n as u32);
        }
    }
    let stored = [
        0x85f0_a484_0aef_d671,
        0xacea_ec25_16cc_1204,
        0x69e3_fe72_56d8_76ed,
        0xbe8f_af84_b785_8cd0,
        0x07a8_0a5d_3ee6_ae03,
        0x089f_75f7_ab17_203d,
        0x123f_791c_7a0b_ab86,
    ];
    assert_eq!(found, stored);
}
