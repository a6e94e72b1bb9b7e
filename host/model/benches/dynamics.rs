//! Nanoseconds a sample of the model mathematics, sample by sample and in batches, for arms of six and seven joints.
#![allow(missing_docs, clippy::unwrap_used)]

mod arms;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rig_model::batch::{BLOCK, BatchError, ChainBatch, ModelBatch, Number, lower};
use rig_shared::multibody::{
    COLUMNS, articulated_forward_dynamics, coriolis_matrix, differential_regressor,
    energy_regressor, forward_dynamics, gravity_vector, inertia_matrix, inverse_dynamics,
};

/// Samples of a call of the batch; criterion prints the rate in samples, and the time of the whole call.
const SAMPLES: usize = 1000;

fn scalar(criterion: &mut Criterion) {
    for arm in [arms::ur5e(), arms::panda()] {
        let (chain, n) = (arm.chain(), arm.joints());
        let p = &arm.parameters;
        let [q, qd, qdd] = arms::motion(n, 8).map(|s| s.iter().map(|c| c[5]).collect::<Vec<_>>());
        let mut vector = vec![0.0; n];
        let mut square = vec![0.0; n * n];
        let mut line = vec![0.0; n * COLUMNS];
        let mut wide = vec![0.0; n * n * COLUMNS];
        let mut group = criterion.benchmark_group(format!("one sample, {}", arm.name));
        group.throughput(Throughput::Elements(1));
        group.bench_function("inverse dynamics", |b| {
            b.iter(|| inverse_dynamics(&chain, p, black_box(&q), &qd, &qdd, &mut vector).unwrap());
        });
        group.bench_function("gravity", |b| {
            b.iter(|| gravity_vector(&chain, p, black_box(&q), &mut vector).unwrap());
        });
        group.bench_function("inertia matrix", |b| {
            b.iter(|| inertia_matrix(&chain, p, black_box(&q), &mut square).unwrap());
        });
        group.bench_function("Coriolis matrix", |b| {
            b.iter(|| coriolis_matrix(&chain, p, black_box(&q), &qd, &mut square).unwrap());
        });
        group.bench_function("forward dynamics, composite bodies", |b| {
            b.iter(|| forward_dynamics(&chain, p, black_box(&q), &qd, &qdd, &mut vector).unwrap());
        });
        group.bench_function("forward dynamics, articulated bodies", |b| {
            b.iter(|| {
                articulated_forward_dynamics(&chain, p, black_box(&q), &qd, &qdd, &mut vector)
                    .unwrap()
            });
        });
        group.bench_function("differential regressor", |b| {
            b.iter(|| differential_regressor(&chain, black_box(&q), &qd, &qdd, &mut wide).unwrap());
        });
        group.bench_function("energy regressor", |b| {
            b.iter(|| energy_regressor(&chain, black_box(&q), &qd, &mut line).unwrap());
        });
        group.finish();
    }
}

/// Batches of one number: `f64` or `f32`.
fn batch<T: Number>(criterion: &mut Criterion) {
    let number = std::any::type_name::<T>();
    for arm in [arms::ur5e(), arms::panda()] {
        let n = arm.joints();
        let model = ModelBatch::<T>::new(&arm.chain(), &arm.parameters).unwrap();
        let chain = ChainBatch::<T>::new(&arm.chain());
        let [q, qd, qdd] = arms::motion(n, SAMPLES).map(arms::rounded::<T>);
        let mut out = vec![T::ZERO; n * COLUMNS * SAMPLES];
        let mut group =
            criterion.benchmark_group(format!("{SAMPLES} samples, {}, {number}", arm.name));
        group.throughput(Throughput::Elements(SAMPLES as u64));
        group.bench_function("inverse dynamics", |b| {
            let out = &mut out[..n * SAMPLES];
            b.iter(|| {
                model
                    .inverse_dynamics(black_box(&q), &qd, &qdd, out)
                    .unwrap()
            });
        });
        group.bench_function("gravity", |b| {
            let out = &mut out[..n * SAMPLES];
            b.iter(|| model.gravity(black_box(&q), out).unwrap());
        });
        group.bench_function("inertia matrix", |b| {
            let out = &mut out[..lower(n, 0) * SAMPLES];
            b.iter(|| model.inertia_matrix(black_box(&q), out).unwrap());
        });
        group.bench_function("forward dynamics", |b| {
            let out = &mut out[..n * SAMPLES];
            b.iter(|| {
                model
                    .forward_dynamics(black_box(&q), &qd, &qdd, out)
                    .unwrap()
            });
        });
        let mut stored = chain.block(SAMPLES);
        group.bench_function("differential regressor, stored", |b| {
            b.iter(|| {
                chain
                    .differential_regressor(black_box(&q), &qd, &qdd, &mut stored)
                    .unwrap()
            });
        });
        let mut block = chain.block(BLOCK);
        group.bench_function("differential regressor, block by block", |b| {
            b.iter(|| {
                chain
                    .each_differential_block(black_box(&q), &qd, &qdd, &mut block, |block| {
                        black_box(block.column(0, 0));
                        Ok::<(), BatchError>(())
                    })
                    .unwrap()
            });
        });
        group.bench_function("energy regressor", |b| {
            b.iter(|| {
                chain
                    .energy_regressor(black_box(&q), &qd, &mut out)
                    .unwrap()
            });
        });
        group.finish();
    }
}

criterion_group!(all, scalar, batch::<f64>, batch::<f32>);
criterion_main!(all);
