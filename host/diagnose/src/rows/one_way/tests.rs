//! Dry friction and a constant torque of a joint that moves in one direction only.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;
use std::path::Path;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

use crate::{Diagnosis, Options, diagnose};
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};

/// Dry friction and constant torque of the joint, N·m.
const TRUTH: [f64; 2] = [2.0, 0.15];

/// Speeds from 0 to 3 rad/s, with two rests, in one direction, or with `both` reversed every second time.
fn moved(seed: u64, direction: f64, both: bool) -> InMemory {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut block = Block {
        joints: vec![JointColumns::default()],
        ..Block::default()
    };
    let [rate, swing] = [500.0, 2.0 + 0.37 * seed as f64];
    let mut q = 0.0;
    for k in 0..15_000 {
        let t = f64::from(k) / rate;
        let phase = TAU * t / swing;
        let turn = (t / swing) as u64;
        let sign = if both && turn % 2 == 1 {
            -direction
        } else {
            direction
        };
        let size = 0.5 + 0.5 * ((turn * 7 + seed) % 5) as f64;
        let v = sign * 0.5 * size * (1.0 - phase.cos());
        let a = sign * 0.5 * size * phase.sin() * TAU / swing;
        q += v / rate;
        let moving = f64::from(u8::from(v.abs() > 1e-9));
        let tau =
            0.17 * a + 2.943 * q.cos() + 0.3 * v + (TRUTH[0] * v.signum() + TRUTH[1]) * moving;
        block.t.push(t);
        block.joints[0].q.push(q + 1e-5 * normal());
        block.joints[0].tau.push(tau + 0.03 * normal());
    }
    InMemory {
        label: format!("motion {seed}"),
        blocks: vec![block],
    }
}

/// Diagnoses a description without a field for a constant torque, such as a URDF.
fn diagnosed(direction: f64, both: bool) -> (Diagnosis, Robot) {
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
    robot.joints[0].limits = None;
    let [train, holdout] = [1, 2].map(|seed| moved(seed, direction, both));
    let options = Options {
        no_offsets: true,
        ..Options::default()
    };
    diagnose(&robot, &[&train], &[&holdout], &options, &mut |_| ()).unwrap()
}

#[test]
fn one_direction_tells_the_sum_of_dry_friction_and_a_constant() {
    for direction in [1.0, -1.0] {
        let (found, model) = diagnosed(direction, false);
        println!("{:?}", found.words);
        let sum = TRUTH[0] + direction * TRUTH[1];
        let name = if direction > 0.0 {
            "fc1 + off1"
        } else {
            "fc1 - off1"
        };
        let own = found.absorbed.iter().find(|a| a.parameter == name).unwrap();
        assert!((own.after - sum).abs() < 0.02, "{own:?}");
        assert!(found.steps.is_empty(), "{:?}", found.words);
        let friction = model.joints[0].friction.clone().unwrap();
        assert_eq!(friction.offset, 0.0);
        assert!((friction.coulomb - sum).abs() < 0.02, "{friction:?}");
        assert!(
            found.words[0].contains("the other direction"),
            "{:?}",
            found.words
        );
        assert!(
            found
                .words
                .iter()
                .any(|w| w.contains("in one direction only"))
        );
    }
}

#[test]
fn both_directions_tell_each() {
    let (found, model) = diagnosed(1.0, true);
    println!("{:?}", found.words);
    let friction = model.joints[0].friction.clone().unwrap();
    assert!((friction.coulomb - TRUTH[0]).abs() < 0.03, "{friction:?}");
    assert!((friction.offset - TRUTH[1]).abs() < 0.03, "{friction:?}");
    assert!(
        !found
            .words
            .iter()
            .any(|w| w.contains("in one direction only"))
    );
}
