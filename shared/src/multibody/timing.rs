//! Time of a call, printed and never asserted: `cargo test -p rig-shared --release multibody::timing -- --ignored --nocapture`.
#![allow(clippy::unwrap_used)]

use core::hint::black_box;
use std::time::Instant;
use std::vec;
use std::vec::Vec;
use std::{print, println};

use super::samples::Sample;
use super::*;

fn nanoseconds(mut call: impl FnMut()) -> f64 {
    const CALLS: u32 = 100_000;
    // The minimum of several runs: other load on the machine can only add time.
    (0..7)
        .map(|_| {
            let start = Instant::now();
            for _ in 0..CALLS {
                call();
            }
            start.elapsed().as_secs_f64() * 1e9 / f64::from(CALLS)
        })
        .fold(f64::INFINITY, f64::min)
}

fn print_times<T: crate::scalar::Real>(name: &str, n: usize) {
    let s = Sample::random(n, 11);
    let mut geometry = s.geometry.clone();
    for joint in &mut geometry {
        joint.kind = JointKind::Revolute;
    }
    let chain = Chain::<T>::new(&geometry, s.gravity).unwrap();
    let convert = |v: &[f64]| v.iter().map(|&x| T::from_f64(x)).collect::<Vec<T>>();
    let (q, qd, qdd) = (convert(&s.q), convert(&s.qd), convert(&s.qdd));
    let p: Vec<[T; COLUMNS]> = s.parameters.iter().map(|r| r.map(T::from_f64)).collect();
    let mut wide = vec![T::ZERO; n * n * COLUMNS];
    let mut row = vec![T::ZERO; n * COLUMNS];
    let mut square = vec![T::ZERO; n * n];
    let mut vector = vec![T::ZERO; n];
    print!("{name} n = {n}:");
    let show = |what: &str, call: &mut dyn FnMut()| {
        print!(" {what} {:.0} ns;", nanoseconds(call));
    };
    show("regressor", &mut || {
        differential_regressor(&chain, black_box(&q), &qd, &qdd, black_box(&mut wide)).unwrap();
    });
    show("inverse", &mut || {
        inverse_dynamics(&chain, &p, black_box(&q), &qd, &qdd, black_box(&mut vector)).unwrap();
    });
    show("energy", &mut || {
        energy_regressor(&chain, black_box(&q), &qd, black_box(&mut row)).unwrap();
    });
    show("inertia", &mut || {
        inertia_matrix(&chain, &p, black_box(&q), black_box(&mut square)).unwrap();
    });
    show("coriolis", &mut || {
        coriolis_matrix(&chain, &p, black_box(&q), &qd, black_box(&mut square)).unwrap();
    });
    show("forward", &mut || {
        forward_dynamics(&chain, &p, black_box(&q), &qd, &qdd, black_box(&mut vector)).unwrap();
    });
    println!();
}

#[test]
#[ignore = "prints times, asserts nothing"]
fn nanoseconds_per_call() {
    for n in [1, 6] {
        print_times::<f64>("f64", n);
        print_times::<f32>("f32", n);
    }
}
