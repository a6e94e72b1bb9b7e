//! A bare motor that turns one way only: torques of the textbook's equation along a motion in closed form, no simulation.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::{Diagnosis, Options, diagnose};
use rig_data::prepare::{InMemory, Recording};
use rig_data::{Block, JointColumns};
use rig_model::robot::Robot;

const MOTOR: &str = r#"
name = "motor"
gravity = [0.0, 0.0, -9.81]
[[joint]]
name = "shaft"
kind = "revolute"
alpha = 0.0
a = 0.0
theta = 0.0
d = 0.0
[joint.drive]
gear_ratio = 1.0
torque_constant = 0.025
"#;
/// Inertia, Coulomb and viscous friction, constant torque.
const TRUTH: [f64; 4] = [4.8e-6, 2.1e-3, 4.0e-6, 2.0e-4];

/// Speeds of `levels`, each held for three seconds, with smooth changes of some 0.1 s.
fn steps(levels: &[f64], seed: u64) -> InMemory {
    let [inertia, coulomb, viscous, offset] = TRUTH;
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let (mut q, mut columns, mut t) = (0.0, JointColumns::default(), Vec::new());
    let mut noise = move || -> f64 { StandardNormal.sample(&mut random) };
    for k in 0..3000 * levels.len() {
        let now = 1.0e-3 * k as f64;
        let (mut speed, mut acceleration) = (levels[0], 0.0);
        for (n, pair) in levels.windows(2).enumerate() {
            let place = ((now - 3.0 * (n + 1) as f64) / 0.05).tanh();
            let half = 0.5 * (pair[1] - pair[0]);
            speed += half * (1.0 + place);
            acceleration += half * (1.0 - place * place) / 0.05;
        }
        q += 1.0e-3 * speed;
        let count = std::f64::consts::TAU / 16384.0;
        t.push(now);
        columns.q.push((q / count).round() * count);
        let torque = inertia * acceleration + coulomb * speed.signum() + viscous * speed + offset;
        columns.tau.push(torque + 1.0e-4 * noise());
    }
    InMemory {
        label: format!("steps {seed}"),
        blocks: vec![Block {
            t,
            joints: vec![columns],
            first_line: 2,
            ..Block::default()
        }],
    }
}

fn diagnosed(runs: &[InMemory]) -> (Diagnosis, Robot) {
    let robot = Robot::from_toml(MOTOR, Path::new("motor.toml")).unwrap();
    let list: Vec<&dyn Recording> = runs.iter().map(|r| r as &dyn Recording).collect();
    diagnose(&robot, &list, &[], &Options::default(), &mut |_| ()).unwrap()
}

fn inertia(robot: &Robot) -> f64 {
    let joint = &robot.joints[0];
    let link = joint.inertial.as_ref().map_or(0.0, |i| i.inertia[5]);
    let drive = joint.drive.as_ref().unwrap();
    link + drive.rotor_inertia + drive.joint_inertia
}

#[test]
fn one_direction_gives_inertia_viscous_friction_and_the_sum_of_the_rest() {
    let runs = [steps(&[50.0, 100.0, 218.0, 150.0], 1)];
    let (found, model) = diagnosed(&runs);
    println!("{:?} {:?}", found.words, model.joints[0]);
    let [own, coulomb, viscous, offset] = TRUTH;
    assert!((inertia(&model) / own - 1.0).abs() < 0.05, "{model:?}");
    let friction = model.joints[0].friction.as_ref().unwrap();
    assert!(
        (friction.viscous / viscous - 1.0).abs() < 0.05,
        "{friction:?}"
    );
    let sum = friction.coulomb + friction.offset;
    assert!(
        (sum / (coulomb + offset) - 1.0).abs() < 0.02,
        "{friction:?}"
    );
    assert_eq!(friction.offset, 0.0);
    assert!(
        (found.words.iter()).any(|w| w.contains("off1") && w.contains("fc1")),
        "{:?}",
        found.words
    );
}

#[test]
fn both_directions_are_told_apart_without_a_word() {
    let runs = [steps(&[50.0, 218.0, -60.0, -200.0], 2)];
    let (found, model) = diagnosed(&runs);
    let [_, coulomb, _, offset] = TRUTH;
    let friction = model.joints[0].friction.as_ref().unwrap();
    assert!(
        (friction.coulomb / coulomb - 1.0).abs() < 0.05,
        "{friction:?}"
    );
    assert!(
        (friction.offset - offset).abs() < 0.2 * offset,
        "{friction:?}"
    );
    assert!(
        !found.words.iter().any(|w| w.contains("does not tell")),
        "{:?}",
        found.words
    );
}
