//! Descriptions of coupled drives: reading, refusal by name, writing, and the robots of the book.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use rig_shared::multibody::column;
use rig_shared::transmission::{DriveKind, motor_column};

use super::*;

fn load(text: &str) -> Result<Robot, RobotError> {
    Robot::from_toml(text, Path::new("r.toml"))
}

fn error_of(text: &str) -> String {
    load(text).unwrap_err().to_string()
}

#[test]
fn the_descriptions_that_come_with_the_program_load_and_are_written_back_equal() {
    for kind in ["one-link", "edda", "irp6", "emps", "tx40", "xl330"] {
        let robot = load(template(kind).unwrap()).unwrap();
        let written = robot.to_toml().unwrap();
        assert_eq!(load(&written).unwrap(), robot, "{written}");
        robot.transmission().unwrap();
    }
}

#[test]
fn the_irp6_turns_its_motors_as_published() {
    let robot = load(IRP6_TEMPLATE).unwrap();
    let t = robot.transmission().unwrap();
    assert_eq!(
        robot.drive_kinds(),
        [
            DriveKind::Simple,
            DriveKind::Varying,
            DriveKind::Varying,
            DriveKind::Coupled,
            DriveKind::Coupled
        ]
    );
    for (k, kind) in robot.drive_kinds().into_iter().enumerate() {
        assert_eq!(t.kind(k), Some(kind));
    }
    let right = std::f64::consts::FRAC_PI_2;
    // Absolute angles, and their published functions in mm.
    for (p1, p2, p3, p4, p5) in [
        (0.0, -right, 0.0, 0.0, 0.0),
        (1.0, -2.0, 0.3, -0.8, 0.5),
        (-2.0, -1.0, -0.3, 0.9, -1.5),
    ] {
        let q = [p1, p2, p3 - p2 - right, p4 - p3, p5];
        let screw = |m: f64, n: f64, p: f64, sync: f64| {
            let length = (77_895.25 + m * p.cos() - n * p.sin()).sqrt();
            std::f64::consts::TAU / 5.0 * (length - sync)
        };
        let psi4 = -128.0 * p4;
        let expected = [
            -158.0 * p1,
            screw(60_902.55, -29_346.68, p2, 220.3374),
            screw(-44_100.0, -51_240.0, p3, 183.8348),
            psi4,
            -128.0 * 0.6 * p5 + psi4,
        ];
        let mut psi = [0.0; 5];
        t.motor_position(&q, &mut psi).unwrap();
        for (got, want) in psi.iter().zip(expected) {
            assert!((got - want).abs() < 2e-5, "{psi:?} {expected:?}");
        }
    }
}

#[test]
fn drives_go_into_the_parameters_as_the_columns_want_them() {
    let robot = load(IRP6_TEMPLATE).unwrap();
    let (joints, motors) = (robot.standard_parameters(), robot.motor_parameters());
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} {b}");
    // Motors 4 and 5 add to the diagonals of joints 2, 3 (both) and 4 (motor 5); those of the screws are separate.
    near(joints[0][column::DRIVE_INERTIA], 158.0 * 158.0 * 2e-4);
    near(joints[1][column::DRIVE_INERTIA], 2.0 * 128.0 * 128.0 * 5e-5);
    near(joints[3][column::DRIVE_INERTIA], 128.0 * 128.0 * 5e-5);
    near(joints[4][column::DRIVE_INERTIA], 0.0);
    near(joints[4][column::VISCOUS], 0.4 + 76.8 * 76.8 * 1e-4);
    near(motors[1][motor_column::INERTIA], 2e-4);
    near(motors[1][motor_column::COULOMB], 0.08);
    near(motors[4][motor_column::INERTIA], 76.8 * 76.8 * 5e-5);
    near(motors[4][motor_column::COULOMB], 76.8 * 0.03);
    assert_eq!(motors[0], [0.0; 3]);
    let t = robot.transmission().unwrap();
    let own: Vec<bool> = (0..5).map(|k| t.has_joint_inertia(k)).collect();
    assert_eq!(own, [true, true, true, true, false]);
}

#[test]
fn the_recorded_start_of_the_tx40_is_its_zero() {
    let robot = load(TX40).unwrap();
    let mut q = robot.middle_position();
    let t = robot.transmission().unwrap();
    let first = [3.1958e-5, 50.265, -70.685, 0.0, 0.0, -0.000_287_62];
    t.joint_position(&first, &mut q).unwrap();
    assert!(q.iter().all(|x| x.abs() < 5e-5), "{q:?}");
    // Rᵗ as published: motor 6 works on joints 5 and 6.
    let mut tau = [0.0; 6];
    t.joint_torque(&q, &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0], &mut tau)
        .unwrap();
    assert_eq!(tau, [0.0, 0.0, 0.0, 0.0, 32.0, 32.0]);
}

#[test]
fn wrong_drives_are_named_by_line_and_mend() {
    let cases: [(&str, &str, &[&str]); 12] = [
        (
            "couples = { joint_5 = 32.0 }",
            "couples = { joint_7 = 32.0 }",
            &["`joint_7`", "joints are joint_1, joint_2"],
        ),
        (
            "couples = { joint_5 = 32.0 }",
            "couples = { joint_6 = 32.0 }",
            &["`joint_6` itself", "gear_ratio"],
        ),
        (
            "couples = { joint_5 = 32.0 }",
            "couples = { joint_5 = inf }",
            &["ratio of joint `joint_5` in the drive of joint `joint_6` is inf"],
        ),
        (
            "gear_ratio = 45.0 ",
            "gear_ratio = 0.0 ",
            &["gear ratio of joint `joint_3` is 0", "different from 0"],
        ),
        (
            "gear_ratio = 45.0 ",
            "encoder_counts_per_rev = 4096.0 ",
            &["missing field `gear_ratio`", "[joint.drive.screw]"],
        ),
        (
            "gear_ratio = 45.0 ",
            "viscous = -0.1\ngear_ratio = 45.0 ",
            &["viscous friction of the motor of joint `joint_3` is -0.1"],
        ),
        (
            "lead = 0.005",
            "lead = 0.0",
            &["lead of the screw of joint `lower_arm` is 0"],
        ),
        (
            "angle = { lower_arm = 1.0 }",
            "angle = { column = 1.0 }",
            &[
                "crank of joint `lower_arm` is other joints only",
                "lower_arm = 1.0",
            ],
        ),
        (
            "angle = { lower_arm = 1.0, upper_arm = 1.0 }",
            "angle = { lower_arm = 1.0, elbow = 1.0 }",
            &["`elbow`", "upper_arm"],
        ),
        (
            "range = [-3.578, -2.182]",
            "range = [-2.182, -3.578]",
            &["range of the crank of joint `lower_arm`"],
        ),
        (
            "range = [-3.578, -2.182]",
            "range = [-4.1, -2.182]",
            &[
                "screw of joint `lower_arm` is 0 where its crank is at -4.0",
                "dead centre",
            ],
        ),
        (
            "lead = 0.005",
            "gear = 1\nlead = 0.005",
            &["unknown field `gear`"],
        ),
    ];
    for (old, new, parts) in cases {
        let text = [TX40, IRP6_TEMPLATE]
            .into_iter()
            .find(|t| t.contains(old))
            .unwrap();
        let message = error_of(&text.replacen(old, new, 1));
        assert!(
            message.starts_with("r.toml:") && !message.contains('\n'),
            "{message}"
        );
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
    }
    let line = |text: &str, what: &str| {
        let at = text.find(what).unwrap();
        format!("r.toml:{}:", text[..at].matches('\n').count() + 1)
    };
    let text = TX40.replace("joint_5 = 32.0", "joint_7 = 32.0");
    assert!(error_of(&text).starts_with(&line(&text, "joint_7")));
    let text = ONE_LINK_TEMPLATE.replace("coulomb = 0.4", "coulomb = -0.4");
    let message = error_of(&text);
    assert!(message.starts_with(&line(&text, "coulomb")), "{message}");
    assert!(
        message.contains("Coulomb friction of joint `link` is -0.4"),
        "{message}"
    );
}

#[test]
fn motors_that_turn_alike_are_refused_with_the_joint_at_fault() {
    // Motor 5 like motor 6: 32·q5 + 32·q6 for both.
    let mut robot = load(TX40).unwrap();
    let drive = robot.joints[4].drive.as_mut().unwrap();
    drive.gear_ratio = 32.0;
    drive.couples.insert("joint_6".to_owned(), 32.0);
    let message = error_of(&robot.to_toml().unwrap());
    assert!(
        message.contains("drive of joint `joint_6` is singular"),
        "{message}"
    );
}

#[test]
fn a_description_takes_its_own_parameters_back() {
    for text in [ONE_LINK_TEMPLATE, IRP6_TEMPLATE, TX40, EDDA_TEMPLATE] {
        let robot = load(text).unwrap();
        let (mut rows, mut motors) = (robot.standard_parameters(), robot.motor_parameters());
        let t = robot.transmission().unwrap();
        for (k, row) in rows.iter_mut().enumerate() {
            row[0] += 1.0;
            row[column::OFFSET] = 0.1;
            row[column::COULOMB] += 0.5;
            row[column::VISCOUS] += 1.5;
            // More than the contribution of the other motors, or less.
            let more = if t.has_joint_inertia(k) {
                f64::max(0.7 - 0.3 * k as f64, -0.5 * row[column::DRIVE_INERTIA])
            } else {
                0.0
            };
            row[column::DRIVE_INERTIA] += more;
        }
        for (k, motor) in motors.iter_mut().enumerate() {
            if t.kind(k) != Some(DriveKind::Simple) {
                motor[motor_column::INERTIA] *= 1.1;
                motor[motor_column::COULOMB] += 0.01;
            }
        }
        let (changed, remarks) = robot.with_parameters(&rows, &motors);
        assert!(remarks.is_empty(), "{remarks:?}");
        let same = |a: &[f64], b: &[f64]| {
            for (x, y) in a.iter().zip(b) {
                assert!((x - y).abs() < 1e-12 * x.abs().max(1.0), "{a:?} {b:?}");
            }
        };
        same(
            changed.standard_parameters().as_flattened(),
            rows.as_flattened(),
        );
        same(
            changed.motor_parameters().as_flattened(),
            motors.as_flattened(),
        );
        assert_eq!(load(&changed.to_toml().unwrap()).unwrap(), changed);
    }
    let robot = load(TX40).unwrap();
    let mut rows = robot.standard_parameters();
    rows[1][column::COULOMB] = -0.2;
    let (changed, remarks) = robot.with_parameters(&rows, &robot.motor_parameters());
    assert!(remarks[0].contains("Coulomb friction of joint joint_2 came out as -0.2"));
    assert_eq!(changed.joints[1].friction.as_ref().unwrap().coulomb, 0.0);
}

#[test]
fn limits_of_motors_are_read_written_and_checked() {
    let with = |limits: &str| {
        let text = format!(
            "{}\n[joint.drive.limits]\n{limits}\n",
            crate::robot::IRP6_TEMPLATE
        );
        Robot::from_toml(&text, std::path::Path::new("irp6.toml"))
    };
    let robot = with("position = [-30.0, 40.0]\nvelocity = 300.0\ntorque = 0.9").unwrap();
    let limits = robot.joints[4]
        .drive
        .as_ref()
        .unwrap()
        .limits
        .clone()
        .unwrap();
    assert_eq!(limits.position, Some([-30.0, 40.0]));
    let text = robot.to_toml().unwrap();
    assert!(text.contains("of the motor"), "{text}");
    let back = Robot::from_toml(&text, std::path::Path::new("irp6.toml")).unwrap();
    assert_eq!(back.joints[4].drive.as_ref().unwrap().limits, Some(limits));
    let told = robot.to_urdf().unwrap().remarks.join(" ");
    assert!(told.contains("limits of the motors") && told.contains("wrist_turn"));
    for (wrong, word) in [
        ("position = [40.0, -30.0]", "range of the motor"),
        ("velocity = 0.0", "speed limit of the motor"),
        ("torque = -1.0", "torque limit of the motor"),
        ("current = 3.0", "current"),
    ] {
        let said = with(wrong).unwrap_err().to_string();
        assert!(said.contains(word) && said.contains("irp6.toml"), "{said}");
    }
}
