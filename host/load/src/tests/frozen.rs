//! Sensors that are frozen, loads at the sensor's origin, and robots that hang.

use rig_data::prepare::InMemory;
use rig_model::robot::{Reads, Robot};

use super::made::{Moving, Points, Sensor, poses, recorded, tool};
use super::sensor::{NO_FLAW, irp6, tx40};
use crate::{LoadIdentification, LoadOptions, identify_load};

fn run(
    robot: &Robot,
    recording: &InMemory,
    even_if_wrong: bool,
) -> Result<LoadIdentification, String> {
    let options = LoadOptions {
        even_if_wrong,
        ..LoadOptions::default()
    };
    identify_load(robot, &[recording], &[], &options).map_err(|error| error.to_string())
}

fn listed(moving: &Moving, points: &Points, sensor: &Sensor, count: u32, seed: u64) -> InMemory {
    let list: Vec<Vec<f64>> = (0..count)
        .map(|k| moving.position(3.7 * f64::from(k)))
        .collect();
    poses(moving, points, sensor, &list, seed)
}

/// Holds some channels at the reading of row `from` up to row `to`.
fn freeze(recording: &mut InMemory, channels: &[usize], from: usize, to: usize) {
    for c in channels {
        let list = &mut recording.blocks[0].extra[*c].1;
        let held = list[from];
        list[from..to].fill(held);
    }
}

#[test]
fn a_frozen_sensor_is_refused_with_its_lines() {
    let moving = Moving::new(irp6(), 0.8, 31);
    let sound = recorded(
        &moving,
        &tool(),
        &Sensor::default(),
        [30.0, 100.0],
        32,
        NO_FLAW,
    );
    assert!(run(&moving.robot, &sound, false).is_ok());
    let all = [0, 1, 2, 3, 4, 5];
    for (channels, (from, to), words) in [
        (
            &all[..],
            (1500, 3000),
            "lines 1502 to 3001: all six channels repeat one reading",
        ),
        (
            &all[..],
            (900, 1200),
            "lines 902 to 1201: all six channels repeat one reading",
        ),
        (&all[1..2], (1500, 3000), "lines 1502 to 3001: fy reads"),
        (&all[5..], (0, 700), "lines 2 to 701: mz reads"),
    ] {
        let mut made = sound.clone();
        freeze(&mut made, channels, from, to);
        let text = run(&moving.robot, &made, false).unwrap_err();
        assert!(text.contains(words), "{text}");
        let text = run(&moving.robot, &made, true).unwrap().warnings.join(" ");
        assert!(text.contains(words), "{text}");
    }
}

/// A sensor that resolves 0.2 N and 0.02 N·m without noise, and a robot that stops for a third of the recording: readings stay
/// the same, and nothing is frozen.
#[test]
fn coarse_readings_and_rests_are_not_frozen() {
    let sensor = Sensor {
        noise: [0.0; 2],
        ..Sensor::default()
    };
    let coarse = |read: [f64; 6]| -> [f64; 6] {
        std::array::from_fn(|c| {
            let step = [0.2, 0.02][c / 3];
            (read[c] / step).round() * step
        })
    };
    for seed in 0..6 {
        let mut moving = Moving::new(irp6(), 0.6, 40 + seed);
        for stops in [None, Some([1.5, 3.0])] {
            moving.stops = stops;
            let flaw = |_: f64, read: [f64; 6]| coarse(read);
            let made = recorded(&moving, &tool(), &sensor, [24.0, 100.0], seed, &flaw);
            let found = run(&moving.robot, &made, true).unwrap();
            let text = found.warnings.join(" ");
            assert!(!text.contains("frozen"), "{seed}: {text}");
        }
    }
}

#[test]
fn poses_with_identical_readings_are_refused() {
    let moving = Moving::new(irp6(), 0.8, 51);
    let sound = listed(&moving, &tool(), &Sensor::default(), 10, 52);
    assert!(run(&moving.robot, &sound, false).is_ok());
    for held in [true, false] {
        let mut made = sound.clone();
        for (_, list) in &mut made.blocks[0].extra {
            let value = if held { list[5] } else { 0.0 };
            list[5..].fill(value);
        }
        let text = run(&moving.robot, &made, false).unwrap_err();
        assert!(
            text.contains("the readings of 5 poses are identical (t = "),
            "{text}"
        );
        // Going on may find no load, and ends with a sentence.
        let _ = run(&moving.robot, &made, true);
    }
}

/// A load of 2 kg whose centre of mass is the sensor's origin: the moments are noise, and nothing is wrong.
#[test]
fn a_load_about_the_origin_of_the_sensor_is_identified_at_rest() {
    let moving = Moving::new(irp6(), 0.8, 61);
    let origin = [0.0, 0.0, 0.03];
    let points: Points = [[0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, 0.0, 0.05]]
        .iter()
        .flat_map(|off| [1.0, -1.0].map(|s| (1.0 / 3.0, [0, 1, 2].map(|k| origin[k] + s * off[k]))))
        .collect();
    for seed in 0..8 {
        let made = listed(&moving, &points, &Sensor::default(), 12, seed);
        let found = run(&moving.robot, &made, false).unwrap();
        assert!(
            (found.mass.value / 2.0 - 1.0).abs() < 0.02,
            "{}",
            found.mass.value
        );
        for (own, truth) in found.centre.iter().zip(origin) {
            assert!((own.value - truth).abs() < 3e-3, "{}", own.value);
        }
    }
    // Moments that are far more than the noise are no such load.
    let mut made = listed(&moving, &tool(), &Sensor::default(), 12, 9);
    for (c, (_, list)) in made.blocks[0].extra.iter_mut().enumerate().skip(3) {
        let all = list.clone();
        let count = list.len();
        (0..count).for_each(|k| list[k] = all[(k * 5 + 3 * c) % count]);
    }
    assert!(run(&moving.robot, &made, false).is_err());
}

/// Readings of a robot that hangs, with a description of one on the floor.
#[test]
fn a_robot_that_hangs_is_named() {
    let floor = irp6();
    let mut ceiling = floor.clone();
    ceiling.gravity = floor.gravity.map(|g| -g);
    // Slow motions, too: their small accelerations let a delay stand for the wrong gravity.
    for share in [0.8, 0.3] {
        let moving = Moving::new(ceiling.clone(), share, 71);
        let sensor = Sensor::default();
        let motion = recorded(&moving, &tool(), &sensor, [30.0, 100.0], 72, NO_FLAW);
        for reads in [Some(Reads::Load), None] {
            let mut robot = floor.clone();
            robot.wrist_sensor.as_mut().unwrap().reads = reads;
            let text = run(&robot, &motion, false).unwrap_err();
            assert!(
                text.contains("write gravity = [0, 0, 9.81] into the description"),
                "{share}: {text}"
            );
            assert!(!text.contains("reads ="), "{text}");
            let found = run(&robot, &motion, true).unwrap();
            let truth: f64 = tool().iter().map(|own| own.0).sum();
            assert!(
                (found.mass.value / truth - 1.0).abs() < 0.01,
                "{}",
                found.mass.value
            );
        }
    }
    // A lively motion lets a base that leans by 180 degrees stand for it, with two unknowns more.
    for seed in 5..8 {
        let moving = Moving::new(tx40(), 0.7, seed);
        let sensor = Sensor::default();
        let motion = recorded(&moving, &tool(), &sensor, [40.0, 200.0], seed, NO_FLAW);
        let mut robot = tx40();
        robot.gravity = robot.gravity.map(|g| -g);
        let text = run(&robot, &motion, false).unwrap_err();
        assert!(
            text.contains("write gravity = [0, 0, -9.81] into the description"),
            "{seed}: {text}"
        );
    }
    // The opposite sign of a sensor on the floor is told from it in a motion, and is not at rest.
    let on_floor = Moving::new(floor.clone(), 0.8, 71);
    let opposite = Sensor {
        sign: 1.0,
        ..Sensor::default()
    };
    let motion = recorded(&on_floor, &tool(), &opposite, [30.0, 100.0], 73, NO_FLAW);
    let text = run(&floor, &motion, false).unwrap_err();
    assert!(
        text.contains("sign of reads = \"robot\"") && !text.contains("gravity"),
        "{text}"
    );
    let moving = Moving::new(ceiling, 0.8, 71);
    let rest = listed(&moving, &tool(), &Sensor::default(), 12, 74);
    let text = run(&floor, &rest, false).unwrap_err();
    assert!(
        text.contains("sign of reads = \"robot\"") && text.contains("write gravity = [0, 0, 9.81]"),
        "{text}"
    );
}
