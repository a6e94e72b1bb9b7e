//! A sensor that warms up: the bias settles exponentially, with and without a recorded temperature.

use super::made::{Moving, Sensor, recorded, tool};
use super::sensor::{NO_FLAW, irp6};
use crate::{Bias, LoadIdentification, LoadOptions, identify_load};

/// Seconds after which the sensor is warm, about.
const CONSTANT: f64 = 15.0;
/// Change of the bias from cold to warm.
const CHANGE: [f64; 6] = [0.96, -1.2, 1.44, 0.072, -0.048, 0.06];

fn warms(t: f64, mut read: [f64; 6]) -> [f64; 6] {
    for (read, change) in read.iter_mut().zip(CHANGE) {
        *read += change * (1.0 - (-t / CONSTANT).exp());
    }
    read
}

fn bias(found: &LoadIdentification) -> &Bias {
    &found.sensor.as_ref().unwrap().biases[0]
}

/// Jumps and a linear drift approximate such a course; the sentence names the course, and no jump.
#[test]
fn a_bias_that_settles_is_no_sequence_of_jumps() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let options = LoadOptions::default();
    let seeds = 6;
    for seed in 0..seeds {
        let sensor = Sensor::default();
        let run = recorded(&moving, &tool(), &sensor, [40.0, 100.0], seed, &warms);
        let found = identify_load(&moving.robot, &[&run], &[], &options).unwrap();
        let (own, text) = (bias(&found), found.warnings.join(" "));
        println!("warm-up {seed}: {:?}; {} jumps", own.curve, own.jumps.len());
        if own.jumps.is_empty() {
            continue;
        }
        let curve = own.curve.unwrap_or_else(|| panic!("{text}"));
        assert!(
            !text.contains("jumps near") && text.contains("`temp`"),
            "{text}"
        );
        for (found, change) in curve.change.iter().zip(CHANGE) {
            let over = change * (1.0 - (-40.0 / CONSTANT).exp());
            assert!((found / over - 1.0).abs() < 0.25, "{curve:?}");
        }
    }
    // True jumps stay jumps, also two of them and beside a linear drift.
    for seed in 0..seeds {
        for (back, slope) in [(0.0, 0.0), (-3.0, 0.0), (0.0, 0.1)] {
            let jumps = |t: f64, mut read: [f64; 6]| {
                read[0] += slope * t;
                read[2] += if t > 13.3 { 4.0 } else { 0.0 };
                read[2] += if t > 27.6 { back } else { 0.0 };
                read
            };
            let sensor = Sensor::default();
            let run = recorded(&moving, &tool(), &sensor, [40.0, 100.0], seed, &jumps);
            let found = identify_load(&moving.robot, &[&run], &[], &options).unwrap();
            assert!(
                bias(&found).curve.is_none(),
                "{back} {slope} {:?}",
                bias(&found)
            );
            assert!(found.warnings.iter().any(|w| w.contains("jumps near")));
        }
    }
}

/// With the temperature recorded, its coefficient and the temperature of the bias are told.
#[test]
fn a_bias_that_follows_the_temperature_is_told_with_its_reference() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let options = LoadOptions::default();
    let sensor = Sensor::default();
    let mut run = recorded(&moving, &tool(), &sensor, [40.0, 100.0], 1, &warms);
    let plain = recorded(&moving, &tool(), &sensor, [40.0, 100.0], 1, NO_FLAW);
    let without = identify_load(&moving.robot, &[&plain], &[], &options).unwrap();
    let block = &mut run.blocks[0];
    let temperature = |t: &f64| 25.0 + 12.0 * (1.0 - (-t / CONSTANT).exp());
    let column = block.t.iter().map(temperature).collect();
    block.extra.push(("temp".to_owned(), column));
    let found = identify_load(&moving.robot, &[&run], &[], &options).unwrap();
    let text = found.warnings.join(" ");
    assert!(
        text.contains("follows the column `temp`") && text.contains("per unit of temp"),
        "{text}"
    );
    let own = bias(&found);
    assert!((own.temperature.unwrap() - 25.0).abs() < 0.5, "{own:?}");
    // The bias is that of the cold sensor.
    for (cold, known) in own.bias.iter().zip(bias(&without).bias) {
        assert!((cold - known).abs() < 0.15, "{own:?} {known}");
    }
    let warming = found.sensor.as_ref().unwrap().warming.unwrap();
    for (slope, change) in warming.iter().zip(CHANGE) {
        assert!((slope / (change / 12.0) - 1.0).abs() < 0.2, "{warming:?}");
    }
}
