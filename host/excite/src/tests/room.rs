//! Margins for the controller, and motions of one joint with options.

use rig_shared::trajectory::Trajectory;

use super::*;
use rig_model::robot::JointFriction;

/// Returns the extremes of a motion.
fn reached(robot: &Robot, file: &TrajectoryFile) -> [f64; 4] {
    let [low, high, v, a, _] = sampled_reach(robot, file)[0];
    [low, high, v, a]
}

#[test]
fn margin_and_speed_share_are_left_free_by_every_kind() {
    let robot = one_link();
    let limits = robot.joints[0].limits.clone().unwrap();
    let [low, high] = limits.position;
    for (margin, share) in [(0.1, 0.9), (0.4, 0.5)] {
        let free = 0.5 * margin * (high - low);
        let options = Options {
            margin,
            speed_share: share,
            start: Some(vec![-1.57]),
            ..quick(Criterion::ConditionNumber)
        };
        let mut files = vec![designed(&robot, &options).file];
        for kind in [
            StagedKind::Chirp,
            StagedKind::Staircase,
            StagedKind::Reversals,
            StagedKind::Sweep,
        ] {
            let options = StagedOptions {
                margin: Some(margin),
                speed_share: Some(share),
                start: Some(vec![-1.57]),
                ..StagedOptions::default()
            };
            files.push(staged(&robot, kind, &options).unwrap().0);
        }
        for file in files {
            let [lowest, highest, v, a] = reached(&robot, &file);
            let tiny = 1e-6;
            assert!(lowest >= low + free - tiny && highest <= high - free + tiny);
            assert!(v <= share * limits.velocity * (1.0 + tiny), "{v}");
            assert!(
                a <= share * share * limits.acceleration.unwrap() * (1.0 + tiny),
                "{a}"
            );
        }
    }
    // The motion uses its full allowance: half of the speed, not less.
    let options = Options {
        speed_share: 0.5,
        ..quick(Criterion::ConditionNumber)
    };
    let [_, _, v, _] = reached(&robot, &designed(&robot, &options).file);
    assert!(v > 0.45 * limits.velocity, "{v}");
}

#[test]
fn a_start_in_the_margin_is_kept_and_one_on_the_limit_is_refused() {
    let robot = one_link();
    let [low, _] = robot.joints[0].limits.as_ref().unwrap().position;
    let options = |at: f64| Options {
        margin: 0.2,
        start: Some(vec![at]),
        ..quick(Criterion::ConditionNumber)
    };
    let found = designed(&robot, &options(low + 0.3));
    assert!(
        found.notes.iter().any(|n| n.contains("margin")),
        "{:?}",
        found.notes
    );
    let [lowest, ..] = reached(&robot, &found.file);
    assert!(lowest >= low);
    let refused = design(&robot, &options(low), |_, _| ())
        .unwrap_err()
        .to_string();
    assert!(refused.contains("strictly between"), "{refused}");
}

#[test]
fn a_motion_of_one_joint_is_what_was_asked_for() {
    let robot = one_link();
    let with = |kind, options: StagedOptions| {
        let options = StagedOptions {
            start: Some(vec![-1.57]),
            ..options
        };
        staged(&robot, kind, &options).unwrap().0
    };
    let sweep = with(
        StagedKind::Sweep,
        StagedOptions {
            amplitude: Some(0.4),
            speeds: Some(vec![0.02, 1.5]),
            count: Some(7),
            ..StagedOptions::default()
        },
    );
    let Trajectory::FrictionSweep(motion) = &sweep.joints[0].trajectory else {
        panic!("a sweep is one")
    };
    let speeds: Vec<f64> = (0..7).filter_map(|k| motion.speed(k)).collect();
    assert_eq!(speeds.len(), 7);
    assert!((speeds[0] / 0.02 - 1.0).abs() < 1e-3 && (speeds[6] / 1.5 - 1.0).abs() < 1e-3);
    let [low, high, ..] = reached(&robot, &sweep);
    assert!((high - low - 0.8).abs() < 0.01, "{low} {high}");

    let chirp = with(
        StagedKind::Chirp,
        StagedOptions {
            band: Some([0.5, 4.0]),
            amplitude: Some(0.2),
            ..StagedOptions::default()
        },
    );
    let Trajectory::Chirp(motion) = &chirp.joints[0].trajectory else {
        panic!("a chirp is one")
    };
    assert_eq!([motion.start_hz, motion.end_hz], [0.5, 4.0]);
    assert!(chirp.duration() < 60.0);

    let reversals = with(
        StagedKind::Reversals,
        StagedOptions {
            speeds: Some(vec![0.03]),
            amplitude: Some(0.3),
            cycles: Some(5),
            ..StagedOptions::default()
        },
    );
    let Trajectory::SlowReversals(motion) = &reversals.joints[0].trajectory else {
        panic!("reversals are some")
    };
    assert_eq!((motion.cycles, motion.speed), (5, 0.03));
    let [low, high, ..] = reached(&robot, &reversals);
    assert!((high - low - 0.6).abs() < 0.01, "{low} {high}");
}

/// The default sweep begins below the speeds at which friction of gears weakens.
#[test]
fn a_sweep_spans_speeds_from_creeping_to_near_the_limit() {
    let robot = one_link();
    let (file, notes) = staged(&robot, StagedKind::Sweep, &StagedOptions::default()).unwrap();
    let Trajectory::FrictionSweep(motion) = &file.joints[0].trajectory else {
        panic!("a sweep is one")
    };
    assert!(notes.is_empty(), "{notes:?}");
    let limit = robot.joints[0].limits.as_ref().unwrap().velocity;
    let (slow, fast) = (motion.speed(0).unwrap(), motion.speed(11).unwrap());
    assert!(slow < 0.005 * limit && fast > 0.3 * limit, "{slow} {fast}");
    assert!((fast / slow / 200.0 - 1.0).abs() < 1e-3, "{slow} {fast}");
}

/// Many files state 10 000 rad/s and no acceleration limit: torque limit and inertia then bound the motion.
#[test]
fn without_an_acceleration_limit_the_period_is_what_the_torque_allows() {
    let mut robot = one_link();
    let period = |robot: &Robot| default_period(robot, 5).unwrap();
    let joint = &mut robot.joints[0];
    joint.friction = Some(JointFriction {
        coulomb: 0.0,
        viscous: 2.0,
        offset: 0.0,
    });
    let limits = joint.limits.as_mut().unwrap();
    (limits.position, limits.soft_position) = ([-1.5, 1.5], None);
    (limits.velocity, limits.acceleration, limits.torque) = (9000.0, None, Some(5.0));
    // 5 N·m against 2 N·m·s/rad give 2.5 rad/s, and 1.5 rad at that speed give a period of 3.77 s.
    assert_eq!(period(&robot), 3.8);
    // A fifth of the torque gives a fifth of the speed: the period due to inertia is still smaller, 2.7 s.
    robot.joints[0].limits.as_mut().unwrap().torque = Some(1.0);
    assert_eq!(period(&robot), 18.9);
    robot.joints[0].limits.as_mut().unwrap().torque = Some(9e3);
    assert_eq!(period(&robot), 1.0);
    robot.joints[0].inertial = None;
    assert_eq!(period(&robot), 1.0);
    // A stated limit takes precedence.
    let limits = robot.joints[0].limits.as_mut().unwrap();
    (limits.velocity, limits.acceleration) = (3.0, Some(20.0));
    assert_eq!(period(&robot), 4.8);
}
