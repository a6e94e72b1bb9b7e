//! Arms that were identified, and recorded again with a payload and without.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use crate::outcome::{Diagnosis, Verdict};
use crate::{Options, diagnose};
use rig_data::Block;
use rig_data::prepare::{InMemory, Recording};
use rig_excite::{Noise, SampledReference, replay};
use rig_identify::{Estimator, Options as IdentifyOptions, identified_robot, identify};
use rig_model::robot::{Load, Robot, template};
use rig_shared::multibody::COLUMNS;
use rig_shared::transmission::MOTOR_COLUMNS;

/// kg, with the centre of mass at `PLACE`, m.
const MASS: f64 = 1.5;
const PLACE: [f64; 3] = [0.03, -0.02, 0.1];
/// Moment of inertia of the payload about its centre of mass, kg·m².
const OWN: f64 = 0.006;

/// Returns an arm that moves: a template without dry friction, with rotors where it states none.
fn arm(name: &str) -> Robot {
    let text = template(name).unwrap();
    let mut robot = Robot::from_toml(text, Path::new("arm.toml")).unwrap();
    for joint in &mut robot.joints {
        let drive = joint.drive.as_mut().unwrap();
        if drive.rotor_inertia == 0.0 {
            drive.rotor_inertia = 0.05 / drive.gear_ratio.powi(2);
        }
        drive.coulomb = 0.0;
        if let Some(friction) = &mut joint.friction {
            (friction.coulomb, friction.viscous) = (0.0, 1.0);
        }
    }
    robot
}

/// Returns the recording of some seconds of sines with rests at both ends.
fn recorded(robot: &Robot, seconds: f64, seed: u64) -> InMemory {
    let phase = |j: usize, h: u32| (seed + 3) as f64 * (7 * j + 3 * h as usize) as f64 * 0.86;
    let reference = SampledReference::eased_sines(robot, [2e-3, seconds], (4, 0.25, 6.3), phase);
    let noise = Noise {
        position: 1e-5,
        velocity: 0.0,
        torque: 0.02,
    };
    let made = replay(robot, &reference, noise, seed, |_, _| ()).unwrap();
    InMemory {
        label: format!("{seed}.csv"),
        blocks: vec![Block::of_motion(made.motion, made.period, &made.reference)],
    }
}

/// Returns the description that `rig identify` writes for a recording of `robot`.
fn identified(robot: &Robot) -> Robot {
    let recording = recorded(robot, 15.0, 1);
    let options = IdentifyOptions {
        estimator: Estimator::Consistent,
        ..IdentifyOptions::default()
    };
    let found = identify(robot, &[&recording], &[], &options).unwrap();
    identified_robot(robot, &found).0
}

fn asked(robot: &Robot, recording: &InMemory) -> Diagnosis {
    let training: [&dyn Recording; 1] = [recording];
    let options = Options::default();
    let found = diagnose(robot, &training, &[], &options, &mut |_| ()).unwrap();
    println!("{:?} {:?}", found.0.verdict, found.0.steps);
    found.0
}

/// Returns a description by base parameters: each combination stands at its column, everything else is zero.
fn by_combinations(robot: &Robot) -> Robot {
    let recording = recorded(robot, 15.0, 1);
    let found = identify(robot, &[&recording], &[], &IdentifyOptions::default()).unwrap();
    let details = &found.details;
    let mut all = vec![0.0; details.combination.ncols()];
    for (column, value) in details.columns.iter().zip(&details.estimate.values) {
        all[*column] = *value;
    }
    let links = robot.joints.len() * COLUMNS;
    let mut motors = all.split_off(links);
    motors.resize(robot.joints.len() * MOTOR_COLUMNS, 0.0);
    let described = robot.with_parameters(
        all.as_chunks::<COLUMNS>().0,
        motors.as_chunks::<MOTOR_COLUMNS>().0,
    );
    described.0
}

fn assert_told(described: &Robot, robot: &Robot, seconds: f64) {
    let sound = asked(described, &recorded(robot, seconds, 2));
    assert_eq!(sound.verdict, Verdict::NothingMissing, "{:?}", sound.words);
    let [x, y, z] = PLACE;
    let [xx, yy, zz] = [y * y + z * z, x * x + z * z, x * x + y * y].map(|s| MASS * s + OWN);
    let [xy, xz, yz] = [x * y, x * z, y * z].map(|s| -MASS * s);
    let load = Load::of([MASS, MASS * x, MASS * y, MASS * z, xx, xy, xz, yy, yz, zz]);
    let found = asked(described, &recorded(&robot.with_load(&load), seconds, 3));
    assert_eq!(found.verdict, Verdict::ParameterChange, "{:?}", found.words);
    let [step] = &found.steps[..] else {
        panic!("one step: a payload: {:?}", found.words)
    };
    assert_eq!(step.effect, "payload");
    for (name, truth) in ["mass", "x", "y", "z"].iter().zip([MASS, x, y, z]) {
        let Some(value) = step.parameters.get(*name) else {
            assert_eq!(
                *name, "z",
                "only the height of a planar arm's load is unknown"
            );
            continue;
        };
        let off = (value.value - truth).abs();
        assert!(off < 3.0 * value.std, "{name}: {value:?}, truth {truth}");
    }
    assert!(found.words.iter().any(|w| w.contains("RMS at joint")));
}

/// A payload on an identified arm is a verdict, with the mass within its interval; the same arm without it lacks nothing. A
/// recording of 8 s has fewer blocks than an arm has parameters.
#[test]
fn a_payload_on_an_identified_arm_is_told() {
    for (name, seconds) in [("edda", 25.0), ("edda", 8.0), ("tx40", 8.0)] {
        let robot = arm(name);
        println!("{name}, {seconds} s");
        assert_told(&identified(&robot), &robot, seconds);
    }
}

/// Base parameters alone describe an arm as well.
#[test]
fn a_payload_on_an_arm_described_by_base_parameters_is_told() {
    for (name, seconds) in [("edda", 25.0), ("tx40", 8.0)] {
        let robot = arm(name);
        println!("{name}, {seconds} s");
        assert_told(&by_combinations(&robot), &robot, seconds);
    }
}
