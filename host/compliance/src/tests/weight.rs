//! A gauge at the tool of arms that hang by their weight, against the numeric solution of statics.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;
use rig_data::prepare::{InMemory, Recording};
use rig_data::{Block, JointColumns};
use rig_model::robot::{IRP6_TEMPLATE, Robot, TX40};

use super::rig::recording;
use super::statics::{links_at_rest, moved, weight};
use crate::{ComplianceOptions, DriveLoading, Value, identify_compliance};

/// Forces to and fro: levels from -1 to 1 of the largest.
const LEVELS: usize = 60;
const OFFSET: [f64; 3] = [0.05, 0.02, 0.1];

/// An arm, its poses and the stiffness of its drives.
struct Arm {
    robot: Robot,
    poses: Vec<Vec<f64>>,
    stiffness: Vec<f64>,
}

/// Two screws and a parallelogram.
fn irp6() -> Arm {
    Arm {
        robot: Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap(),
        poses: vec![
            vec![0.3, -1.4, 0.2, -0.3, 0.5],
            vec![-0.8, -1.9, 0.3, 0.2, -1.0],
            vec![1.2, -1.2, -0.4, 0.4, 1.5],
            vec![0.1, -1.6, -0.1, -0.6, -0.4],
        ],
        stiffness: vec![2e4, 0.8, 0.7, 3e3, 2e3],
    }
}

/// A coupled wrist.
fn tx40() -> Arm {
    Arm {
        robot: Robot::from_toml(TX40, "tx40.toml".as_ref()).unwrap(),
        poses: vec![
            vec![0.3, -0.5, 1.2, 0.4, 0.8, -0.6],
            vec![-0.8, 0.4, 1.0, -1.0, 1.0, 0.5],
            vec![1.2, -0.2, 1.9, 1.3, -1.2, 1.0],
            vec![0.1, 0.6, 0.7, -0.5, 0.4, -1.2],
        ],
        stiffness: vec![2e4, 2.5e4, 1.2e4, 4e3, 3e3, 1.5e3],
    }
}

/// Force (N) and displacement from the unloaded arm (m) at each level: [recording][level].
type Course = Vec<Vec<([f64; 3], [f64; 3])>>;

/// Forces of up to `most` along three axes at each pose. The unloaded arm hangs by its weight, if `heavy`.
fn statics(arm: &Arm, most: f64, heavy: bool) -> Course {
    let mut all = Vec::new();
    for pose in &arm.poses {
        let at = |force: [f64; 3]| {
            let wrench = [force[0], force[1], force[2], 0.0, 0.0, 0.0];
            let own = |q: &[f64]| match heavy {
                true => weight(&arm.robot, q),
                false => 0.0,
            };
            let q = links_at_rest(&arm.robot, pose, OFFSET, &arm.stiffness, wrench, own);
            let [x, y, z, ..] = moved(&arm.robot, &q, pose, OFFSET);
            [x, y, z]
        };
        let rest = at([0.0; 3]);
        for axis in 0..3 {
            all.push(
                (0..=LEVELS)
                    .map(|k| {
                        let mut force = [0.0; 3];
                        force[axis] = most * (2.0 * k as f64 / LEVELS as f64 - 1.0);
                        let place = at(force);
                        (force, [0, 1, 2].map(|r| place[r] - rest[r]))
                    })
                    .collect(),
            );
        }
    }
    all
}

/// Force (N) and positions of the links (rad) at each level: [recording][level].
type Links = Vec<Vec<([f64; 3], Vec<f64>)>>;

/// The same forces, with the links where they stand behind the held motors.
fn links(arm: &Arm, most: f64) -> Links {
    let mut all = Vec::new();
    for (pose, axis) in (arm.poses.iter()).flat_map(|pose| (0..3).map(move |axis| (pose, axis))) {
        let level = |k: usize| {
            let mut force = [0.0; 3];
            force[axis] = most * (2.0 * k as f64 / LEVELS as f64 - 1.0);
            let wrench = [force[0], force[1], force[2], 0.0, 0.0, 0.0];
            let own = |q: &[f64]| weight(&arm.robot, q);
            let q = links_at_rest(&arm.robot, pose, OFFSET, &arm.stiffness, wrench, own);
            (force, q)
        };
        all.push((0..=LEVELS).map(level).collect());
    }
    all
}

/// Recordings of two periods with encoders on the links, with noise of force (N) and encoders (rad).
fn encoded(arm: &Arm, course: &Links, noise: [f64; 2], seed: u64) -> Vec<InMemory> {
    let mut dice = Pcg64Mcg::seed_from_u64(seed);
    let mut normal =
        |std: f64| -> f64 { std * Distribution::<f64>::sample(&StandardNormal, &mut dice) };
    let rows = 4 * LEVELS;
    let mut runs = Vec::new();
    for (i, levels) in course.iter().enumerate() {
        let mut forces = vec![Vec::new(); 3];
        let mut encoders = vec![Vec::new(); arm.stiffness.len()];
        for row in 0..rows {
            let away = row as i64 % (2 * LEVELS) as i64 - LEVELS as i64;
            let (force, q) = &levels[away.unsigned_abs() as usize];
            let pairs = forces.iter_mut().zip(force);
            pairs.for_each(|(own, value)| own.push(value + normal(noise[0])));
            let pairs = encoders.iter_mut().zip(q);
            pairs.for_each(|(own, value)| own.push(value + normal(noise[1])));
        }
        let names = ["fx", "fy", "fz"].map(str::to_owned);
        runs.push(recording(Block {
            t: (0..rows).map(|k| 0.1 * k as f64).collect(),
            joints: (arm.poses[i / 3].iter().zip(encoders))
                .map(|(q, link)| JointColumns {
                    q: vec![*q; rows],
                    link: Some(link),
                    ..JointColumns::default()
                })
                .collect(),
            extra: names.into_iter().zip(forces).collect(),
            first_line: 2,
            ..Block::default()
        }));
    }
    runs
}

/// Near a dead centre of its crank the ratio of a screw changes over the twist. With the ratio at the motors the spring of the upper
/// arm came out 0.42 % too stiff without noise.
#[test]
fn link_encoders_near_a_dead_centre_of_a_screw_show_its_spring() {
    let mut arm = irp6();
    for (pose, lower) in arm.poses.iter_mut().zip([-1.85, -1.9, -1.95, -1.75]) {
        (pose[1], pose[2]) = (lower, -0.1);
    }
    arm.stiffness = vec![3e4, 2.0, 1.5, 5e3, 3e3];
    let course = links(&arm, 80.0);
    for (noise, bound) in [([0.0, 0.0], 1e-4), ([1.0, 2e-6], 3e-3)] {
        let runs = encoded(&arm, &course, noise, 1);
        let list: Vec<&dyn Recording> = runs.iter().map(|run| run as &dyn Recording).collect();
        let options = ComplianceOptions {
            tool: OFFSET,
            poses: vec![arm.poses[0].clone()],
            ..ComplianceOptions::default()
        };
        let found = identify_compliance(&arm.robot, &list, &[], &options).unwrap();
        let drives = found.loading.unwrap().drives;
        let off =
            |own: &DriveLoading| own.stiffness.unwrap().value / arm.stiffness[own.index] - 1.0;
        for own in &drives {
            println!(
                "links, {}: {:.4} % off, {:?}, gap {:?}",
                own.joint,
                100.0 * off(own),
                own.stiffness,
                own.gap
            );
        }
        for own in &drives {
            let has_gap = own.gap.is_some_and(|gap| gap.value > 1e-6);
            assert!(
                off(own).abs() < bound && !has_gap,
                "{}: {}",
                own.joint,
                off(own)
            );
        }
    }
}

/// Recordings of two periods with noise of force (N) and gauge (m).
fn recorded(arm: &Arm, course: &Course, noise: [f64; 2], seed: u64) -> Vec<InMemory> {
    let mut dice = Pcg64Mcg::seed_from_u64(seed);
    let mut normal =
        |std: f64| -> f64 { std * Distribution::<f64>::sample(&StandardNormal, &mut dice) };
    let rows = 4 * LEVELS;
    let mut runs = Vec::new();
    for (i, levels) in course.iter().enumerate() {
        let mut columns = vec![Vec::new(); 6];
        for row in 0..rows {
            let away = row as i64 % (2 * LEVELS) as i64 - LEVELS as i64;
            let (force, place) = levels[away.unsigned_abs() as usize];
            for axis in 0..3 {
                columns[axis].push(force[axis] + normal(noise[0]));
                columns[3 + axis].push(place[axis] + normal(noise[1]));
            }
        }
        let names = ["fx", "fy", "fz", "dx", "dy", "dz"].map(str::to_owned);
        runs.push(recording(Block {
            t: (0..rows).map(|k| 0.1 * k as f64).collect(),
            joints: (arm.poses[i / 3].iter())
                .map(|q| JointColumns {
                    q: vec![*q; rows],
                    ..JointColumns::default()
                })
                .collect(),
            extra: names.into_iter().zip(columns).collect(),
            first_line: 2,
            ..Block::default()
        }));
    }
    runs
}

fn found(arm: &Arm, runs: &[InMemory]) -> Vec<Option<Value>> {
    let list: Vec<&dyn Recording> = runs.iter().map(|run| run as &dyn Recording).collect();
    let options = ComplianceOptions {
        tool: OFFSET,
        poses: vec![arm.poses[0].clone()],
        ..ComplianceOptions::default()
    };
    let found = identify_compliance(&arm.robot, &list, &[], &options).unwrap();
    let drives = found.loading.unwrap().drives;
    drives.iter().map(|own| own.stiffness).collect()
}

/// Weight and force change their torques as the arm yields. Without that the IRp-6 comes out 1.2 % too soft at joint 2, the TX40
/// up to 1.3 % off at joints 2 and 3.
#[test]
fn a_gauge_at_an_arm_with_weight_shows_the_springs_alone() {
    for arm in [irp6(), tx40()] {
        for heavy in [true, false] {
            let course = statics(&arm, 80.0, heavy);
            let mut robot = arm.robot.clone();
            if !heavy {
                robot.gravity = [0.0; 3];
            }
            let own = Arm {
                robot,
                poses: arm.poses.clone(),
                stiffness: arm.stiffness.clone(),
            };
            let all = found(&own, &recorded(&own, &course, [0.0, 0.0], 1));
            for (k, (value, truth)) in all.iter().zip(&arm.stiffness).enumerate() {
                let off = value.unwrap().value / truth - 1.0;
                println!(
                    "gauge, {}, weight {heavy}, joint {}: {:.4} % off",
                    arm.robot.name,
                    k + 1,
                    100.0 * off
                );
                assert!(off.abs() < 1e-4, "joint {}: {off}", k + 1);
            }
        }
    }
}

#[test]
fn intervals_of_a_gauge_at_an_arm_with_weight_cover() {
    for arm in [irp6(), tx40()] {
        let course = statics(&arm, 80.0, true);
        let (seeds, n) = (32u64, arm.stiffness.len());
        let (mut covered, mut given, mut sum) = (vec![0u64; n], vec![0u64; n], vec![0.0; n]);
        for seed in 0..seeds {
            let all = found(&arm, &recorded(&arm, &course, [1.0, 1e-5], seed));
            for (k, (value, truth)) in all.iter().zip(&arm.stiffness).enumerate() {
                let Some(value) = value else { continue };
                let [low, high] = value.interval();
                covered[k] += u64::from(low <= *truth && *truth <= high);
                given[k] += 1;
                sum[k] += (value.value - truth) / value.std;
            }
        }
        let mean: Vec<f64> = (sum.iter().zip(&given))
            .map(|(s, g)| s / *g as f64)
            .collect();
        let (all, of): (u64, u64) = (covered.iter().sum(), given.iter().sum());
        println!(
            "gauge, {}: {all} of {of} intervals cover ({covered:?} of {given:?}), mean z {mean:.2?}",
            arm.robot.name
        );
        assert!(of >= 31 * n as u64 * seeds / 32, "{given:?}");
        assert!(all * 100 >= 88 * of, "{covered:?} of {given:?}");
        // Mean of 32: a standard deviation of 0.18. Without the weight's change it is down to -2.6.
        assert!(mean.iter().all(|z| z.abs() < 0.7), "{mean:?}");
    }
}
