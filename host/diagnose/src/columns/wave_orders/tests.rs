//! Motors with many waves: simulated independently, and real ones.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::f64::consts::TAU;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use crate::{Diagnosis, Options, diagnose};
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_model::robot::Robot;
use rig_output::data_dir;

const INERTIA: f64 = 5e-6;

/// A motor without load; without `drive`, its drive is not described.
fn motor(drive: bool) -> Robot {
    let mut text = "name = 'motor'\ngravity = [0.0, 0.0, -9.81]\n[[joint]]\nname = 'axis'\nkind = 'revolute'\nalpha = 0.0\na = 0.0\ntheta = 0.0\nd = 0.0\n".to_owned();
    text += if drive {
        "[joint.drive]\ngear_ratio = 1.0\nrotor_inertia = 5e-6\ntorque_constant = 0.025\n"
    } else {
        "[joint.inertial]\nmass = 1.0\nfirst_moment = [0.0, 0.0, 0.0]\ninertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.01]\n"
    };
    Robot::from_toml(&text, Path::new("motor.toml")).unwrap()
}

/// Cosines over the angle, each with an order and an amplitude, under a swing with these speed amplitudes at 0.21, 0.37
/// and 0.9 Hz; then inertia, viscous and dry friction, and torque noise.
fn waving(
    waves: &[(f64, f64)],
    swing: [f64; 3],
    [inertia, viscous, coulomb, noise]: [f64; 4],
    seed: u64,
) -> InMemory {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let phases: Vec<f64> = waves.iter().map(|_| rng.random_range(0.0..TAU)).collect();
    let tones = [0.21, 0.37, 0.9].map(|f| (TAU * f, rng.random_range(0.0..TAU)));
    let mut joint = JointColumns::default();
    let mut t = Vec::new();
    for k in 0..20_000 {
        let now = f64::from(k) * 1e-3;
        let [mut q, mut v, mut a] = [0.0; 3];
        for ((w, phase), size) in tones.iter().zip(swing) {
            let (sine, cosine) = (w * now + phase).sin_cos();
            q += size / w * sine;
            v += size * cosine;
            a -= size * w * sine;
        }
        let cogging: f64 = (waves.iter().zip(&phases))
            .map(|((order, size), phase)| size * (order * q + phase).cos())
            .sum();
        let mut white = || -> f64 { StandardNormal.sample(&mut rng) };
        t.push(now);
        joint.q.push(q + 1e-6 * white());
        let friction = viscous * v + coulomb * (v / 0.01).tanh();
        joint
            .tau
            .push(inertia * a + friction + cogging + noise * white());
    }
    let block = Block {
        t,
        joints: vec![joint],
        ..Block::default()
    };
    InMemory {
        label: format!("seed {seed}"),
        blocks: vec![block],
    }
}

fn diagnosed(robot: &Robot, recording: &InMemory) -> (Diagnosis, Robot) {
    diagnose(robot, &[recording], &[], &Options::default(), &mut |_| ()).unwrap()
}

/// Returns order and amplitude of each described motor wave, by order.
fn waves_of(robot: &Robot) -> Vec<(f64, f64)> {
    let effects = robot.effects.iter().map(|e| e.effect);
    let mut waves: Vec<(f64, f64)> = effects
        .filter(|e| e.kind.about().name == "cogging")
        .map(|e| (e.shapes[0], e.gains[0].hypot(e.gains[1])))
        .collect();
    waves.sort_by(|a, b| a.0.total_cmp(&b.0));
    waves
}

/// Asserts that these waves are found, with amplitudes within 10 %.
fn assert_near(found: &[(f64, f64)], made: &[(f64, f64)]) {
    println!("{found:?}");
    for (order, size) in made {
        let own = found.iter().find(|f| f.0 == *order);
        let own = own.unwrap_or_else(|| panic!("order {order} is not among {found:?}"));
        assert!((own.1 / size - 1.0).abs() < 0.1, "{own:?}, made {size}");
    }
}

/// Amplitudes of a real motor, in N·m at 0.025 N·m/A.
const REAL: [(f64, f64); 5] = [
    (12.0, 7.75e-4),
    (18.0, 1.05e-3),
    (24.0, 4.5e-4),
    (36.0, 3.75e-4),
    (72.0, 4.4e-3),
];

#[test]
fn five_orders_of_one_motor_are_found_written_and_read() {
    let robot = motor(true);
    let friction = [INERTIA, 3e-4, 1e-3, 3e-4];
    let recording = waving(&REAL, [4.0, 3.0, 1.0], friction, 5);
    let (found, model) = diagnosed(&robot, &recording);
    println!("{:?}", found.words);
    let names: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
    assert_eq!(names, ["cogging"; 5], "{:?}", found.words);
    let read = Robot::from_toml(&model.to_toml().unwrap(), Path::new("model.toml")).unwrap();
    assert_near(&waves_of(&read), &REAL);
    // The description now states them, and nothing is missing.
    let (again, _) = diagnosed(&read, &waving(&REAL, [3.0, 4.0, 1.5], friction, 5));
    assert!(again.steps.is_empty(), "{:?}", again.words);
}

/// Behind a gear of unknown ratio, over a third of a turn.
#[test]
fn twelve_hundred_periods_a_turn_are_found() {
    let made = [(400.0, 0.03), (1200.0, 0.2)];
    let friction = [0.01, 0.05, 0.1, 0.01];
    let recording = waving(&made, [0.3, 0.2, 0.1], friction, 7);
    let (found, model) = diagnosed(&motor(false), &recording);
    println!("{:?}", found.words);
    let waves = waves_of(&model);
    assert_near(&waves, &made);
    assert_eq!(found.steps.len(), 2, "{:?}", found.words);
}

/// Returns the orders that are found for a gear with these errors.
fn of_a_gear(errors: &[(f64, f64)], seed: u64) -> Vec<f64> {
    let friction = [0.01, 0.05, 0.1, 0.01];
    let recording = waving(errors, [8.0, 6.0, 2.0], friction, seed);
    let (found, model) = diagnosed(&motor(false), &recording);
    println!("{:?}", found.words);
    let gears = model.effects.iter().map(|e| e.effect);
    let mut orders: Vec<f64> = gears
        .filter(|e| e.kind.about().name == "gear_eccentricity")
        .map(|e| e.shapes[0])
        .collect();
    assert_eq!(orders.len(), found.steps.len(), "{:?}", found.words);
    orders.sort_by(f64::total_cmp);
    orders
}

/// The error of an eccentric gear is no pure sine; two periods per turn with half its size are another error.
#[test]
fn a_harmonic_of_an_eccentric_gear_is_no_second_effect_and_a_second_error_is_one() {
    for seed in [11, 12, 13] {
        let eccentric = of_a_gear(&[(1.0, 0.2), (2.0, 0.02)], seed);
        assert_eq!(eccentric, [1.0], "{seed}");
    }
    assert_eq!(of_a_gear(&[(1.0, 0.2), (2.0, 0.1)], 14), [1.0, 2.0]);
}

/// Returns columns of a text file by name, row by row in this order.
fn columns(file: &str, names: [&str; 3]) -> Option<Vec<[f64; 3]>> {
    let Some(folder) = data_dir() else {
        println!("SKIPPED: the folder of real recordings is not there; set RIG_DATA to it.");
        return None;
    };
    let text = std::fs::read_to_string(folder.join(file)).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').map(str::trim).collect();
    let places = names.map(|name| header.iter().position(|h| *h == name).unwrap());
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|c| c.trim().parse().unwrap()).collect();
        places.map(|place| cells[place])
    };
    Some(lines.map(row).collect())
}

/// Returns rows of time, position and torque at 1 kHz, interpolated between rounded stamps.
fn recording(rows: &[[f64; 3]]) -> InMemory {
    let mut joint = JointColumns::default();
    let mut t = Vec::new();
    let mut at = 0;
    for k in 0.. {
        let now = rows[0][0] + f64::from(k) * 1e-3;
        while at + 1 < rows.len() && rows[at + 1][0] <= now {
            at += 1;
        }
        let Some(next) = rows.get(at + 1) else { break };
        let share = (now - rows[at][0]) / (next[0] - rows[at][0]);
        let between = |c: usize| rows[at][c] + share * (next[c] - rows[at][c]);
        t.push(now);
        joint.q.push(between(1));
        joint.tau.push(between(2));
    }
    let block = Block {
        t,
        joints: vec![joint],
        ..Block::default()
    };
    InMemory {
        label: "real".into(),
        blocks: vec![block],
    }
}

/// Andrade's ODRI motor (heitor-andrade/laas_anti_cogging), turning slowly without compensation: order, amplitude from
/// the map of held positions and by least squares on this recording as stamped, A. The truth is not known better.
const MEASURED: [(f64, f64, f64); 5] = [
    (12.0, 0.031, 0.036),
    (18.0, 0.042, 0.045),
    (24.0, 0.018, 0.022),
    (36.0, 0.015, 0.017),
    (72.0, 0.177, 0.217),
];

#[test]
fn the_orders_of_a_real_motor_are_found_and_no_others() {
    let Some(mut rows) = columns("laas_motor/speed_test1.txt", ["Time", "Position", "Iq"]) else {
        return;
    };
    for row in &mut rows {
        row[2] *= 0.025;
    }
    let (found, model) = diagnosed(&motor(true), &recording(&rows));
    println!("{:?}", found.words);
    let waves = waves_of(&model);
    println!("{waves:?}");
    let orders: Vec<f64> = waves.iter().map(|(order, _)| *order).collect();
    assert_eq!(orders, MEASURED.map(|(order, ..)| order));
    for ((_, size), (order, held, turning)) in waves.iter().zip(MEASURED) {
        let amperes = size / 0.025;
        assert!(
            (0.9 * held..1.1 * turning).contains(&amperes),
            "{amperes} A at order {order}"
        );
    }
    let treated = found.treatment.as_ref().unwrap();
    assert!(
        (50.0..200.0).contains(&treated.position_cutoff),
        "{}",
        treated.position_cutoff_why
    );
}

/// Joint 7 of a Kinova Gen3 (SedkiLmm/dynamic-identification): 12 periods per motor turn behind a gear of 100 : 1.
#[test]
fn the_wave_of_a_real_arms_joint_is_found() {
    let Some(mut rows) = columns(
        "kinova_gen3/joint_7_trapez.csv",
        ["Time", "Position7", "Cur7"],
    ) else {
        return;
    };
    for row in &mut rows {
        row[0] *= 1e-3;
    }
    let (found, model) = diagnosed(&motor(false), &recording(&rows));
    println!("{:?}", found.words);
    assert_near(&waves_of(&model), &[(1200.0, 0.2)]);
}
