//! This project's side of `tests/compare_pinocchio`: what to compute, what comes out here, and how long it takes.
//!
//! `cargo bench --bench peer -- write FOLDER` writes the arms, a motion and its results for the other side to check;
//! `cargo bench --bench peer -- times` prints one line a function: arm, function, nanoseconds a sample.
#![allow(missing_docs, clippy::unwrap_used)]

mod arms;

use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use rig_model::batch::{BLOCK, BatchError, ChainBatch, Derivatives, ModelBatch, lower};
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

fn times() {
    for arm in [arms::ur5e(), arms::panda()] {
        let n = arm.joints();
        let model = ModelBatch::new(&arm.chain(), &arm.parameters).unwrap();
        let chain = ChainBatch::new(&arm.chain());
        let [q, qd, qdd] = arms::motion(n, SAMPLES);
        let mut out = vec![0.0; n * n * SAMPLES];
        let small = n * SAMPLES;
        let print = |function: &str, ns: f64| println!("{} {function} {ns:.1}", arm.name);
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
        let [mut position, mut velocity] = [(); 2].map(|()| vec![0.0; n * n * SAMPLES]);
        let mut input = vec![0.0; lower(n, 0) * SAMPLES];
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
        let mut energy = vec![0.0; n * COLUMNS * SAMPLES];
        let rows = nanoseconds(SAMPLES, || {
            chain
                .energy_regressor(black_box(&q), &qd, &mut energy)
                .unwrap();
        });
        print("energy_regressor", rows);
        let [q, qd, qdd] = arms::motion(n, RECORDING);
        let mut stored = chain.block(RECORDING);
        let regressor = nanoseconds(RECORDING, || {
            chain
                .differential_regressor(black_box(&q), &qd, &qdd, &mut stored)
                .unwrap();
        });
        print("regressor_stored", regressor);
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

fn main() {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", folder] => write(Path::new(folder)),
        ["times"] | [] => times(),
        _ => {
            eprintln!("peer: expected 'times' or 'write FOLDER', found {arguments:?}");
            std::process::exit(2);
        }
    }
}
