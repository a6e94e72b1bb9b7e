//! Arms recorded by another dynamics engine (MuJoCo, Pinocchio): identified, they must predict another motion to the
//! noise that was put in, or as near to it as that noise lets least squares with the exact regressor come.
//!
//! The recordings are made by `tests/other_engine/record.py`. It needs a Python with the packages of
//! `tests/other_engine/requirements.txt`: the one named in RIG_PYTHON, `python3`, or else one that these tests furnish with
//! pip beside the build. Where that is not to be had they say so and pass.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use rig_host::data::Source;
use rig_host::identify::{Estimator, ModelKind, Options, identify};
use rig_host::prepare::Recording;
use rig_host::robot::Robot;

fn scripts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("other_engine")
}

fn has_engines(python: &Path) -> bool {
    Command::new(python)
        .args(["-c", "import mujoco, numpy, pinocchio"])
        .output()
        .is_ok_and(|o| o.status.success())
}

/// A Python with both engines.
fn python() -> Option<&'static PathBuf> {
    static FOUND: OnceLock<Option<PathBuf>> = OnceLock::new();
    let find = || {
        let named = std::env::var_os("RIG_PYTHON").map(PathBuf::from);
        let usual = Path::new(env!("CARGO_TARGET_TMPDIR")).join("other_engine");
        let own = usual.join("bin/python");
        for python in named
            .into_iter()
            .chain([PathBuf::from("python3"), own.clone()])
        {
            if has_engines(&python) {
                return Some(python);
            }
        }
        let made = Command::new("python3")
            .args(["-m", "venv"])
            .arg(&usual)
            .output()
            .is_ok_and(|o| o.status.success())
            && Command::new(&own)
                .args(["-m", "pip", "install", "--quiet", "-r"])
                .arg(scripts().join("requirements.txt"))
                .output()
                .is_ok_and(|o| o.status.success());
        (made && has_engines(&own)).then_some(own)
    };
    let found = FOUND.get_or_init(find).as_ref();
    if found.is_none() {
        println!(
            "SKIPPED: no Python with mujoco and pin; install tests/other_engine/requirements.txt and name it in RIG_PYTHON."
        );
    }
    found
}

/// Identifies one arm in both models and compares the hold-out's residual with the noise, joint by joint.
fn at_the_noise(arm: &str, engine: &str, seed: u64) {
    let Some(python) = python() else { return };
    let place = tempfile::tempdir().unwrap();
    let made = Command::new(python)
        .arg(scripts().join("record.py"))
        .args([
            "--arm",
            arm,
            "--engine",
            engine,
            "--seed",
            &seed.to_string(),
            "--out",
        ])
        .arg(place.path())
        .output()
        .unwrap();
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let truth: serde_json::Value =
        serde_json::from_slice(&std::fs::read(place.path().join("truth.json")).unwrap()).unwrap();
    let robot = Robot::load(&place.path().join("robot.urdf")).unwrap();
    let open = |name: &str| Source::open(&place.path().join(name), &robot).unwrap();
    let (train, holdout) = (open("train.csv"), open("holdout.csv"));
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let options = Options {
            model,
            estimator: Estimator::for_robot(&robot),
            look_beyond: true,
            ..Default::default()
        };
        let found = identify(
            &robot,
            &[&train as &dyn Recording],
            &[&holdout as &dyn Recording],
            &options,
        )
        .unwrap();
        let noise = truth["noise_rms"]["holdout"].as_array().unwrap();
        let ratios: Vec<f64> = found
            .joints
            .iter()
            .zip(noise)
            .map(|(joint, sigma)| joint.holdout_residual_rms.unwrap() / sigma.as_f64().unwrap())
            .collect();
        let exact: Vec<f64> = truth["exact_least_squares"]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect();
        println!(
            "{arm} by {engine}, {model:?}: residual over noise {ratios:.3?}, of exact least squares {exact:.3?}"
        );
        for (j, (ratio, exact)) in ratios.iter().zip(&exact).enumerate() {
            assert!(
                *ratio > 0.8 && *ratio < 1.1 * exact,
                "{arm} by {engine}, {model:?}, joint {}: {ratio:.3} times the noise, exact least squares {exact:.3}",
                j + 1
            );
        }
    }
}

#[test]
fn ur5_likeness_by_mujoco() {
    at_the_noise("ur5", "mujoco", 3);
}

#[test]
fn panda_likeness_by_pinocchio() {
    at_the_noise("panda", "pinocchio", 4);
}

#[test]
fn panda_likeness_by_mujoco() {
    at_the_noise("panda", "mujoco", 5);
}

#[test]
fn random_arm_with_prismatic_joints_by_both() {
    at_the_noise("random", "mujoco", 6);
    at_the_noise("random", "pinocchio", 7);
}
