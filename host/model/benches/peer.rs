//! This project's side of `tests/compare_pinocchio`: what to compute, what comes out here, and how long it takes.
//!
//! `cargo bench --bench peer -- write FOLDER` writes the arms, a motion and its results for the other side to check;
//! `cargo bench --bench peer -- times` prints one line a function: arm, function, nanoseconds a sample.
//! `tests/compare_generated` uses the same two.
//!
//! `cargo bench --bench peer -- rates [THREADS]` prints millions of inverse dynamics a second, in `f64` and `f32`.
#![allow(missing_docs, clippy::unwrap_used)]

mod arms;

use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rig_model::batch::{
    BLOCK, BatchError, ChainBatch, Derivatives, ModelBatch, Number, each_by, lower, over_threads,
};
use rig_shared::multibody::{COLUMNS, column};

/// Samples of a call; the other side walks through as many. Results stay in the cache on both sides.
const SAMPLES: usize = 1000;
/// Samples of a recording, for what is stored in memory.
const RECORDING: usize = 10_000;
/// Motions whose results are compared.
const CHECKED: usize = 64;
/// Columns that both sides know: the inertial ones.
const INERTIAL: usize = column::DRIVE_INERTIA;

/// The least time of many calls, in ns a sample, over a quarter of a second and five calls at least: what else the
/// machine does only ever adds.
fn nanoseconds(samples: usize, mut call: impl FnMut()) -> f64 {
    let begin = Instant::now();
    let mut least = f64::INFINITY;
    let mut calls = 0;
    while calls < 5 || begin.elapsed() < Duration::from_millis(250) {
        calls += 1;
        let start = Instant::now();
        call();
        least = least.min(start.elapsed().as_secs_f64() * 1e9 / samples as f64);
    }
    least
}

/// Least time of each function over `T`, whose name ends with `suffix`.
fn times<T: Number>(suffix: &str) {
    for arm in [arms::ur5e(), arms::panda()] {
        let n = arm.joints();
        let model = ModelBatch::<T>::new(&arm.chain(), &arm.parameters).unwrap();
        let chain = ChainBatch::<T>::new(&arm.chain());
        let [q, qd, qdd] = arms::motion(n, SAMPLES).map(arms::rounded::<T>);
        let mut out = vec![T::ZERO; n * n * SAMPLES];
        let small = n * SAMPLES;
        let print = |function: &str, ns: f64| println!("{} {function}{suffix} {ns:.1}", arm.name);
        let inverse = nanoseconds(SAMPLES, || {
            model
                .inverse_dynamics(black_box(&q), &qd, &qdd, &mut out[..small])
                .unwrap();
        });
        print("inverse_dynamics", inverse);
        let inertia = nanoseconds(SAMPLES, || {
            let triangle = &mut out[..lower(n, 0) * SAMPLES];
            model.inertia_matrix(black_box(&q), triangle).unwrap();
        });
        print("inertia_matrix", inertia);
        let forward = nanoseconds(SAMPLES, || {
            model
                .forward_dynamics(black_box(&q), &qd, &qdd, &mut out[..small])
                .unwrap();
        });
        print("forward_dynamics", forward);
        let [mut position, mut velocity] = [(); 2].map(|()| vec![T::ZERO; n * n * SAMPLES]);
        let mut input = vec![T::ZERO; lower(n, 0) * SAMPLES];
        let mut derivatives = Derivatives {
            position: &mut position,
            velocity: &mut velocity,
            input: &mut input,
        };
        let inverse = nanoseconds(SAMPLES, || {
            model
                .inverse_dynamics_derivatives(black_box(&q), &qd, &qdd, &mut derivatives)
                .unwrap();
        });
        print("inverse_dynamics_derivatives", inverse);
        let forward = nanoseconds(SAMPLES, || {
            model
                .forward_dynamics_derivatives(black_box(&q), &qd, &qdd, &mut derivatives)
                .unwrap();
        });
        print("forward_dynamics_derivatives", forward);
        let mut block = chain.block(BLOCK);
        let regressor = nanoseconds(SAMPLES, || {
            chain
                .each_differential_block(black_box(&q), &qd, &qdd, &mut block, |block| {
                    black_box(block.column(0, 0));
                    Ok::<(), BatchError>(())
                })
                .unwrap();
        });
        print("regressor", regressor);
        let mut energy = vec![T::ZERO; n * COLUMNS * SAMPLES];
        let rows = nanoseconds(SAMPLES, || {
            chain
                .energy_regressor(black_box(&q), &qd, &mut energy)
                .unwrap();
        });
        print("energy_regressor", rows);
        let [q, qd, qdd] = arms::motion(n, RECORDING).map(arms::rounded::<T>);
        let mut stored = chain.block(RECORDING);
        let regressor = nanoseconds(RECORDING, || {
            chain
                .differential_regressor(black_box(&q), &qd, &qdd, &mut stored)
                .unwrap();
        });
        print("regressor_stored", regressor);
    }
}

/// Millions of inverse dynamics a second on `threads` threads.
///
/// Each thread walks through a recording of its own again and again, which stays in its cache; the last column is one
/// recording of a million samples, which comes from memory and goes there.
fn rates<T: Number>(threads: usize) {
    const ROUNDS: usize = 50;
    const LONG: usize = 1_000_000;
    for arm in [arms::ur5e(), arms::panda()] {
        let n = arm.joints();
        let model = ModelBatch::<T>::new(&arm.chain(), &arm.parameters).unwrap();
        let [q, qd, qdd] = arms::motion(n, SAMPLES).map(arms::rounded::<T>);
        let near = nanoseconds(threads * ROUNDS * SAMPLES, || {
            over_threads(threads * BLOCK, threads, |_| {
                let mut out = vec![T::ZERO; n * SAMPLES];
                for _ in 0..ROUNDS {
                    let q = black_box(&q);
                    model.inverse_dynamics(q, &qd, &qdd, &mut out).unwrap();
                }
            });
        });
        let [q, qd, qdd] = arms::motion(n, LONG).map(arms::rounded::<T>);
        let outs: Vec<_> = over_threads(LONG, threads, |range| {
            let columns = range.len();
            (range, Mutex::new(vec![T::ZERO; n * columns]))
        });
        let far = nanoseconds(LONG, || {
            each_by(outs.len(), threads, |part| {
                let (range, out) = &outs[part];
                let [q, qd, qdd] = [&q, &qd, &qdd].map(|signal| {
                    let columns = signal.iter();
                    columns.map(|c| &c[range.clone()]).collect::<Vec<_>>()
                });
                let out = &mut out.lock().unwrap();
                model.inverse_dynamics(&q, &qd, &qdd, out).unwrap();
            });
        });
        let number = std::any::type_name::<T>();
        let [near, far] = [near, far].map(|ns| 1e3 / ns);
        println!(
            "{} {number} {threads} threads: {near:.0} million a second, {far:.0} from memory",
            arm.name
        );
    }
}

/// Numbers of one line.
fn line<'a>(text: &mut String, values: impl IntoIterator<Item = &'a f64>) {
    for value in values {
        write!(text, "{value:e} ").unwrap();
    }
    text.push('\n');
}

fn write(folder: &Path) {
    for arm in [arms::ur5e(), arms::panda()] {
        let n = arm.joints();
        let model = ModelBatch::new(&arm.chain(), &arm.parameters).unwrap();
        let chain = ChainBatch::new(&arm.chain());
        let [q, qd, qdd] = arms::motion(n, CHECKED);
        let mut text = format!("{} {n} {CHECKED}\n", arm.name);
        line(&mut text, &arms::GRAVITY);
        for (g, p) in arm.geometry.iter().zip(&arm.parameters) {
            line(&mut text, &[g.alpha, g.a, g.theta, g.d]);
            line(&mut text, &p[..INERTIAL]);
        }
        let mut tau = vec![0.0; n * CHECKED];
        model.inverse_dynamics(&q, &qd, &qdd, &mut tau).unwrap();
        let mut inertia = vec![0.0; lower(n, 0) * CHECKED];
        model.inertia_matrix(&q, &mut inertia).unwrap();
        let torques: Vec<Vec<f64>> = tau.chunks_exact(CHECKED).map(<[f64]>::to_vec).collect();
        let mut forward = vec![0.0; n * CHECKED];
        model
            .forward_dynamics(&q, &qd, &torques, &mut forward)
            .unwrap();
        let derivatives = |forward: bool| -> [Vec<f64>; 3] {
            let [mut position, mut velocity] = [(); 2].map(|()| vec![0.0; n * n * CHECKED]);
            let mut input = vec![0.0; lower(n, 0) * CHECKED];
            let mut out = Derivatives {
                position: &mut position,
                velocity: &mut velocity,
                input: &mut input,
            };
            let done = if forward {
                model.forward_dynamics_derivatives(&q, &qd, &torques, &mut out)
            } else {
                model.inverse_dynamics_derivatives(&q, &qd, &qdd, &mut out)
            };
            done.unwrap();
            [position, velocity, input]
        };
        let derivatives = [derivatives(false), derivatives(true)];
        let mut matrix = chain.block(CHECKED);
        chain
            .differential_regressor(&q, &qd, &qdd, &mut matrix)
            .unwrap();
        for k in 0..CHECKED {
            for signal in [&q, &qd, &qdd] {
                line(&mut text, signal.iter().map(|c| &c[k]));
            }
            for result in [&tau, &inertia, &forward] {
                line(&mut text, result.iter().skip(k).step_by(CHECKED));
            }
            // The inertia matrix among them is checked already.
            let [[position, velocity, _], forward] = &derivatives;
            for result in [position, velocity].into_iter().chain(forward) {
                line(&mut text, result.iter().skip(k).step_by(CHECKED));
            }
            for joint in 0..n {
                let inertial = (0..n * COLUMNS).filter(|c| c % COLUMNS < INERTIAL);
                line(&mut text, inertial.map(|c| &matrix.column(joint, c)[k]));
            }
        }
        std::fs::write(folder.join(format!("{}.txt", arm.name)), text).unwrap();
    }
}

fn rates_of(threads: usize) {
    rates::<f64>(threads);
    rates::<f32>(threads);
}

fn main() {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", folder] => write(Path::new(folder)),
        ["times"] | [] => {
            times::<f64>("");
            times::<f32>("_f32");
        }
        ["rates"] => rates_of(2),
        ["rates", threads] => rates_of(threads.parse().unwrap()),
        _ => {
            eprintln!(
                "peer: expected 'times', 'rates [THREADS]' or 'write FOLDER', found {arguments:?}"
            );
            std::process::exit(2);
        }
    }
}
