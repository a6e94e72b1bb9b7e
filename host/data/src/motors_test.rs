//! Recordings made on the motor side.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::{DataError, EffortNeed, Place, Source};
use rig_model::robot::{IRP6_TEMPLATE, Robot, TX40};
use rig_output::data_dir;

fn robot(text: &str) -> Robot {
    Robot::from_toml(text, Path::new("r.toml")).unwrap()
}

fn file(dir: &tempfile::TempDir, text: &str) -> PathBuf {
    let path = dir.path().join("data.csv");
    std::fs::write(&path, text).unwrap();
    path
}

/// Motion of an IRp-6 through its range: positions and torques of joints and motors.
fn irp6_motion(robot: &Robot, rows: usize) -> Vec<[[f64; 5]; 4]> {
    let t = robot.transmission().unwrap();
    let right = std::f64::consts::FRAC_PI_2;
    (0..rows)
        .map(|k| {
            let x = |rate: f64| (rate * k as f64 / rows as f64 * std::f64::consts::TAU).sin();
            let (p2, p3, p4) = (-1.57 + 0.65 * x(3.0), 0.13 + 0.5 * x(5.0), 0.9 * x(2.0));
            let q = [2.0 * x(1.0), p2, p3 - p2 - right, p4 - p3, 1.5 * x(4.0)];
            let tau_motor = [x(7.0), 2.0 * x(2.5), -x(3.5), 0.3 * x(6.0), 0.2 * x(1.5)];
            let (mut psi, mut tau) = ([0.0; 5], [0.0; 5]);
            t.motor_position(&q, &mut psi).unwrap();
            t.joint_torque(&q, &tau_motor, &mut tau).unwrap();
            [q, tau, psi, tau_motor]
        })
        .collect()
}

fn header(quantities: &[&str]) -> String {
    let mut text = String::from("t");
    for quantity in quantities {
        for k in 1..=5 {
            let _ = write!(text, ",{quantity}{k}");
        }
    }
    text + "\n"
}

fn row(text: &mut String, k: usize, values: &[[f64; 5]]) {
    let _ = write!(text, "{}", k as f64 * 0.01);
    for value in values.as_flattened() {
        let _ = write!(text, ",{value:?}");
    }
    text.push('\n');
}

#[test]
fn motor_positions_and_torques_become_the_joints_block_by_block() {
    let robot = robot(IRP6_TEMPLATE);
    let motion = irp6_motion(&robot, 300);
    let dir = tempfile::tempdir().unwrap();
    let mut text = header(&["qm", "taum"]);
    for (k, [_, _, psi, tau_motor]) in motion.iter().enumerate() {
        row(&mut text, k, &[*psi, *tau_motor]);
    }
    let source = Source::open(&file(&dir, &text), &robot).unwrap();
    for rows in [7, 1000] {
        let mut at = 0;
        for block in source.blocks(rows) {
            let block = block.unwrap();
            for i in 0..block.len() {
                let [q, tau, ..] = motion[at];
                for j in 0..5 {
                    assert!((block.joints[j].q[i] - q[j]).abs() < 1e-11);
                    assert!((block.joints[j].tau[i] - tau[j]).abs() < 1e-9 * 400.0);
                }
                at += 1;
            }
        }
        assert_eq!(at, motion.len());
    }
}

#[test]
fn currents_of_coupled_drives_pass_the_jacobian_at_the_recorded_position() {
    let robot = robot(IRP6_TEMPLATE);
    let motion = irp6_motion(&robot, 50);
    let dir = tempfile::tempdir().unwrap();
    let mut text = header(&["q", "i"]);
    for (k, [q, _, _, tau_motor]) in motion.iter().enumerate() {
        let mut current = *tau_motor;
        for (i, joint) in current.iter_mut().zip(&robot.joints) {
            *i /= joint.drive.as_ref().unwrap().torque_constant;
        }
        row(&mut text, k, &[*q, current]);
    }
    let (blocks, _) = Source::open(&file(&dir, &text), &robot)
        .unwrap()
        .read_all()
        .unwrap();
    for (i, [q, tau, ..]) in motion.iter().enumerate() {
        for j in 0..5 {
            assert_eq!(blocks[0].joints[j].q[i], q[j]);
            assert!((blocks[0].joints[j].tau[i] - tau[j]).abs() < 1e-9 * 400.0);
        }
    }
}

#[test]
fn what_the_drives_cannot_turn_is_named_by_line_and_column() {
    let robot = robot(IRP6_TEMPLATE);
    let motion = irp6_motion(&robot, 40);
    let dir = tempfile::tempdir().unwrap();
    let mut text = header(&["qm", "taum"]);
    for (k, [_, _, psi, tau_motor]) in motion.iter().enumerate() {
        let mut psi = *psi;
        if k == 20 {
            // Longer than the reach of crank and anchor.
            psi[1] += 400.0;
        }
        row(&mut text, k, &[psi, *tau_motor]);
    }
    let path = file(&dir, &text);
    let error = Source::open(&path, &robot).unwrap().read_all().unwrap_err();
    assert!(matches!(
        error,
        DataError::Motors {
            place: Place::Line(22),
            ..
        }
    ));
    let message = error.to_string();
    assert!(
        message.contains("data.csv:22: ") && message.contains("screw of drive 2"),
        "{message}"
    );

    let refused = |text: &str| {
        Source::open(&file(&dir, text), &robot)
            .unwrap_err()
            .to_string()
    };
    let message = refused("t,q1,q2,q3,qm4,qm5,tau1,tau2,tau3,tau4,tau5\n");
    assert!(
        message.contains("neither `q4`") && message.contains("nor `qm1`"),
        "{message}"
    );
    let message = refused("t,q1,q2,q3,q4,q5,taum1,taum2,taum3,taum4,tau5\n");
    assert!(
        message.contains("no `tau2`") && message.contains("motor 5"),
        "{message}"
    );
    let message = refused("t,q1,q2,q3,q4,q5,tau1,tau2,tau3,tau4\n");
    assert!(
        message.contains("neither `tau5`") && message.contains("`taum5`"),
        "{message}"
    );
    let optional = file(&dir, "t,q1,q2,q3,q4,q5\n0,0,-1.5,0,0,0\n");
    let source = Source::open_with(&optional, &robot, EffortNeed::Optional).unwrap();
    assert!(source.read_all().unwrap().0[0].joints[1].tau.is_empty());
}

#[test]
fn the_published_recording_of_the_tx40_is_read_as_its_authors_read_it() {
    let Some(data) = data_dir() else {
        println!("no real recordings here (set RIG_DATA): nothing compared");
        return;
    };
    let robot = robot(TX40);
    let source = Source::open(&data.join("staubli_tx40/motor_1kHz.csv"), &robot).unwrap();
    let (blocks, _) = source.read_all().unwrap();
    let text = std::fs::read_to_string(source.path()).unwrap();
    let mut lines = text.lines().skip(1);
    let half = std::f64::consts::FRAC_PI_2;
    for block in &blocks {
        for i in 0..block.len() {
            let v: Vec<f64> = lines
                .next()
                .unwrap()
                .split(',')
                .map(|w| w.parse().unwrap())
                .collect();
            let (m, t) = (&v[1..7], &v[7..13]);
            // R⁻¹·qm and Rᵗ·taum by hand.
            let q = [
                m[0] / 32.0,
                m[1] / 32.0 - half,
                m[2] / 45.0 + half,
                -m[3] / 48.0,
                m[4] / 45.0,
                m[5] / 32.0 - m[4] / 45.0,
            ];
            let tau = [
                32.0 * t[0],
                32.0 * t[1],
                45.0 * t[2],
                -48.0 * t[3],
                45.0 * t[4] + 32.0 * t[5],
                32.0 * t[5],
            ];
            for j in 0..6 {
                assert!((block.joints[j].q[i] - q[j]).abs() < 1e-12);
                assert!((block.joints[j].tau[i] - tau[j]).abs() < 1e-11);
            }
        }
    }
    assert!(lines.next().is_none());
}

#[test]
fn coupled_motors_are_named_with_the_column_they_make() {
    let robot = robot(IRP6_TEMPLATE);
    let dir = tempfile::tempdir().unwrap();
    let mut text = header(&["qm", "taum"]);
    for (k, values) in irp6_motion(&robot, 20).into_iter().enumerate() {
        let [_, _, psi, tau_motor] = values;
        row(&mut text, k, &[psi, tau_motor]);
    }
    let source = Source::open(&file(&dir, &text), &robot).unwrap();
    let names = |joint| source.column_name(joint, super::Quantity::Effort);
    assert_eq!(names(0), "taum1");
    assert!(
        (1..5).any(|joint| names(joint).contains(&format!("tau{} (from taum", joint + 1))),
        "{:?}",
        (0..5).map(names).collect::<Vec<_>>()
    );
}
