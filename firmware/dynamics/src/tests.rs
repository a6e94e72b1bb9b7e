#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::Path;

use rig_model::robot::{IRP6_TEMPLATE, Robot};
use rig_model::simulate::Model;

use crate::{Arm, JOINTS, states};

fn robot() -> Robot {
    Robot::from_toml(IRP6_TEMPLATE, Path::new("irp6.toml")).unwrap()
}

fn list(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    format!("[{}]", values.join(", "))
}

/// The numbers of the description as source text.
fn source(robot: &Robot) -> String {
    let mut out = String::from(
        "//! The IRp-6 of `rig init irp6` as numbers. Written by the test of this crate (`RIG_WRITE_DOCS=1 cargo test -p\n//! rig-dynamics`), which compares it with the description. Do not edit it.\n#![allow(clippy::excessive_precision, clippy::approx_constant, clippy::unreadable_literal)]\n#![cfg_attr(rustfmt, rustfmt_skip)]\n\nuse rig_shared::multibody::{COLUMNS, JointGeometry, JointKind};\nuse rig_shared::transmission::{DriveMap, MOTOR_COLUMNS, ScrewMap};\n\n",
    );
    let n = robot.joints.len();
    let _ = writeln!(
        out,
        "/// Number of joints.\npub const JOINTS: usize = {n};\n"
    );
    let _ = writeln!(
        out,
        "/// Gravity in the base frame, m/s².\npub const GRAVITY: [f64; 3] = {};\n",
        list(&robot.gravity)
    );
    out += "/// Frames of the joints.\npub const GEOMETRY: [JointGeometry; JOINTS] = [\n";
    for joint in robot.geometry() {
        let _ = writeln!(
            out,
            "    JointGeometry {{ kind: JointKind::{:?}, alpha: {:?}, a: {:?}, theta: {:?}, d: {:?} }},",
            joint.kind, joint.alpha, joint.a, joint.theta, joint.d
        );
    }
    out += "];\n\n/// Parameters of links and joints, in the order of `COLUMN_NAMES`.\npub const PARAMETERS: [[f64; COLUMNS]; JOINTS] = [\n";
    for row in robot.standard_parameters() {
        let _ = writeln!(out, "    {},", list(&row));
    }
    out += "];\n\n/// Parameters of the motors, in the order of `MOTOR_COLUMN_NAMES`.\npub const MOTORS: [[f64; MOTOR_COLUMNS]; JOINTS] = [\n";
    for row in robot.motor_parameters() {
        let _ = writeln!(out, "    {},", list(&row));
    }
    out += "];\n\n/// Motors as functions of the joints.\npub const DRIVES: [DriveMap<'static>; JOINTS] = [\n";
    robot
        .with_drive_maps(|maps| {
            for map in maps {
                let screw = map.screw.map_or("None".to_owned(), |s| {
                    format!(
                        "Some(ScrewMap {{ lead: {:?}, constant: {:?}, cosine: {:?}, sine: {:?}, weights: &{}, offset: {:?} }})",
                        s.lead, s.constant, s.cosine, s.sine, list(s.weights), s.offset
                    )
                });
                let _ = writeln!(
                    out,
                    "    DriveMap {{ ratios: &{}, screw: {screw}, zero: {:?}, joint_inertia: {} }},",
                    list(map.ratios), map.zero, map.joint_inertia
                );
            }
        });
    out += "];\n\n/// Lowest and highest position of each joint, rad.\npub const RANGES: [[f32; 2]; JOINTS] = [\n";
    for joint in &robot.joints {
        let _ = writeln!(
            out,
            "    {},",
            list(&joint.limits.as_ref().unwrap().position)
        );
    }
    out += "];\n";
    out
}

#[test]
fn the_numbers_are_those_of_the_description() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/irp6.rs");
    let expected = source(&robot());
    if std::env::var_os("RIG_WRITE_DOCS").is_some() {
        std::fs::write(&path, expected).unwrap();
    } else {
        let found = std::fs::read_to_string(&path).unwrap();
        assert_eq!(found, expected, "run this test with RIG_WRITE_DOCS=1");
    }
}

/// In f64 the functions agree with the model that the desktop's commands use, and forward inverts inverse.
#[test]
fn dynamics_are_those_of_the_description() {
    let robot = robot();
    let model = Model::from_robot(&robot).unwrap();
    let transmission = robot.transmission().unwrap();
    let arm = Arm::<f64>::irp6().unwrap();
    let single = Arm::<f32>::irp6().unwrap();
    let mut worst = 0.0_f64;
    for state in states() {
        let [q, qd, qdd] = [state.q, state.qd, state.qdd].map(|x| x.map(f64::from));
        let (mut tau, mut expected) = ([0.0; JOINTS], [0.0; JOINTS]);
        model.inverse_dynamics(&q, &qd, &qdd, &mut tau).unwrap();
        transmission.motor_torque(&q, &tau, &mut expected).unwrap();
        let motor = arm.motor_torque(&q, &qd, &qdd).unwrap();
        let size = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (a, b) in motor.iter().zip(expected) {
            assert!((a - b).abs() < 1e-12 * size, "{motor:?} {expected:?}");
        }
        let back = arm.acceleration(&q, &qd, &motor).unwrap();
        for (a, b) in back.iter().zip(qdd) {
            assert!((a - b).abs() < 1e-9, "{back:?} {qdd:?}");
        }
        let free = arm
            .articulated(&q, &qd, &arm.joint_torque(&q, &qd, &qdd).unwrap())
            .unwrap();
        for (a, b) in free.iter().zip(qdd) {
            assert!((a - b).abs() < 1e-9, "{free:?} {qdd:?}");
        }
        // In f32 the torques are within single precision of a few sums.
        let rounded = single
            .motor_torque(&state.q, &state.qd, &state.qdd)
            .unwrap();
        for (a, b) in rounded.iter().zip(motor) {
            worst = worst.max((f64::from(*a) - b).abs() / size);
        }
    }
    println!("f32 against f64: {worst:e} of the largest torque");
    assert!(worst < 1e-4, "{worst}");
}
