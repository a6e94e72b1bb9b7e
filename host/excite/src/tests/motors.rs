//! Limits of the motors, on their side: the IRp-6 with screws and a coupled wrist, and a simple drive.

use rand::SeedableRng;
use rig_model::robot::{IRP6_TEMPLATE, MotorLimits, WristSensor};

use super::*;
use crate::criterion::Smoothing;
use crate::optimise::Round;
use crate::problem::Problem;
use crate::search::random_motion;
use crate::{PoseOptions, StagedKind, StagedOptions, poses, staged};

fn irp6() -> Robot {
    Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap()
}

fn options() -> Options {
    Options {
        harmonics: 2,
        starts: 2,
        criterion: Criterion::Determinant,
        ..Options::default()
    }
}

/// Lowest and highest angle, highest speed and highest torque of each motor at samples of a motion.
fn of_motors(robot: &Robot, file: &TrajectoryFile) -> Vec<([f64; 2], f64, f64)> {
    let model = Model::from_robot(robot).unwrap();
    let transmission = robot.transmission().unwrap();
    let n = robot.joints.len();
    let mut found = vec![([f64::INFINITY, f64::NEG_INFINITY], 0.0_f64, 0.0_f64); n];
    let duration = file.duration();
    for k in 0..=4000 {
        let t = duration * f64::from(k) / 4000.0;
        let at = |joint: &JointTrajectory| joint.trajectory.at(t);
        let q: Vec<f64> = file
            .joints
            .iter()
            .map(|j| j.start + at(j).position)
            .collect();
        let qd: Vec<f64> = file.joints.iter().map(|j| at(j).velocity).collect();
        let qdd: Vec<f64> = file.joints.iter().map(|j| at(j).acceleration).collect();
        let [mut tau, mut psi, mut psid, mut torque] = [(); 4].map(|()| vec![0.0; n]);
        model.inverse_dynamics(&q, &qd, &qdd, &mut tau).unwrap();
        transmission.motor_position(&q, &mut psi).unwrap();
        transmission.motor_velocity(&q, &qd, &mut psid).unwrap();
        transmission.motor_torque(&q, &tau, &mut torque).unwrap();
        for j in 0..n {
            let (range, speed, most) = &mut found[j];
            *range = [range[0].min(psi[j]), range[1].max(psi[j])];
            *speed = speed.max(psid[j].abs());
            *most = most.max(torque[j].abs());
        }
    }
    found
}

/// The IRp-6 with limits of its motors: angles and speeds below what a motion without them uses, and so the torque of
/// the column. The other torques hold gravity and friction for the most part, which no slower motion lowers.
fn limited() -> (Robot, Vec<([f64; 2], f64, f64)>) {
    let mut robot = irp6();
    let free = of_motors(&robot, &designed(&robot, &options()).file);
    let motors = robot.joints.iter_mut().zip(&free).enumerate();
    for (k, (joint, ([low, high], speed, torque))) in motors {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        joint.drive.as_mut().unwrap().limits = Some(MotorLimits {
            position: Some([middle - 0.8 * half, middle + 0.8 * half]),
            velocity: Some(0.7 * speed),
            torque: Some(if k == 0 { 0.85 } else { 1.5 } * torque),
        });
    }
    (robot, free)
}

#[test]
fn the_irp6_keeps_the_limits_of_its_motors() {
    let (robot, free) = limited();
    let found = designed(&robot, &options());
    assert_eq!(found.motors.len(), 5);
    let sampled = of_motors(&robot, &found.file);
    for (j, joint) in robot.joints.iter().enumerate() {
        let limits = joint.drive.as_ref().unwrap().limits.clone().unwrap();
        let ([low, high], speed, torque) = sampled[j];
        let [lowest, highest] = limits.position.unwrap();
        let name = &joint.name;
        assert!(lowest <= low && high <= highest, "{name}: {low} {high}");
        assert!(speed <= limits.velocity.unwrap(), "{name}: {speed}");
        assert!(torque <= limits.torque.unwrap(), "{name}: {torque}");
        // What is proved encloses the samples, and closely.
        let proved = &found.motors[j];
        let width = 0.02 * (highest - lowest);
        assert!(proved.position[0] <= low && low <= proved.position[0] + width);
        assert!(high <= proved.position[1] && proved.position[1] <= high + width);
        assert!(speed <= proved.velocity && proved.velocity <= 1.05 * speed);
        let most = proved.torque.unwrap();
        println!("{name}: torque {torque} N·m, proved {most} N·m");
        assert!(torque <= most && most <= limits.torque.unwrap());
        assert!(most <= 1.03 * torque, "{name}: {torque} {most}");
        // Without the limits the motion exceeds them.
        assert!(free[j].1 > limits.velocity.unwrap());
        assert!(j > 0 || free[j].2 > limits.torque.unwrap());
    }
}

#[test]
fn the_gradient_of_motor_limits_is_that_of_differences() {
    let (robot, _) = limited();
    let (frame, _, _) = frame_of(&robot, &options()).unwrap();
    let mut problem = Problem::new(&frame, 12, Smoothing(4));
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let x = random_motion(&mut problem, &frame, &mut random);
    let round = Round {
        weight: 10.0,
        smoothing: Smoothing(4),
        steps: 1,
    };
    problem.update(&x, &round);
    problem.press(30.0);
    gradient_is_that_of_differences(&mut problem, &x, 1e-5);
}

#[test]
fn a_simple_drive_narrows_the_limits_of_its_joint() {
    let mut robot = one_link();
    let limits = robot.joints[0].limits.clone().unwrap();
    let drive = robot.joints[0].drive.as_mut().unwrap();
    let ratio = drive.gear_ratio;
    drive.limits = Some(MotorLimits {
        velocity: Some(0.5 * limits.velocity * ratio),
        ..MotorLimits::default()
    });
    let found = designed(&robot, &options());
    assert!(found.reach[0].velocity <= 0.5 * limits.velocity);
    let note = found
        .notes
        .iter()
        .find(|n| n.contains("[joint.drive.limits]"));
    assert!(
        note.is_some_and(|n| n.contains("velocity")),
        "{:?}",
        found.notes
    );
    robot.joints[0].drive.as_mut().unwrap().limits = Some(MotorLimits {
        position: Some([1e5, 2e5]),
        ..MotorLimits::default()
    });
    let refused = design(&robot, &options(), |_, _| ()).unwrap_err();
    assert!(
        refused
            .to_string()
            .contains("between 100000 and 200000 rad"),
        "{refused}"
    );
}

/// No pose of the arm keeps these limits: no search begins, and the sentence has the numbers.
#[test]
fn limits_of_motors_that_no_pose_keeps_are_refused_before_the_search() {
    let robot = irp6();
    let searched = std::cell::Cell::new(false);
    let said = |name: &str, limits: MotorLimits| {
        let mut robot = robot.clone();
        let joint = robot.joint_index(name).unwrap();
        robot.joints[joint].drive.as_mut().unwrap().limits = Some(limits);
        match design(&robot, &options(), |_, _| searched.set(true)) {
            Err(error) => error.to_string(),
            Ok(_) => String::new(),
        }
    };
    let angle = |range| MotorLimits {
        position: Some(range),
        ..MotorLimits::default()
    };
    // A screw, whose ratio follows the pose, and a wrist that three motors move.
    for name in ["lower_arm", "wrist_turn"] {
        let text = said(name, angle([9e3, 1e4]));
        assert!(
            text.contains(name)
                && text.contains("9000 and 10000 rad")
                && text.contains("give a range"),
            "{text}"
        );
    }
    let torque = |limit| MotorLimits {
        torque: Some(limit),
        ..MotorLimits::default()
    };
    // Within the range of its crank the upper arm never points up or down, so its screw always carries it.
    let text = said("upper_arm", torque(1e-3));
    assert!(
        text.contains("upper_arm")
            && text.contains("0.00100 N·m")
            && text.contains("hold the arm")
            && text.contains("0.537 for gravity"),
        "{text}"
    );
    // The lower arm passes a pose of balance: what is left is the friction of its motor.
    let text = said("lower_arm", torque(0.05));
    assert!(
        text.contains("lower_arm") && text.contains("(0 for gravity, 0.0800 for friction)"),
        "{text}"
    );
    assert!(!searched.get());
}

/// Poses for a load are looked for within the ranges of the motors, and not at all if no pose keeps one.
#[test]
fn poses_for_a_load_keep_the_ranges_of_the_motors() {
    let mut robot = irp6();
    robot.wrist_sensor = Some(WristSensor::default());
    let options = PoseOptions {
        count: 4,
        start: None,
        margin: 0.05,
        speed_share: 0.8,
        seed: 1,
    };
    let joint = robot.joint_index("wrist_turn").unwrap();
    let found = |range| {
        let mut robot = robot.clone();
        robot.joints[joint].drive.as_mut().unwrap().limits = Some(MotorLimits {
            position: Some(range),
            ..MotorLimits::default()
        });
        poses(&robot, &options)
    };
    let text = found([9e3, 1e4]).unwrap_err().to_string();
    assert!(
        text.contains("wrist_turn") && text.contains("9000 and 10000 rad"),
        "{text}"
    );
    let motors = |q: &[f64]| {
        let mut angles = vec![0.0; q.len()];
        (robot.transmission().unwrap())
            .motor_position(q, &mut angles)
            .unwrap();
        angles[joint]
    };
    // Half of the range that poses without this limit use.
    let free = poses(&robot, &options).unwrap();
    let angles: Vec<f64> = free.positions.iter().map(|q| motors(q)).collect();
    let low = angles.iter().copied().fold(f64::INFINITY, f64::min);
    let high = angles.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let half = [low, 0.5 * (low + high)];
    let kept = found(half).unwrap();
    for q in &kept.positions {
        assert!(
            half[0] <= motors(q) && motors(q) <= half[1],
            "{half:?} {}",
            motors(q)
        );
    }
}

/// Limits below the Coulomb friction, or too slow for an hour, are named with joint and value, whatever the motion.
#[test]
fn limits_below_friction_or_without_speed_name_themselves() {
    let said = |limits: MotorLimits, kind: Option<StagedKind>| {
        let mut robot = one_link();
        robot.joints[0].drive.as_mut().unwrap().limits = Some(limits);
        let refused = match kind {
            None => design(&robot, &options(), |_, _| panic!("a search began")).unwrap_err(),
            Some(kind) => staged(&robot, kind, &StagedOptions::default()).unwrap_err(),
        };
        refused.to_string()
    };
    let kinds = [
        None,
        Some(StagedKind::Chirp),
        Some(StagedKind::Staircase),
        Some(StagedKind::Reversals),
        Some(StagedKind::Sweep),
    ];
    let joint = one_link().joints.remove(0);
    let coulomb = joint.friction.unwrap().coulomb / joint.drive.unwrap().gear_ratio;
    for kind in kinds {
        for share in [1e-6, 0.5, 0.99] {
            let torque = Some(share * coulomb);
            let text = said(
                MotorLimits {
                    torque,
                    ..MotorLimits::default()
                },
                kind,
            );
            assert!(
                text.contains("friction") && text.contains("torque limit"),
                "{kind:?}: {text}"
            );
        }
        let velocity = Some(1e-9);
        let text = said(
            MotorLimits {
                velocity,
                ..MotorLimits::default()
            },
            kind,
        );
        assert!(text.contains("velocity limit"), "{kind:?}: {text}");
    }
}

#[test]
fn a_motion_of_one_joint_keeps_the_limits_of_all_motors() {
    let mut robot = irp6();
    let upper = robot.joint_index("upper_arm").unwrap();
    let options = StagedOptions {
        joint: Some("upper_arm".into()),
        ..StagedOptions::default()
    };
    let made = |robot: &Robot| staged(robot, StagedKind::Staircase, &options);
    let (file, _) = made(&robot).unwrap();
    let free = of_motors(&robot, &file)[upper].1;
    robot.joints[upper].drive.as_mut().unwrap().limits = Some(MotorLimits {
        velocity: Some(0.6 * free),
        ..MotorLimits::default()
    });
    let (file, _) = made(&robot).unwrap();
    assert!(of_motors(&robot, &file)[upper].1 <= 0.6 * free);
    robot.joints[upper].drive.as_mut().unwrap().limits = Some(MotorLimits {
        torque: Some(1e-3),
        ..MotorLimits::default()
    });
    let refused = made(&robot).unwrap_err().to_string();
    assert!(
        refused.contains("motor torque") && refused.contains("upper_arm"),
        "{refused}"
    );
}
