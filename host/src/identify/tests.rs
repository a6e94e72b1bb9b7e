#![allow(clippy::unwrap_used, clippy::panic)]

use super::*;
use crate::data::{Block, JointColumns};
use crate::prepare::{Choice, InMemory, Recording};
use crate::robot::{Joint, JointKind, Robot};

fn joint(kind: JointKind, alpha: f64) -> Joint {
    Joint {
        name: "axis".into(),
        kind,
        alpha,
        a: 0.0,
        theta: 0.0,
        d: 0.0,
        inertial: None,
        limits: None,
        friction: None,
        drive: None,
        controller: None,
    }
}

/// A slide along the horizontal.
fn emps() -> Robot {
    Robot {
        name: "EMPS".into(),
        gravity: [0.0, 0.0, -9.81],
        joints: vec![joint(JointKind::Prismatic, std::f64::consts::FRAC_PI_2)],
        effects: Vec::new(),
    }
}

/// The recordings, or None with a plain word where they are not at hand.
fn emps_recording(file: &str, disturbance: f64) -> Option<InMemory> {
    let folder = std::env::var_os("RIG_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        std::path::PathBuf::from,
    );
    let path = folder.join("emps").join(file);
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("SKIPPED: {} is not there; set RIG_DATA to the folder of recordings.", path.display());
        return None;
    };
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| names.iter().position(|n| *n == name);
    let rows: Vec<Vec<f64>> = lines
        .map(|l| l.split(',').map(|v| v.parse().unwrap()).collect())
        .collect();
    let column = |name: &str| -> Vec<f64> {
        let c = at(name).unwrap();
        rows.iter().map(|r| r[c]).collect()
    };
    let mut tau = column("tau1");
    if at("pulses").is_some() {
        for (tau, pulse) in tau.iter_mut().zip(column("pulses")) {
            *tau += disturbance * pulse;
        }
    }
    Some(InMemory {
        label: file.into(),
        blocks: vec![Block {
            t: column("t"),
            joints: vec![JointColumns {
                q: column("q1"),
                tau,
                ..Default::default()
            }],
            first_line: 2,
            ..Default::default()
        }],
    })
}

fn published() -> Options {
    Options {
        prepare: PrepareOptions {
            cutoff: Choice::Fixed(100.0),
            decimation: Choice::Fixed(10),
            speed_threshold: Choice::Fixed(0.0),
            ..Default::default()
        },
        ..Default::default()
    }
}

fn show(title: &str, found: &Identification) {
    let d = &found.details;
    println!(
        "== {title}: cut-off {:.2} Hz, decimation {}, rows {}, memory {:.1}, dof {}, cond {:.1} scaled {:.2}, motion {:.2} Hz, threshold {:?}, window {:?}",
        d.treatment.cutoff, d.treatment.decimation, d.estimate.rows, d.estimate.memory_rows,
        d.estimate.degrees_of_freedom, d.estimate.condition, d.estimate.scaled_condition,
        d.treatment.motion_frequency, d.treatment.speed_threshold, d.window.as_ref().map(|w| w.0)
    );
    println!("   {} | {:?}", d.treatment.cutoff_reason, d.masked);
    for b in &found.base_parameters {
        println!(
            "   {:10} {:10.4} ± {:.3} % (classical {:.3} %) [{:.4}, {:.4}] {}",
            b.expression, b.value, b.relative_std_percent, b.classical_relative_std_percent, b.interval[0], b.interval[1], b.unit
        );
    }
    for j in &found.joints {
        println!("   train {:.4} ({:.3} %) hold-out {:?} ({:?})", j.train_residual_rms, 100.0 * j.train_relative_error, j.holdout_residual_rms, j.holdout_relative_error);
    }
}

#[test]
fn emps_explore() {
    let (Some(train), Some(test), Some(test0)) = (
        emps_recording("train.csv", 0.0),
        emps_recording("test_pulses.csv", 35.1507),
        emps_recording("test_pulses.csv", 0.0),
    ) else {
        return;
    };
    let robot = emps();
    let a = published();
    let list: [&dyn Recording; 1] = [&train];
    show("published, hold-out without pulses", &identify(&robot, &list, &[&test0], &a).unwrap());
    show("published, hold-out with pulses", &identify(&robot, &list, &[&test], &a).unwrap());
    show("published refit on pulses, ignored", &identify(&robot, &[&test0], &[], &a).unwrap());
    show("published refit on pulses, added", &identify(&robot, &[&test], &[], &a).unwrap());
    for model in [ModelKind::Differential, ModelKind::Integral] {
        for estimator in [Estimator::Ols, Estimator::Robust] {
            let o = Options { model, estimator, ..Default::default() };
            show(&format!("defaults {model:?} {estimator:?}"), &identify(&robot, &list, &[&test0], &o).unwrap());
        }
    }
    for gain in [-1.0, 1.0] {
        let t = emps_recording("test_pulses.csv", gain).unwrap();
        show(&format!("pulses gain {gain}"), &identify(&robot, &[&t], &[], &a).unwrap());
    }
    for window in [0.005, 0.01, 0.02] {
        let o = Options { model: ModelKind::Integral, window: Some(window), ..Default::default() };
        show(&format!("integral {window}"), &identify(&robot, &list, &[&test0], &o).unwrap());
    }
}
