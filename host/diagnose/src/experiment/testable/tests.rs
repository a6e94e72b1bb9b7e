#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use rig_shared::effects::Kind;

use crate::experiment::testable::*;
use rig_data::runs::{JointRun, Run};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};

const RATE: f64 = 200.0;

fn robot() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// A motion of the one link with its gravity and friction.
fn run(seconds: f64, q: impl Fn(f64) -> f64) -> Run {
    let t: Vec<f64> = (0..(seconds * RATE) as usize)
        .map(|k| k as f64 / RATE)
        .collect();
    let q: Vec<f64> = t.iter().map(|t| q(*t)).collect();
    let qd = rig_data::prepare::central_difference(&q, 1.0 / RATE);
    let qdd = rig_data::prepare::second_difference(&q, 1.0 / RATE);
    let tau = (0..t.len())
        .map(|k| 0.17 * qdd[k] + 3.0 * q[k].cos() + 0.3 * qd[k] + 0.4 * qd[k].signum())
        .collect();
    Run {
        label: "made".into(),
        recording: 0,
        rate: RATE,
        t,
        joints: vec![JointRun {
            q_raw: q.clone(),
            tau,
            q,
            qd,
            qdd,
            ..JointRun::default()
        }],
        ..Run::default()
    }
}

fn why(kind: Kind, runs: &[Run]) -> Option<String> {
    not_testable(kind, &robot(), 0, runs).map(|n| {
        println!("{}: {}; {}", n.effect, n.why, n.experiment);
        assert_eq!(n.joint, "link");
        assert!(!n.experiment.is_empty());
        n.why
    })
}

#[test]
fn a_fast_sine_has_no_slow_motion_and_says_so_in_figures() {
    let fast = [run(30.0, |t| 1.5 * (3.0 * t).sin())];
    let said = why(Kind::Stribeck, &fast).unwrap();
    assert!(
        said.contains("0.050 rad/s") && said.contains("s in all below"),
        "{said}"
    );
    assert!(why(Kind::PreslidingDahl, &fast).is_none());
    assert!(why(Kind::Cogging, &fast).is_some());
    // The same with slow constant speeds.
    let slow = [
        fast[0].clone(),
        run(60.0, |t| 0.03 * (10.0 - (t % 20.0 - 10.0).abs())),
    ];
    assert!(why(Kind::Stribeck, &slow).is_none());
    assert!(why(Kind::Cogging, &slow).is_none());
}

#[test]
fn motion_to_one_side_has_no_reversals() {
    let ramp = [run(20.0, |t| 0.1 * t)];
    assert!(
        why(Kind::PreslidingDahl, &ramp)
            .unwrap()
            .contains("reverses 0 times")
    );
    assert!(why(Kind::AsymmetricCoulomb, &ramp).is_some());
    let twice = [run(20.0, |t| (0.8 * t).sin())];
    assert!(why(Kind::AsymmetricCoulomb, &twice).is_none());
}

#[test]
fn noise_of_the_encoder_is_no_reversal() {
    let mut ramp = run(20.0, |t| 0.1 * t);
    let joint = &mut ramp.joints[0];
    for (k, q) in joint.q_raw.iter_mut().enumerate() {
        *q += 1e-4 * (1.7 * k as f64).sin();
    }
    // The filter passes a tenth of it.
    let raw = joint.q_raw.clone();
    for (k, q) in joint.q.iter_mut().enumerate() {
        *q = 0.1 * k as f64 / RATE + 0.1 * (raw[k] - 0.1 * k as f64 / RATE);
    }
    assert!(
        why(Kind::PreslidingDahl, &[ramp])
            .unwrap()
            .contains("reverses 0 times")
    );
}

#[test]
fn a_small_range_cannot_tell_a_spring_from_gravity() {
    let small = [run(20.0, |t| 0.4 * (1.5 * t).sin())];
    assert!(why(Kind::Spring, &small).unwrap().contains("0.80 rad"));
    let wide = [run(20.0, |t| 2.0 * (1.5 * t).sin())];
    assert!(why(Kind::Spring, &wide).is_none());
}

#[test]
fn columns_that_are_missing_are_named() {
    let mut some = run(20.0, |t| 2.0 * (1.5 * t).sin());
    assert!(
        why(Kind::DriveDeadzone, &[some.clone()])
            .unwrap()
            .contains("voltage")
    );
    assert!(
        why(Kind::ViscousWarmupTemperature, &[some.clone()])
            .unwrap()
            .contains("temperature")
    );
    assert!(
        why(Kind::ViscousWarmupTime, &[some.clone()])
            .unwrap()
            .contains("20.0 s")
    );
    assert!(
        why(Kind::InertiaCoupling, &[some.clone()])
            .unwrap()
            .contains("no other joint")
    );
    let count = some.t.len();
    some.joints[0].voltage = Some(vec![1.0; count]);
    some.joints[0].temperature = Some(
        (0..count)
            .map(|k| 25.0 + 5.0 * k as f64 / count as f64)
            .collect(),
    );
    assert!(why(Kind::DriveDeadzone, &[some.clone()]).is_none());
    assert!(why(Kind::ViscousWarmupTemperature, &[some.clone()]).is_none());
    some.joints[0].tau.clear();
    assert!(
        why(Kind::Stribeck, &[some.clone()])
            .unwrap()
            .contains("torque")
    );
    assert!(why(Kind::DriveDeadzone, &[some]).is_none());
}

#[test]
fn one_load_throughout_shows_no_friction_that_grows_with_it() {
    // A lift: constant gravity, and slow, so that inertia adds little.
    let mut lift = run(60.0, |t| 0.5 * (0.5 * t).sin());
    let joint = &mut lift.joints[0];
    joint.tau = joint
        .qd
        .iter()
        .map(|v| 10.0 + 2.0 * v + 1.0 * v.signum())
        .collect();
    assert!(
        why(Kind::LoadFriction, &[lift])
            .unwrap()
            .contains("varies by")
    );
    assert!(why(Kind::LoadFriction, &[run(60.0, |t| 2.0 * (1.5 * t).sin())]).is_none());
}

#[test]
fn only_the_voltage_resolves_what_no_motion_does() {
    let mut some = run(20.0, |t| 2.0 * (1.5 * t).sin());
    let with: Vec<&str> = confounded(Kind::AsymmetricCoulomb, 0, &[some.clone()])
        .iter()
        .map(|c| c.with)
        .collect();
    assert_eq!(with, ["current_offset", "torque_offset"]);
    some.joints[0].voltage = Some(vec![1.0; some.t.len()]);
    let left = confounded(Kind::AsymmetricCoulomb, 0, &[some]);
    assert!(left.iter().all(|c| c.with != "current_offset"));
}

#[test]
fn a_description_without_values_is_no_prior() {
    let runs = [run(20.0, |t| 2.0 * (1.5 * t).sin())];
    assert!(why(Kind::Payload, &runs).is_none());
    let mut bare = robot();
    bare.joints[0].inertial = None;
    assert!(
        not_testable(Kind::Payload, &bare, 0, &runs)
            .unwrap()
            .why
            .contains("inertial")
    );
}

#[test]
fn a_joint_without_a_described_ratio_has_the_waves_of_its_own_turn_alone() {
    let mut robot =
        Robot::from_toml(rig_model::robot::ONE_LINK_TEMPLATE, Path::new("one.toml")).unwrap();
    let runs = [run(60.0, |t| 1.5 * (0.2 * t).sin())];
    robot.joints[0].drive = None;
    let found = not_testable(Kind::Cogging, &robot, 0, &runs).unwrap();
    assert!(found.why.contains("own turn alone"), "{}", found.why);
    assert!(found.experiment.contains("gear_ratio"));
}

#[test]
fn a_slide_lacks_a_described_drive_or_the_way() {
    let slide = Robot::from_toml(rig_model::robot::EMPS, Path::new("emps.toml")).unwrap();
    let runs = [run(60.0, |t| 0.125 + 0.12 * (0.5 * t).sin())];
    let lacking = |kind: Kind| not_testable(kind, &slide, 0, &runs).unwrap();
    for kind in [Kind::Cogging, Kind::GearEccentricity] {
        let found = lacking(kind);
        assert!(found.why.contains("no drive"), "{}", found.why);
        assert!(
            found.experiment.contains("gear_ratio"),
            "{}",
            found.experiment
        );
    }
    let found = lacking(Kind::PositionFriction);
    assert!(
        found.why.contains("0.240 m") && found.why.contains("1.571 m long"),
        "{}",
        found.why
    );
}
