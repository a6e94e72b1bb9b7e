//! Position-dependent torques that the description lacks.

use super::arms::{Noise, arm, record};
use super::*;
use crate::identified_robot;

const STIFFNESS: f64 = 0.4;
const RIPPLE: [f64; 2] = [0.15, -0.10];

/// Three joints, described wrong by a fifth and without friction; if `pulled`, with a cable at the third joint and a
/// sensor with four spokes at the second.
fn made(seed: u64, pulled: bool) -> (Robot, InMemory) {
    let mut robot = arm(3, 40 + seed);
    let drive = robot.joints[1].drive.as_mut().unwrap();
    (drive.gear_ratio, drive.zero) = (-50.0, 0.7);
    let noise = Noise {
        position: 2e-6,
        torque: 0.05,
        ..Default::default()
    };
    let mut recording = record(&robot, 40.0, 200.0, noise, seed);
    if pulled {
        let joints = &mut recording.blocks[0].joints;
        let (mut second, mut third) = (joints[1].clone(), joints[2].clone());
        for (tau, q) in third.tau.iter_mut().zip(&third.q) {
            *tau += STIFFNESS * q;
        }
        for (tau, q) in second.tau.iter_mut().zip(&second.q) {
            *tau += RIPPLE[0] * (4.0 * q).cos() + RIPPLE[1] * (4.0 * q).sin();
        }
        (joints[1], joints[2]) = (second, third);
    }
    for joint in &mut robot.joints {
        let link = joint.inertial.as_mut().unwrap();
        link.mass *= 1.2;
        link.first_moment = link.first_moment.map(|x| 0.8 * x);
        link.inertia = link.inertia.map(|x| 1.2 * x);
        joint.friction = None;
    }
    (robot, recording)
}

#[test]
fn cables_and_ripple_are_found_where_they_are_and_only_there() {
    for seed in 0..4 {
        for estimator in [Estimator::Weighted, Estimator::Ridge, Estimator::Consistent] {
            let left = [false, true].map(|pulled| {
                let (robot, recording) = made(seed, pulled);
                let options = Options {
                    estimator,
                    look_beyond: true,
                    ..Default::default()
                };
                let found = identify(&robot, &[&recording], &[&recording], &options).unwrap();
                println!(
                    "{seed} {estimator:?} {pulled}: {:?}",
                    found.position_torques
                );
                let mut terms: Vec<_> = found
                    .position_torques
                    .iter()
                    .map(|t| (t.joint.as_str(), t.periods))
                    .collect();
                terms.sort_unstable();
                if pulled {
                    assert_eq!(terms, [("j2", Some(4)), ("j3", None)]);
                    for t in &found.position_torques {
                        let truth: &[f64] = if t.periods.is_some() {
                            &RIPPLE
                        } else {
                            &[STIFFNESS]
                        };
                        for ((value, std), truth) in t.values.iter().zip(&t.std).zip(truth) {
                            assert!((value - truth).abs() < 4.0 * std, "{t:?} {truth}");
                        }
                    }
                    // The written description states the same for the motors' angles.
                    let (written, _) = identified_robot(&robot, &found);
                    let effects = rig_model::effects::Effects::of(&written).unwrap();
                    assert_eq!(effects.placed().len(), 2);
                } else {
                    assert!(terms.is_empty(), "{terms:?}");
                }
                found.joints
            });
            // The residual is as without these torques, apart from their own standard deviations, 0.02 N·m.
            for (without, with) in left[0].iter().zip(&left[1]) {
                let ratio = with.train_residual_rms / without.train_residual_rms;
                assert!((0.95..1.2).contains(&ratio), "{} {ratio}", with.name);
            }
        }
    }
}

#[test]
fn nothing_is_looked_for_unasked() {
    let (robot, recording) = made(0, true);
    let found = identify(&robot, &[&recording], &[], &Options::default()).unwrap();
    assert!(found.position_torques.is_empty());
}

/// A base tilted by 1.5 degrees, and a level one as described.
#[test]
fn a_tilted_base_is_found_and_a_level_one_is_not() {
    for (seed, degrees) in [(0, 1.5f64), (1, 1.5), (2, 0.0), (3, 0.0)] {
        let tilt = degrees.to_radians();
        let mut robot = arm(3, 60 + seed);
        let level = robot.gravity;
        let direction = (0.8, 0.6);
        let size = level[2];
        robot.gravity = [
            size * tilt.sin() * direction.0,
            size * tilt.sin() * direction.1,
            size * tilt.cos(),
        ];
        let truth = robot.gravity;
        let noise = Noise {
            position: 2e-6,
            torque: 0.05,
            ..Default::default()
        };
        let recording = record(&robot, 40.0, 200.0, noise, seed);
        robot.gravity = level;
        for joint in &mut robot.joints {
            let link = joint.inertial.as_mut().unwrap();
            link.mass *= 1.2;
            link.first_moment = link.first_moment.map(|x| 0.8 * x);
            link.inertia = link.inertia.map(|x| 1.2 * x);
        }
        let options = Options {
            estimator: Estimator::Consistent,
            look_beyond: true,
            ..Default::default()
        };
        let found = identify(&robot, &[&recording], &[], &options).unwrap();
        println!("{seed} {degrees}: {:?}", found.base_tilt);
        assert!(found.position_torques.is_empty());
        if degrees == 0.0 {
            assert!(found.base_tilt.is_none());
            continue;
        }
        let tilted = found.base_tilt.as_ref().unwrap();
        assert!((tilted.angle - tilt).abs() < 4.0 * tilted.std && tilted.std < 0.2 * tilt);
        for (shown, truth) in tilted.gravity.iter().zip(truth) {
            assert!(
                (shown - truth).abs() < 4.0 * 9.81 * tilted.std,
                "{tilted:?} {truth}"
            );
        }
        let (written, _) = identified_robot(&robot, &found);
        assert_eq!(written.gravity, tilted.gravity);
    }
}
