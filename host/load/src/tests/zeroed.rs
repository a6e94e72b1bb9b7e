//! A sensor that drifts and is zeroed in the recording: the bias is a saw tooth.

use super::made::{Moving, Sensor, recorded, tool};
use super::sensor::{NO_FLAW, irp6};
use crate::{LoadOptions, identify_load};

/// Drift over the recording in units of its size, as read.
const DRIFT: [f64; 6] = [1.0, -0.5, 1.5, 0.05, 0.03, -0.05];
/// Length of the recordings, s.
const LENGTH: f64 = 40.0;

/// A line through the saw tooth is flat and a step leaves its slopes, so neither is seen alone. The jump is found beside the
/// drift, both as they are, and nothing else.
#[test]
fn a_drift_that_is_zeroed_is_a_drift_and_a_jump() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let mut missed = 0;
    let cases: Vec<(f64, f64, u64)> = [10.0, 13.3, 20.0, 30.0]
        .into_iter()
        .flat_map(|at| [1.0, 3.0, 10.0].map(|size| (at, size)))
        .zip(0..)
        .map(|((at, size), seed)| (at, size, seed))
        .collect();
    for (at, size, seed) in &cases {
        let zeroed = |t: f64, mut read: [f64; 6]| {
            let since = t - if t > *at { *at } else { 0.0 };
            for (read, drift) in read.iter_mut().zip(DRIFT) {
                *read += size * drift * since / LENGTH;
            }
            read
        };
        let sensor = Sensor::default();
        let run = recorded(&moving, &tool(), &sensor, [LENGTH, 100.0], *seed, &zeroed);
        let found = identify_load(&moving.robot, &[&run], &[], &LoadOptions::default()).unwrap();
        let text = found.warnings.join("\n");
        let own = found.sensor.as_ref().unwrap();
        let bias = &own.biases[0];
        println!("zeroed at {at} s, {size} N: {:?} {text}", found.mass);
        let [(time, after)] = bias.jumps[..] else {
            panic!("{at} {size}: {:?} {text}", bias.jumps);
        };
        // The jump lies in one of the two segments of 2 s beside its place.
        assert!((time - at).abs() < 2.1, "{time} {at}");
        assert!(
            bias.curve.is_none() && own.turned.is_none() && own.gravity.is_none(),
            "{text}"
        );
        assert!(own.delay.is_none() && own.position.is_none(), "{text}");
        let drift = bias.drift.unwrap_or_else(|| panic!("{text}"));
        for c in 0..3 {
            assert!(
                (drift[c] - size * DRIFT[c]).abs() < 0.15,
                "{drift:?} {size}"
            );
            let jump = -size * DRIFT[c] * at / LENGTH;
            assert!(
                (after[c] - bias.bias[c] - jump).abs() < 0.15,
                "{bias:?} {jump}"
            );
        }
        missed += usize::from((found.mass.value - 2.4).abs() > found.mass.half_interval);
    }
    // Of 12 intervals at 95 %, three miss with a probability of 0.02.
    assert!(missed < 3, "{missed}");
}

/// A small jump beside a drift is not taken for a part of the drift.
#[test]
fn a_drift_does_not_take_up_a_jump() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let step = |t: f64, mut read: [f64; 6]| {
        for (read, drift) in read.iter_mut().zip(DRIFT) {
            *read += drift * t / LENGTH;
        }
        if t > 22.0 {
            read[0] += 0.5;
            read[2] -= 0.37;
        }
        read
    };
    for seed in 0..4 {
        let sensor = Sensor::default();
        let run = recorded(&moving, &tool(), &sensor, [LENGTH, 100.0], seed, &step);
        let found = identify_load(&moving.robot, &[&run], &[], &LoadOptions::default()).unwrap();
        let bias = &found.sensor.as_ref().unwrap().biases[0];
        let text = found.warnings.join("\n");
        assert_eq!(bias.jumps.len(), 1, "{text}");
        let (time, after) = bias.jumps[0];
        assert!((time - 22.0).abs() < 2.1, "{text}");
        assert!((after[0] - bias.bias[0] - 0.5).abs() < 0.1, "{bias:?}");
        assert!((after[2] - bias.bias[2] + 0.37).abs() < 0.1, "{bias:?}");
        let drift = bias.drift.unwrap();
        assert!((drift[2] - DRIFT[2]).abs() < 0.1, "{drift:?}");
    }
}

/// A recording with the temperature, in which a sensor that warms up is zeroed.
#[test]
fn a_bias_that_follows_the_temperature_is_zeroed() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let warmer = |t: f64| 12.0 * (1.0 - (-t / 15.0).exp());
    let per_kelvin = DRIFT.map(|drift| 0.08 * drift);
    let zeroed = |t: f64, mut read: [f64; 6]| {
        let since = warmer(t) - if t > 10.0 { warmer(10.0) } else { 0.0 };
        for (read, slope) in read.iter_mut().zip(per_kelvin) {
            *read += slope * since;
        }
        read
    };
    let mut run = recorded(
        &moving,
        &tool(),
        &Sensor::default(),
        [LENGTH, 100.0],
        3,
        &zeroed,
    );
    let block = &mut run.blocks[0];
    let column = block.t.iter().map(|t| 25.0 + warmer(*t)).collect();
    block.extra.push(("temp".to_owned(), column));
    let found = identify_load(&moving.robot, &[&run], &[], &LoadOptions::default()).unwrap();
    let own = found.sensor.as_ref().unwrap();
    let text = found.warnings.join("\n");
    let warming = own.warming.unwrap_or_else(|| panic!("{text}"));
    for c in 0..3 {
        assert!(
            (warming[c] / per_kelvin[c] - 1.0).abs() < 0.15,
            "{warming:?}"
        );
    }
    let [(time, _)] = own.biases[0].jumps[..] else {
        panic!("{text}");
    };
    assert!(
        (time - 10.0).abs() < 2.1 && own.biases[0].curve.is_none(),
        "{text}"
    );
}

/// Sound recordings have neither.
#[test]
fn a_sound_recording_has_neither_drift_nor_jump() {
    let moving = Moving::new(irp6(), 0.8, 8);
    for seed in 0..20 {
        let run = recorded(
            &moving,
            &tool(),
            &Sensor::default(),
            [LENGTH, 100.0],
            seed,
            NO_FLAW,
        );
        let found = identify_load(&moving.robot, &[&run], &[], &LoadOptions::default()).unwrap();
        let bias = &found.sensor.as_ref().unwrap().biases[0];
        assert!(bias.jumps.is_empty() && bias.drift.is_none(), "{bias:?}");
    }
}
