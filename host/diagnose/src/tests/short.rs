//! Short and plain motions: what follows from them is given, and no name.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::outcome::Verdict;
use crate::{Diagnosis, Options, diagnose};
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_model::robot::Robot;

const INERTIA: f64 = 0.05;
const VISCOUS: f64 = 0.3;
const COULOMB: f64 = 0.5;
const OFFSET: f64 = 0.2;

/// An axis without weight that follows a reference speed by its controller, small steps of its own.
fn followed(seconds: f64, speed: impl Fn(f64) -> f64) -> InMemory {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(9);
    let (mut q, mut v, mut reference) = (0.0_f64, 0.0_f64, 0.0);
    let step = 1e-4;
    let mut joint = JointColumns::default();
    let mut t = Vec::new();
    for k in 0..(seconds / step) as usize {
        let now = k as f64 * step;
        let wanted = speed(now);
        reference += wanted * step;
        let torque = INERTIA * (300.0 * (reference - q) + 30.0 * (wanted - v));
        if k % 10 == 0 {
            let mut white = || -> f64 { StandardNormal.sample(&mut rng) };
            t.push(now);
            joint.q.push(q + 1e-5 * white());
            joint.tau.push(torque + 0.02 * white());
        }
        let free = v + step * (torque - OFFSET - VISCOUS * v) / INERTIA;
        v = free.signum() * (free.abs() - step * COULOMB / INERTIA).max(0.0);
        q += step * v;
    }
    let block = Block {
        t,
        joints: vec![joint],
        ..Block::default()
    };
    InMemory {
        label: "short".into(),
        blocks: vec![block],
    }
}

fn diagnosed(recording: &InMemory) -> (Diagnosis, Robot) {
    diagnose(&axis(), &[recording], &[], &Options::default(), &mut |_| ()).unwrap()
}

/// Asserts what the motion tells: no fault, no name, inertia and friction.
fn assert_told(found: &Diagnosis, model: &Robot, dry: [f64; 2]) {
    println!("{:?} {:?}", found.verdict, found.words);
    assert!(found.data_faults.is_empty(), "{:?}", found.data_faults);
    assert!(found.steps.is_empty(), "{:?}", found.words);
    assert_eq!(found.verdict, Verdict::Remainder);
    let text = &found.remainder.as_ref().unwrap().text;
    assert!(
        text.contains("names are not learnt from less than 5 s"),
        "{text}"
    );
    let joint = &model.joints[0];
    let inertia = joint.inertial.as_ref().map_or(0.0, |i| i.inertia[5])
        + joint.drive.as_ref().map_or(0.0, |d| d.joint_inertia);
    assert!((inertia / INERTIA - 1.0).abs() < 0.03, "{inertia}");
    let friction = joint.friction.as_ref().unwrap();
    println!("{friction:?}");
    assert!(
        (friction.viscous / VISCOUS - 1.0).abs() < 0.05,
        "{friction:?}"
    );
    assert!((friction.coulomb - dry[0]).abs() < 0.03, "{friction:?}");
    assert!((friction.offset - dry[1]).abs() < 0.03, "{friction:?}");
}

fn axis() -> Robot {
    let text = "name = 'axis'\ngravity = [0.0, 0.0, -9.81]\n[[joint]]\nname = 'axis'\nkind = 'revolute'\nalpha = 0.0\na = 0.0\ntheta = 0.0\nd = 0.0\n";
    Robot::from_toml(text, Path::new("axis.toml")).unwrap()
}

/// A plain trapezoid from rest to rest, 3 s.
fn one_way() -> InMemory {
    followed(3.0, |t| {
        (10.0 * (t - 0.3)).min(10.0 * (2.7 - t)).clamp(0.0, 6.0)
    })
}

/// An identification tells dry friction and the constant as one number, with an interval that holds it.
#[test]
fn an_identification_of_a_one_way_trapezoid_gives_the_sum() {
    let options = rig_identify::Options::default();
    let found = rig_identify::identify(&axis(), &[&one_way()], &[], &options).unwrap();
    let names: Vec<&str> = (found.base_parameters.iter())
        .map(|p| p.expression.as_str())
        .collect();
    println!("{:?}", found.base_parameters);
    let sum = found
        .base_parameters
        .iter()
        .find(|p| p.expression == "fc1 + off1");
    let sum = sum.unwrap_or_else(|| panic!("{names:?}"));
    let [low, high] = sum.interval;
    assert!((sum.value - COULOMB - OFFSET).abs() < 0.02, "{sum:?}");
    assert!(low < COULOMB + OFFSET && COULOMB + OFFSET < high, "{sum:?}");
}

#[test]
fn a_trapezoid_of_three_seconds_one_way_tells_all_but_the_constant() {
    let (found, model) = diagnosed(&one_way());
    assert_told(&found, &model, [COULOMB + OFFSET, 0.0]);
}

#[test]
fn trapezoids_of_four_seconds_both_ways_tell_all() {
    let trapezoid = |t: f64| (10.0 * (t - 0.3)).min(10.0 * (1.7 - t)).clamp(0.0, 6.0);
    let recording = followed(4.0, |t| trapezoid(t) - trapezoid(t - 2.0));
    let (found, model) = diagnosed(&recording);
    assert_told(&found, &model, [COULOMB, OFFSET]);
}
