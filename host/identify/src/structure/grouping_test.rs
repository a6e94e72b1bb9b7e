//! The rules compared with the numeric method, and both with published counts.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rig_shared::multibody::{COLUMNS, column};

use super::{agree, grouped};
use crate::{Base, ModelKind};
use rig_model::robot::{Drive, EDDA_TEMPLATE, IRP6_TEMPLATE, Joint, JointKind, Robot, TX40};

fn joint(number: usize, kind: JointKind, geometry: [f64; 4]) -> Joint {
    Joint::new(&format!("joint_{number}"), kind, geometry)
}

fn robot(gravity: [f64; 3], joints: Vec<Joint>) -> Robot {
    Robot {
        gravity,
        ..Robot::new("chain", joints)
    }
}

/// Revolute joints by their α, a, d.
fn arm(gravity: [f64; 3], rows: &[[f64; 3]]) -> Robot {
    let joints = rows
        .iter()
        .enumerate()
        .map(|(k, [alpha, a, d])| joint(k + 1, JointKind::Revolute, [*alpha, *a, 0.0, *d]))
        .collect();
    robot(gravity, joints)
}

/// Returns the numbers of inertial parameters and of drive inertias; asserts that both methods agree.
fn counts(robot: &Robot) -> (usize, usize) {
    let rules = grouped(robot).unwrap();
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let numeric = Base::structural(robot, model, 7).unwrap();
        assert!(
            agree(&rules, &numeric),
            "{model:?}: rules {} {:?}, numeric {} {:?} for {robot:?}",
            rules.len(),
            rules
                .columns
                .iter()
                .map(|c| rules.column_name(*c))
                .collect::<Vec<_>>(),
            numeric.len(),
            numeric
                .columns
                .iter()
                .map(|c| numeric.column_name(*c))
                .collect::<Vec<_>>(),
        );
    }
    let inertial = |c: &&usize| **c % COLUMNS < column::DRIVE_INERTIA;
    let drive = |c: &&usize| **c % COLUMNS == column::DRIVE_INERTIA;
    let links = robot.joints.len() * COLUMNS;
    let standard = || rules.columns.iter().filter(move |c| **c < links);
    (
        standard().filter(inertial).count(),
        standard().filter(drive).count(),
    )
}

const DOWN: [f64; 3] = [0.0, 0.0, -9.81];
const R: f64 = FRAC_PI_2;

#[test]
fn known_robots_have_their_published_counts() {
    // Planar two-link arm (Khalil & Dombre 2002, sec. 9.4): in a vertical plane Izz, mx, my of both links; in a horizontal
    // one mx, my of the first have no effect. Ia of the first joint joins Izz1.
    assert_eq!(
        counts(&arm(DOWN, &[[R, 0.0, 0.0], [0.0, 0.4, 0.0]])),
        (6, 1)
    );
    assert_eq!(
        counts(&arm(DOWN, &[[0.0, 0.0, 0.0], [0.0, 0.4, 0.0]])),
        (4, 1)
    );
    // PUMA 560: 36 inertial (Mayeda, Yoshida & Osuka 1990; Gautier & Khalil 1990).
    let puma = [
        [0.0, 0.0, 0.0],
        [-R, 0.0, 0.2435],
        [0.0, 0.4318, -0.0934],
        [R, -0.0203, 0.4331],
        [-R, 0.0, 0.0],
        [R, 0.0, 0.0],
    ];
    assert_eq!(counts(&arm(DOWN, &puma)).0, 36);
    // Stäubli RX90: 40 with the four drive inertias Ia3 to Ia6 (Khalil & Dombre 2002, example 9.4).
    let rx90 = [
        [0.0, 0.0, 0.0],
        [R, 0.0, 0.0],
        [0.0, 0.45, 0.0],
        [-R, 0.0, 0.45],
        [R, 0.0, 0.0],
        [-R, 0.0, 0.0],
    ];
    assert_eq!(counts(&arm(DOWN, &rx90)), (36, 4));
    // Franka Emika Panda: 43 inertial (Gaz, Cognetti, Oliva, Robuffo Giordano & De Luca, "Dynamic Identification of the
    // Franka Emika Panda Robot With Retrieval of Feasible Parameters Using Penalty-Based Optimization", IEEE Robotics and
    // Automation Letters 4(4), 2019, pp. 4147-4154).
    let panda = [
        [0.0, 0.0, 0.333],
        [-R, 0.0, 0.0],
        [R, 0.0, 0.316],
        [R, 0.0825, 0.0],
        [-R, -0.0825, 0.384],
        [R, 0.0, 0.0],
        [R, 0.088, 0.107],
    ];
    assert_eq!(counts(&arm(DOWN, &panda)).0, 43);
    // Universal Robots UR5: 36 inertial (as every six-joint arm with a vertical first axis and a horizontal second,
    // 7·6 − 6: Mayeda et al. 1990).
    let ur5 = [
        [0.0, 0.0, 0.0892],
        [R, 0.0, 0.0],
        [0.0, -0.425, 0.0],
        [0.0, -0.3922, 0.1092],
        [R, 0.0, 0.0947],
        [-R, 0.0, 0.0823],
    ];
    assert_eq!(counts(&arm(DOWN, &ur5)).0, 36);
    // A horizontal slide: only its mass.
    let slide = robot(
        DOWN,
        vec![joint(1, JointKind::Prismatic, [R, 0.0, 0.0, 0.0])],
    );
    assert_eq!(counts(&slide), (1, 0));
}

#[test]
fn shipped_robots_agree() {
    for (text, expected) in [
        (TX40, (36, 3)),
        (EDDA_TEMPLATE, (4, 1)),
        (IRP6_TEMPLATE, (29, 2)),
    ] {
        let robot = Robot::from_toml(text, Path::new("r.toml")).unwrap();
        assert_eq!(counts(&robot), expected, "{}", robot.name);
    }
}

/// One length squared times several masses has one coefficient, equal in both models.
#[test]
fn equal_coefficients_are_printed_alike() {
    let robot = Robot::from_toml(IRP6_TEMPLATE, Path::new("irp6.toml")).unwrap();
    let [differential, integral] = [ModelKind::Differential, ModelKind::Integral].map(|model| {
        let base = Base::structural(&robot, model, 1).unwrap();
        (0..base.len())
            .map(|k| base.expression(k))
            .collect::<Vec<String>>()
    });
    assert_eq!(differential, integral);
    let masses = "0.207025 m3 + 0.207025 m4 + 0.207025 m5";
    assert!(
        differential.iter().any(|e| e.contains(masses)),
        "{differential:#?}"
    );
}

#[test]
fn the_rules_print_the_published_expressions_too() {
    let robot = Robot::from_toml(TX40, Path::new("r.toml")).unwrap();
    let (rules, numeric) = (
        grouped(&robot).unwrap(),
        Base::structural(&robot, ModelKind::Differential, 1).unwrap(),
    );
    assert_eq!(rules.columns, numeric.columns);
    for k in 0..rules.len() {
        assert_eq!(rules.expression(k), numeric.expression(k));
    }
}

#[test]
fn rules_and_rank_agree_on_random_chains_with_special_angles() {
    let mut rng = Pcg64::seed_from_u64(41);
    let (mut coupled, mut refused) = (0, 0);
    for draw in 0..180 {
        let n = 1 + draw % 12;
        // The first joints decide about the special rules, so slides and special angles are likely there.
        let special = |rng: &mut Pcg64, share: f64, values: &[f64], range: f64| {
            if rng.random_bool(share) {
                values[rng.random_range(0..values.len())]
            } else {
                rng.random_range(-range..range)
            }
        };
        let mut joints: Vec<Joint> = (0..n)
            .map(|k| {
                let kind = if rng.random_bool(0.35) {
                    JointKind::Prismatic
                } else {
                    JointKind::Revolute
                };
                joint(
                    k + 1,
                    kind,
                    [
                        special(&mut rng, 0.85, &[0.0, 0.0, R, -R, PI], 1.4),
                        special(&mut rng, 0.5, &[0.0], 0.5),
                        special(&mut rng, 0.7, &[0.0, R, PI], 3.0),
                        special(&mut rng, 0.5, &[0.0], 0.5),
                    ],
                )
            })
            .collect();
        // Every other chain has coupled drives, with ratios of bevel gears and belts or any other.
        if draw % 2 == 0 && n > 1 {
            for k in 0..n {
                let couples: BTreeMap<String, f64> = (0..n)
                    .filter_map(|j| {
                        let moved = j != k && rng.random_bool(0.3);
                        let ratio = 40.0 * special(&mut rng, 0.5, &[1.0, -1.0, 0.5], 2.0);
                        moved.then(|| (format!("joint_{}", j + 1), ratio))
                    })
                    .collect();
                coupled += usize::from(!couples.is_empty());
                joints[k].drive = Some(Drive {
                    gear_ratio: 40.0,
                    couples,
                    ..Default::default()
                });
            }
        }
        let gravity = match draw % 5 {
            0 => [0.0, 9.81, 0.0],
            1 => [3.0, -4.0, 7.0],
            2 => [0.0; 3],
            _ => DOWN,
        };
        let robot = robot(gravity, joints);
        let text = robot.to_toml().unwrap();
        if Robot::from_toml(&text, Path::new("chain.toml")).is_err() {
            // Refused: two motors with proportional ratios cannot move two joints.
            refused += 1;
            continue;
        }
        counts(&robot);
    }
    println!("{coupled} coupled drives, {refused} chains refused");
    assert!(coupled > 200 && refused < 10, "{coupled} {refused}");
}
