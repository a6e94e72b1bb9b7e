#![allow(clippy::unwrap_used, clippy::panic)]
use std::path::{Path, PathBuf};

use super::*;
use crate::data::{Block, EffortNeed, JointColumns, Source, data_dir};
use crate::diagnose::outcome::Verdict;
use crate::prepare::InMemory;
use crate::robot::XL330;

fn robot() -> Robot {
    Robot::from_toml(XL330, Path::new("xl330.toml")).unwrap()
}

fn recordings(robot: &Robot, of: impl Fn(&str) -> bool) -> Vec<Source> {
    let Some(folder) = data_dir().map(|d| d.join("rhoban_xl330")) else {
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).map(|list| list.flatten().map(|e| e.path()));
    let mut paths: Vec<PathBuf> = entries.map(Iterator::collect).unwrap_or_default();
    paths.retain(|p| p.extension().is_some_and(|e| e == "csv") && of(&p.display().to_string()));
    paths.sort();
    let open = |p: &PathBuf| Source::open_with(p, robot, EffortNeed::Optional).unwrap();
    paths.iter().map(open).collect()
}

fn list<R: Recording>(sources: &[R]) -> Vec<&dyn Recording> {
    sources.iter().map(|s| s as &dyn Recording).collect()
}

fn found(train: &[&dyn Recording], sealed: &[&dyn Recording]) -> (Diagnosis, Robot) {
    let robot = robot();
    diagnose_voltage(&robot, train, sealed, &Options::default(), &mut |_| ()).unwrap()
}

#[test]
fn the_servo_lacks_friction_that_grows_with_the_load() {
    let robot = robot();
    let train = recordings(&robot, |name| !name.contains("kp200"));
    let sealed = recordings(&robot, |name| name.contains("kp200"));
    if train.is_empty() {
        println!("skipped: the recordings of the XL330 are not here");
        return;
    }
    let (found, model) = found(&list(&train), &list(&sealed));
    println!("{:?} {:?}", found.waterfall, found.steps);
    // A published study of this servo names it, too (Duclusaud et al. 2024, models M3 to M6).
    assert_eq!(found.steps[0].effect, "load_friction");
    let unseen = &found.waterfall[0].holdout;
    assert!(unseen[unseen.len() - 1] < 0.7 * unseen[0], "{unseen:?}");
    // The free-running error is far above the encoder's step, and that is said.
    assert_eq!(found.verdict, Verdict::Remainder);
    let text = model.to_toml().unwrap();
    let again = Robot::from_toml(&text, Path::new("model.toml")).unwrap();
    assert_eq!(again.effects.len(), found.steps.len());
}

/// A pendulum under voltage by small semi-implicit Euler steps: its own physics, no step of the simulation under test.
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
fn where_nothing_is_missing_nothing_is_found() {
    let found = emulated(0.0);
    println!("{:?}", found.waterfall);
    assert!(found.steps.is_empty(), "{:?}", found.steps);
}

#[test]
fn signed_ranks_have_their_exact_chances() {
    // Every gain: one of 2^5 patterns. All but the smallest: two of them. None: all.
    let p = |gains: &[f64]| search::signed_rank(gains);
    assert!((p(&[1.0, 2.0, 3.0, 4.0, 5.0]) - 1.0 / 32.0).abs() < 1e-15);
    assert!((p(&[-1.0, 2.0, 3.0, 4.0, 5.0]) - 2.0 / 32.0).abs() < 1e-15);
    assert_eq!(p(&[-0.1, -0.2, 0.0]), 1.0);
    // Six of eight, the two losses small: tabulated (Wilcoxon 1945), 5/256 for ranks 1 and 2 lost.
    assert!((p(&[-0.1, -0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]) - 5.0 / 256.0).abs() < 1e-15);
}
