//! Sentences that must fit what was given and what acts.

use super::made::{Moving, Sensor, poses, recorded, tool};
use super::sensor::{NO_FLAW, irp6};
use crate::{LoadIdentification, LoadOptions, identify_load};
use rig_data::prepare::InMemory;
use rig_model::robot::{Origin, Reads, Robot, WristSensor};

fn found(robot: &Robot, recording: &InMemory) -> LoadIdentification {
    identify_load(robot, &[recording], &[], &LoadOptions::default()).unwrap()
}

/// Returns the mean readings of some poses with little noise.
fn few(moving: &Moving, count: u32) -> InMemory {
    let list: Vec<Vec<f64>> = (0..count)
        .map(|k| moving.position(3.1 * f64::from(k)))
        .collect();
    let sensor = Sensor {
        noise: [0.005, 0.0005],
        ..Sensor::default()
    };
    poses(moving, &tool(), &sensor, &list, 7)
}

/// A temperature that is no number made "0 ± 0 kg".
#[test]
fn a_temperature_that_is_no_number_is_refused_with_its_line() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let sensor = Sensor::default();
    let motion = recorded(&moving, &tool(), &sensor, [10.0, 100.0], 1, NO_FLAW);
    for (mut run, row) in [(motion, 499), (few(&moving, 8), 3)] {
        let block = &mut run.blocks[0];
        let mut column = vec![25.0; block.t.len()];
        column[row] = f64::NAN;
        block.extra.push(("temp".to_owned(), column));
        let refused = identify_load(&moving.robot, &[&run], &[], &LoadOptions::default());
        let text = refused.unwrap_err().to_string();
        let place = format!("{}:{}: the column `temp`", run.label, row + 2);
        assert!(text.starts_with(&place), "{text}");
    }
}

/// A column `temp` that is there is not asked for.
#[test]
fn a_temperature_that_explains_nothing_is_not_asked_for_again() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let warms = |t: f64, read: [f64; 6]| read.map(|r| r + 1.2 * (1.0 - (-t / 15.0).exp()));
    let run = recorded(
        &moving,
        &tool(),
        &Sensor::default(),
        [40.0, 100.0],
        1,
        &warms,
    );
    let text = |column: Option<&dyn Fn(f64) -> f64>| {
        let mut run = run.clone();
        if let Some(temperature) = column {
            let block = &mut run.blocks[0];
            let column = block.t.iter().map(|t| temperature(*t)).collect();
            block.extra.push(("temp".to_owned(), column));
        }
        found(&moving.robot, &run).warnings.join(" ")
    };
    let without = text(None);
    assert!(
        without.contains("or record its temperature as the column `temp`"),
        "{without}"
    );
    let constant = text(Some(&|_| 25.0));
    assert!(
        constant.contains("The column `temp` is constant"),
        "{constant}"
    );
    let other = text(Some(&|t| 25.0 + (2.0 * t).sin()));
    assert!(
        other.contains("The column `temp` does not explain the bias"),
        "{other}"
    );
    assert!(!constant.contains("or record") && !other.contains("or record"));
}

/// The zero of the last joint stands for a sensor that is turned about its axis. A zero of another joint, beside which the
/// sensor is turned as well, does not.
#[test]
fn only_a_zero_that_replaces_the_rotation_is_named_beside_it() {
    let mut moving = Moving::new(irp6(), 0.8, 8);
    moving.robot.wrist_sensor.as_mut().unwrap().rotation = [0.0, 0.0, 0.4];
    let run = few(&moving, 6);
    moving.robot.wrist_sensor.as_mut().unwrap().rotation = [0.0; 3];
    let text = found(&moving.robot, &run).warnings.join(" ");
    assert!(text.contains("turned by 22.9 degrees"), "{text}");
    assert!(
        text.contains("q5 is counted from another zero (0.4"),
        "{text}"
    );
    for k in 1..5 {
        assert!(!text.contains(&format!("q{k} is counted")), "{text}");
    }
}

/// A URDF has no table [wrist_sensor]: the sentences name options.
#[test]
fn sentences_for_a_urdf_name_options() {
    let mut moving = Moving::new(irp6(), 0.8, 8);
    moving.robot.wrist_sensor = Some(WristSensor {
        rotation: [0.0, 0.0, 0.4],
        ..WristSensor::default()
    });
    let sensor = Sensor::default();
    let run = recorded(&moving, &tool(), &sensor, [30.0, 100.0], 1, NO_FLAW);
    moving.robot.origin = Origin::Urdf;
    moving.robot.wrist_sensor = None;
    let own = found(&moving.robot, &run);
    let mut text = own.warnings.join(" ");
    text += own.sensor.unwrap().reads_found.as_ref().unwrap();
    assert!(text.contains("No pose of the sensor was given"), "{text}");
    assert!(
        text.contains("--sensor-rotation ") && text.contains("--reads load"),
        "{text}"
    );
    assert!(
        !text.contains("[wrist_sensor]") && !text.contains("description"),
        "{text}"
    );
    let mut stated = |reads: Reads, origin: Origin| {
        moving.robot.origin = origin;
        moving.robot.wrist_sensor = Some(WristSensor {
            rotation: [0.0, 0.0, 0.4],
            reads: Some(reads),
            ..WristSensor::default()
        });
        let refused = identify_load(&moving.robot, &[&run], &[], &LoadOptions::default());
        refused.unwrap_err().to_string()
    };
    let text = stated(Reads::Robot, Origin::Urdf);
    assert!(
        text.contains("but --reads says reads = \"robot\""),
        "{text}"
    );
    let text = stated(Reads::Robot, Origin::Own);
    assert!(
        text.contains("but [wrist_sensor] or --reads says"),
        "{text}"
    );
}

/// One extreme value that several poses share exactly is a limit, of whichever sign.
#[test]
fn poses_at_one_extreme_value_look_saturated() {
    let moving = Moving::new(irp6(), 0.8, 8);
    let sound = few(&moving, 12);
    let extreme = |run: &InMemory| {
        let fx = &run.blocks[0].extra[0].1;
        let mut sizes: Vec<f64> = fx.iter().map(|f| f.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // Between the third and the second of the largest.
        0.5 * (sizes[sizes.len() - 3] + sizes[sizes.len() - 2])
    };
    let limit = extreme(&sound);
    let mut clipped = sound.clone();
    let fx = &mut clipped.blocks[0].extra[0].1;
    fx.iter_mut().for_each(|f| *f = f.clamp(-limit, limit));
    let text = found(&moving.robot, &clipped).warnings.join(" ");
    assert!(
        text.contains("saturated: fx reads exactly") || text.contains("fx are cut at"),
        "{text}"
    );
    // A contact is none.
    let mut pushed = sound;
    pushed.blocks[0].extra[0].1[4] += 8.0;
    pushed.blocks[0].extra[0].1[7] -= 6.0;
    let text = found(&moving.robot, &pushed).warnings.join(" ");
    assert!(
        text.contains("Look for a contact") && !text.contains("saturated"),
        "{text}"
    );
}
