#![allow(clippy::unwrap_used, clippy::panic)]
use std::path::Path;

use rig_shared::effects::Kind;

use crate::outcome::Fate;
use crate::voltage::log::Log;
use crate::voltage::reading::logs;
use crate::voltage::*;
use crate::{Diagnosis, Options};
use rig_data::prepare::{InMemory, Recording};
use rig_data::{Block, JointColumns};
use rig_model::robot::{Robot, XL330};

pub(crate) fn robot() -> Robot {
    Robot::from_toml(XL330, Path::new("xl330.toml")).unwrap()
}

pub(crate) fn list<R: Recording>(sources: &[R]) -> Vec<&dyn Recording> {
    sources.iter().map(|s| s as &dyn Recording).collect()
}

pub(crate) fn found(train: &[&dyn Recording], held_out: &[&dyn Recording]) -> (Diagnosis, Robot) {
    let robot = robot();
    diagnose_voltage(&robot, train, held_out, &Options::default(), &mut |_| ()).unwrap()
}

/// A pendulum under voltage by small semi-implicit Euler steps: its own physics, independent of the tested simulation.
fn pendulum(number: usize, load_friction: f64) -> InMemory {
    let (inertia, weight, gain, emf) = (0.0065, 0.4805, 0.1, 0.35);
    let (mut q, mut v, mut acceleration) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (dt, every) = (2.0e-5, 250);
    let pace = 1.0 + 0.35 * number as f64;
    let (mut t, mut position, mut voltage) = (Vec::new(), Vec::new(), Vec::new());
    for step in 0..250_000 {
        let now = step as f64 * dt;
        let held = (step / every) as f64 * every as f64 * dt;
        let u = 4.0 * (pace * held).sin() + 1.5 * (2.9 * pace * held).sin();
        if step % every == 0 {
            t.push(now);
            // Encoder of 4096 counts.
            let count = std::f64::consts::TAU / 4096.0;
            position.push((q / count).round() * count);
            voltage.push(u);
        }
        let load = (0.0049 * acceleration + weight * q.sin()).abs();
        let most = 0.02 + load_friction * load;
        let driving = gain * (u - emf * v) - weight * q.sin();
        let stop = inertia * v / dt + driving;
        let next = if stop.abs() <= most {
            0.0
        } else {
            v + dt * (driving - most * stop.signum()) / inertia
        };
        acceleration = (next - v) / dt;
        v = next;
        q += dt * v;
    }
    InMemory {
        label: format!("pendulum {number}"),
        blocks: vec![Block {
            t,
            joints: vec![JointColumns {
                q: position,
                voltage: Some(voltage),
                ..JointColumns::default()
            }],
            first_line: 2,
            ..Block::default()
        }],
    }
}

fn emulated(load_friction: f64) -> Diagnosis {
    let runs: Vec<InMemory> = (0..6).map(|k| pendulum(k, load_friction)).collect();
    found(&list(&runs[..4]), &list(&runs[4..])).0
}

#[test]
fn a_load_friction_under_voltage_is_found() {
    let found = emulated(0.25);
    let names: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
    println!("{:?} {:?}", found.waterfall, found.steps);
    assert_eq!(names.first(), Some(&"load_friction"));
    let coefficient = found.steps[0].parameters["coefficient"].value;
    assert!((coefficient - 0.25).abs() < 0.05, "{coefficient}");
}

#[test]
fn an_effect_of_the_description_is_fitted_again_and_stands_once() {
    let runs: Vec<InMemory> = (0..10).map(|k| pendulum(k, 0.25)).collect();
    let (_, model) = found(&list(&runs[..4]), &list(&runs[4..6]));
    let count = |robot: &Robot| {
        let of = |e: &&rig_model::robot::RobotEffect| e.effect.kind == Kind::LoadFriction;
        robot.effects.iter().filter(of).count()
    };
    assert_eq!(count(&model), 1);
    let (again, next) = diagnose_voltage(
        &model,
        &list(&runs[6..9]),
        &list(&runs[9..]),
        &Options::default(),
        &mut |_| (),
    )
    .unwrap();
    println!("{:?} {:?}", again.described, again.waterfall);
    assert_eq!(count(&next), 1);
    assert!(again.steps.iter().all(|s| s.effect != "load_friction"));
    let own = (again.described.iter()).find(|d| d.effect == "load_friction");
    let own = own.unwrap();
    assert_eq!(own.fate, Fate::FittedAgain);
    let coefficient = own.parameters["coefficient"].value;
    assert!((coefficient - 0.25).abs() < 0.05, "{coefficient}");
    assert!(again.words.contains(&own.text));
}

#[test]
fn where_nothing_is_missing_nothing_is_found() {
    let found = emulated(0.0);
    println!("{:?}", found.waterfall);
    assert!(found.steps.is_empty(), "{:?}", found.steps);
}

#[test]
fn recordings_stand_in_one_order_whatever_order_they_are_given_in() {
    let runs: Vec<InMemory> = (0..4).map(|k| pendulum(k, 0.1)).collect();
    let labels = |order: [usize; 4]| -> Vec<String> {
        let given = order.map(|k| &runs[k] as &dyn Recording);
        logs(&given)
            .unwrap()
            .into_iter()
            .map(|log| log.label)
            .collect()
    };
    assert_eq!(labels([0, 1, 2, 3]), labels([2, 0, 3, 1]));
}

#[test]
fn candidates_pass_until_the_first_that_may_be_chance_and_the_best_fitting_of_equals_comes_in() {
    // RMS on the fit and on left-out data, p-value: in the order of the fit, as in the search.
    let trials = |list: &[[f64; 3]]| -> Vec<search::Trial> {
        let one = |[train, unseen, p_value]: &[f64; 3]| search::Trial {
            kind: Kind::Stribeck,
            model: None,
            train: *train,
            unseen: Some(*unseen),
            p_value: *p_value,
            refused: (*p_value > 0.05).then_some(search::Refusal::Small),
        };
        let mut all: Vec<search::Trial> = list.iter().map(one).collect();
        search::in_sequence(&mut all);
        all
    };
    let taken = |list: &[[f64; 3]]| search::taken(&trials(list));
    assert_eq!(taken(&[[1.0, 2.0, 0.01], [1.1, 1.5, 0.04]]), Some(1));
    assert_eq!(taken(&[[1.0, 1.52, 0.01], [1.1, 1.5, 0.04]]), Some(0));
    assert_eq!(taken(&[[1.0, 2.0, 0.06], [1.1, 1.5, 0.001]]), None);
    assert_eq!(
        taken(&[[1.0, 2.0, 0.01], [1.1, 1.9, 0.2], [1.2, 1.0, 0.01]]),
        Some(0)
    );
}

#[test]
fn signed_ranks_have_their_exact_chances() {
    // All gains: one of 2^5 patterns. All except the smallest: two of them. None: all.
    let p = |gains: &[f64]| significance::signed_rank(gains);
    assert!((p(&[1.0, 2.0, 3.0, 4.0, 5.0]) - 1.0 / 32.0).abs() < 1e-15);
    assert!((p(&[-1.0, 2.0, 3.0, 4.0, 5.0]) - 2.0 / 32.0).abs() < 1e-15);
    assert_eq!(p(&[-0.1, -0.2, 0.0]), 1.0);
    // Six of eight, the two losses small: tabulated (Wilcoxon 1945), 5/256 for ranks 1 and 2 lost.
    assert!((p(&[-0.1, -0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]) - 5.0 / 256.0).abs() < 1e-15);
}

#[test]
fn a_servo_law_is_read_off_its_voltage() {
    let t: Vec<f64> = (0..1000).map(|k| 5.0e-3 * k as f64).collect();
    let q: Vec<f64> = t.iter().map(|t| 0.5 * (3.0 * t).sin()).collect();
    let reference: Vec<f64> = t.iter().map(|t| 0.9 * (3.0 * t + 0.4).sin()).collect();
    // The supply sags by 0.5 V at full share; its reading jumps from row to row.
    let share = |k: usize| (2.0 * (reference[k] - q[k])).clamp(-0.8, 0.8);
    let jump = |k: usize| if k.is_multiple_of(2) { 0.3 } else { -0.3 };
    let supply: Vec<f64> = (0..t.len())
        .map(|k| 7.4 - 0.5 * share(k).abs() + jump(k))
        .collect();
    let mut log = Log {
        u: (0..t.len()).map(|k| share(k) * supply[k]).collect(),
        on: vec![true; t.len()],
        t,
        q,
        reference,
        supply,
        ..Log::default()
    };
    log.read_controller();
    let mut logs = [log];
    law::Supply::of(&logs).give(&mut logs);
    let law = logs[0].law.unwrap();
    assert!(
        (law.proportional - 2.0).abs() < 1e-9 && law.derivative == 0.0,
        "{law:?}"
    );
    assert!((law.limit.unwrap() - 0.8).abs() < 1e-12, "{law:?}");
    assert!(
        (law.supply[0] - 7.4).abs() < 0.02 && (law.supply[1] + 0.5).abs() < 0.05,
        "{law:?}"
    );
    assert!((law.voltage(0.2) - 0.2 * 7.3).abs() < 0.01);
    // A voltage that follows something else.
    let [mut log] = logs;
    log.u.reverse();
    assert_eq!(law::Law::of(&log), None);
}

/// A fit may try values with an infinite torque.
#[test]
fn a_joint_whose_friction_is_no_number_is_no_motion() {
    let rows = 400;
    let log = Log {
        t: (0..rows).map(|k| 5.0e-3 * f64::from(k)).collect(),
        q: vec![0.0; rows as usize],
        u: vec![3.0; rows as usize],
        on: vec![true; rows as usize],
        ..Log::default()
    };
    let plant = plant::Plant {
        inertia: 0.01,
        gravity: [0.0, 0.5, 0.0],
        ratio: 1.0,
        ..plant::Plant::default()
    };
    let segment = log::Segment {
        from: 0,
        to: rows as usize,
        velocity: 0.0,
    };
    let moves = |coefficient: f64| {
        // Drive inertia, torque per volt, back-EMF, Coulomb and viscous friction, offset; the effect's own.
        let theta = [0.002, 0.4, 0.3, 0.05, 0.02, 0.0, coefficient, 0.0];
        plant
            .simulate(
                &[Kind::LoadFriction],
                &theta,
                &log,
                &segment,
                &mut Vec::new(),
            )
            .is_ok()
    };
    assert!(moves(0.1));
    for coefficient in [f64::NAN, f64::INFINITY] {
        assert!(!moves(coefficient), "{coefficient}");
    }
}

#[test]
fn a_voltage_against_the_motion_is_a_fault_of_the_data() {
    let runs = [0, 1].map(|number| {
        let mut run = pendulum(number, 0.0);
        for u in run.blocks[0].joints[0].voltage.iter_mut().flatten() {
            *u = -*u;
        }
        run
    });
    let found = found(&list(&runs), &[]).0;
    let kinds: Vec<&str> = found.data_faults.iter().map(|f| f.kind.as_str()).collect();
    assert_eq!(kinds, ["sign"], "{found:?}");
}

/// Returns the reported fault of a pendulum with changed columns.
fn fault_of(change: impl Fn(&mut JointColumns)) -> String {
    let mut runs: Vec<InMemory> = (0..4).map(|k| pendulum(k, 0.0)).collect();
    for run in &mut runs {
        change(&mut run.blocks[0].joints[0]);
    }
    let (found, _) = found(&list(&runs[..3]), &list(&runs[3..]));
    let [fault] = &found.data_faults[..] else {
        panic!("{:?}", found.data_faults)
    };
    println!("{}", fault.text);
    assert!(fault.certain);
    fault.text.clone()
}

#[test]
fn voltages_that_are_none_and_units_are_told() {
    let volts = |joint: &mut JointColumns, change: &dyn Fn(f64) -> f64| {
        let u = joint.voltage.as_mut().unwrap();
        u.iter_mut().for_each(|u| *u = change(*u));
    };
    let zero = fault_of(|joint| volts(joint, &|_| 0.0));
    assert!(zero.contains("u1 is 0 in every row"), "{zero}");
    for level in [12.0, -5.0] {
        let supply = fault_of(|joint| volts(joint, &|_| level));
        assert!(supply.contains("it looks like the supply"), "{supply}");
    }
    let millivolts = fault_of(|joint| volts(joint, &|u| 1000.0 * u));
    assert!(millivolts.contains("u1 looks like mV"), "{millivolts}");
    let kilovolts = fault_of(|joint| volts(joint, &|u| 0.001 * u));
    assert!(kilovolts.contains("u1 looks like kV"), "{kilovolts}");
    let hundredths = fault_of(|joint| volts(joint, &|u| 100.0 * u));
    assert!(hundredths.contains("hundredths of a volt"), "{hundredths}");
    for supply in [12.0, 24.0, 48.0] {
        let duty = fault_of(|joint| volts(joint, &|u| u / supply));
        assert!(duty.contains("u1 looks like a duty cycle"), "{duty}");
    }
    for (factor, words) in [
        (1.0 / std::f64::consts::TAU, "it looks like turns"),
        (0.5, "it is half what it should be"),
    ] {
        let scaled = fault_of(|joint| joint.q.iter_mut().for_each(|q| *q *= factor));
        assert!(scaled.contains(words), "{scaled}");
    }
}

#[test]
fn a_voltage_at_another_time_or_without_its_sign_is_told() {
    for (rows, words) in [
        (8, "behind q1"),
        (15, "behind q1"),
        (-10_i64, "ahead of q1"),
    ] {
        let late = fault_of(|joint| {
            let u = joint.voltage.as_mut().unwrap();
            let sound = u.clone();
            let last = sound.len() as i64 - 1;
            for (k, u) in u.iter_mut().enumerate() {
                *u = sound[(k as i64 - rows).clamp(0, last) as usize];
            }
        });
        assert!(late.contains(words), "{rows}: {late}");
    }
    let size = fault_of(|joint| {
        let u = joint.voltage.as_mut().unwrap();
        u.iter_mut().for_each(|u| *u = u.abs());
    });
    assert!(size.contains("a magnitude whose sign was lost"), "{size}");
}

/// Real recordings of lifts and drops, in which friction hides the back-EMF: no unit is accused.
#[test]
fn recordings_that_hide_the_back_emf_accuse_no_unit() {
    let Some(data) = rig_output::data_dir() else {
        println!("SKIPPED: the folder of real recordings is not there; set RIG_DATA to it.");
        return;
    };
    let robot = robot();
    for gain in [100, 200, 800] {
        let name = format!("rhoban_xl330/lift_and_drop_kp{gain}_m0.49_l0.1.csv");
        let source =
            rig_data::Source::open_with(&data.join(name), &robot, rig_data::EffortNeed::Optional)
                .unwrap();
        let train: [&dyn Recording; 1] = [&source];
        let read = logs(&train).unwrap();
        let plant = plant::Plant::of(&robot).unwrap();
        let found = faults::faults(&robot, &plant, &[&train, &[]], &[&read, &[]]).unwrap();
        assert!(found.is_empty(), "{gain}: {found:?}");
    }
}
