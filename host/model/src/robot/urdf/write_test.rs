//! URDF written and read back: the same dynamics.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rig_shared::multibody::{column, inverse_dynamics};
use rig_shared::transmission::DriveKind;

use crate::robot::{
    Drive, EDDA_TEMPLATE, EMPS, IRP6_TEMPLATE, Inertial, Joint, JointFriction, JointKind,
    ONE_LINK_TEMPLATE, Robot, TX40, XL330,
};

/// A body of eight mass points.
pub(in crate::robot) fn body(rng: &mut Pcg64) -> Inertial {
    let mut inertial = Inertial {
        mass: 0.0,
        first_moment: [0.0; 3],
        inertia: [0.0; 6],
    };
    for _ in 0..8 {
        let m = rng.random_range(0.05..1.0);
        let [x, y, z]: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.4..0.5));
        inertial.mass += m;
        for (h, v) in inertial.first_moment.iter_mut().zip([x, y, z]) {
            *h += m * v;
        }
        let products = [
            y * y + z * z,
            -x * y,
            -x * z,
            x * x + z * z,
            -y * z,
            x * x + y * y,
        ];
        for (i, v) in inertial.inertia.iter_mut().zip(products) {
            *i += m * v;
        }
    }
    inertial
}

/// A simple drive with its rotor.
fn drive(rng: &mut Pcg64) -> Drive {
    let gear_ratio = [1.0, -48.0, 120.0][rng.random_range(0..3)];
    Drive {
        gear_ratio,
        rotor_inertia: rng.random_range(0.0..1.0) / (gear_ratio * gear_ratio),
        joint_inertia: rng.random_range(0.0..0.5),
        ..Drive::default()
    }
}

fn random(rng: &mut Pcg64) -> Robot {
    let n = rng.random_range(1..8);
    let quarter = std::f64::consts::FRAC_PI_2;
    let joints = (0..n)
        .map(|k| Joint {
            name: format!("<joint \"{k}\" & more>"),
            kind: if rng.random_bool(0.7) {
                JointKind::Revolute
            } else {
                JointKind::Prismatic
            },
            alpha: if rng.random_bool(0.6) {
                quarter * rng.random_range(-2..3) as f64
            } else {
                rng.random_range(-3.0..3.0)
            },
            a: if rng.random_bool(0.3) {
                0.0
            } else {
                rng.random_range(-0.5..0.5)
            },
            theta: if rng.random_bool(0.4) {
                quarter * rng.random_range(-2..3) as f64
            } else {
                rng.random_range(-3.0..3.0)
            },
            d: rng.random_range(-0.5..0.5),
            inertial: Some(body(rng)),
            limits: None,
            friction: Some(JointFriction {
                coulomb: rng.random_range(0.0..2.0),
                viscous: rng.random_range(0.0..2.0),
                offset: 0.0,
            }),
            drive: rng.random_bool(0.6).then(|| drive(rng)),
            controller: None,
            voltage_controller: None,
        })
        .collect();
    let direction: [f64; 3] = if rng.random_bool(0.3) {
        [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]][rng.random_range(0..3)]
    } else {
        std::array::from_fn(|_| rng.random_range(-1.0..1.0))
    };
    let size = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    Robot {
        gravity: direction.map(|v| v / size * 9.81),
        ..Robot::new("r & d", joints)
    }
}

fn torques(robot: &Robot, coupled: &[bool], [q, qd, qdd]: [&[f64]; 3]) -> Vec<f64> {
    let chain = robot.chain().unwrap();
    let mut parameters = robot.standard_parameters();
    for (row, coupled) in parameters.iter_mut().zip(coupled) {
        // URDF holds neither a constant torque nor the inertia of coupled drives.
        row[column::OFFSET] = 0.0;
        if *coupled {
            row[column::DRIVE_INERTIA] = 0.0;
        }
    }
    let mut tau = vec![f64::NAN; q.len()];
    inverse_dynamics(&chain, &parameters, q, qd, qdd, &mut tau).unwrap();
    tau
}

fn same_dynamics(robot: &Robot, rng: &mut Pcg64) {
    let text = robot.to_urdf().unwrap().text;
    let mut back = Robot::from_urdf(&text, Path::new("r.urdf")).unwrap();
    // URDF states the direction of gravity but not its size; the size is in a comment of the file.
    let size = |g: [f64; 3]| g.iter().map(|x| x * x).sum::<f64>().sqrt();
    let times = size(robot.gravity) / size(back.gravity);
    back.gravity = back.gravity.map(|x| x * times);
    let names = |r: &Robot| r.joints.iter().map(|j| j.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&back), names(robot));
    let coupled: Vec<bool> = (robot.drive_kinds().iter())
        .map(|kind| *kind != DriveKind::Simple)
        .collect();
    // A coupled rotor also turns with joints of other drives.
    let mut without_coupled = robot.clone();
    for (joint, coupled) in without_coupled.joints.iter_mut().zip(&coupled) {
        if let Some(drive) = joint.drive.as_mut().filter(|_| *coupled) {
            drive.rotor_inertia = 0.0;
        }
    }
    for _ in 0..5 {
        let mut signal = |range: f64| -> Vec<f64> {
            (0..robot.joints.len())
                .map(|_| rng.random_range(-range..range))
                .collect()
        };
        let (q, qd, qdd) = (signal(3.0), signal(3.0), signal(10.0));
        let [a, b] = [&without_coupled, &back].map(|r| torques(r, &coupled, [&q, &qd, &qdd]));
        let scale = a.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        for (x, y) in a.iter().zip(&b) {
            assert!((x - y).abs() < 1e-7 * scale, "{a:?} {b:?}\n{text}");
        }
    }
}

#[test]
fn what_is_written_reads_back_with_the_same_dynamics() {
    let mut rng = Pcg64::seed_from_u64(23);
    for _ in 0..150 {
        let robot = random(&mut rng);
        same_dynamics(&robot, &mut rng);
    }
    for text in [
        IRP6_TEMPLATE,
        TX40,
        ONE_LINK_TEMPLATE,
        EMPS,
        XL330,
        EDDA_TEMPLATE,
    ] {
        let mut robot = Robot::from_toml(text, Path::new("r.toml")).unwrap();
        for joint in &mut robot.joints {
            joint.inertial.get_or_insert(Inertial {
                mass: 95.0,
                first_moment: [0.0; 3],
                inertia: [0.0; 6],
            });
        }
        same_dynamics(&robot, &mut rng);
    }
}

#[test]
fn limits_drives_and_what_is_left_out_are_told() {
    let robot = Robot::from_toml(TX40, Path::new("r.toml")).unwrap();
    let urdf = robot.to_urdf().unwrap();
    let back = Robot::from_urdf(&urdf.text, Path::new("r.urdf")).unwrap();
    for (a, b) in robot.joints.iter().zip(&back.joints) {
        assert_eq!(a.limits, b.limits);
    }
    let mut soft = robot.clone();
    let [low, high] = soft.joints[0].limits.as_ref().unwrap().position;
    soft.joints[0].limits.as_mut().unwrap().soft_position = Some([0.9 * low, 0.8 * high]);
    soft.joints[0].limits.as_mut().unwrap().acceleration = Some(12.5);
    let written = soft.to_urdf().unwrap().text;
    let read = Robot::from_urdf(&written, Path::new("r.urdf")).unwrap();
    assert_eq!(read.joints[0].limits, soft.joints[0].limits);
    let text = soft.to_toml().unwrap();
    let read = Robot::from_toml(&text, Path::new("r.toml")).unwrap();
    assert_eq!(read.joints[0].limits, soft.joints[0].limits);
    let text = text.replace(
        &format!("soft_position = [{:?}", 0.9 * low),
        "soft_position = [-99.0",
    );
    let wrong = Robot::from_toml(&text, Path::new("r.toml"))
        .unwrap_err()
        .to_string();
    assert!(wrong.contains("soft position range"), "{wrong}");
    assert_eq!(back.joints[3].drive.as_ref().unwrap().gear_ratio, -48.0);
    assert!(back.joints[5].drive.is_none());
    assert!(
        urdf.remarks
            .iter()
            .any(|r| r.contains("several joints") && r.contains("joint_6"))
    );
    let irp6 = Robot::from_toml(IRP6_TEMPLATE, Path::new("r.toml")).unwrap();
    let urdf = irp6.to_urdf().unwrap();
    let message = urdf.remarks.join(" ");
    assert!(
        message.contains("inertia of the drives, seen at the joints: lower_arm 1.638 kg*m^2,"),
        "{message}"
    );
    // The column has a drive of its own, whose rotor the file holds.
    let back = Robot::from_urdf(&urdf.text, Path::new("r.urdf")).unwrap();
    let own = |robot: &Robot| robot.standard_parameters()[0][column::DRIVE_INERTIA];
    assert!(own(&irp6) > 4.0 && (own(&back) / own(&irp6) - 1.0).abs() < 1e-12);
}

#[test]
fn a_link_without_inertia_cannot_be_written() {
    let mut robot = Robot::from_toml(TX40, Path::new("r.toml")).unwrap();
    robot.joints[2].inertial = None;
    let message = robot.to_urdf().unwrap_err().to_string();
    assert!(
        message.contains("`joint_3` has no [joint.inertial]"),
        "{message}"
    );
}
