//! Recordings of a sound joint with an imperfect clock.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use rand::{RngExt, SeedableRng};

use crate::run::{rig, robot, succeed};

/// Weight in line with the link, N·m, and inertia about the axis, kg·m².
const GRAVITY: f64 = 2.6;
const INERTIA: f64 = 0.14;
/// Viscous friction, N·m·s/rad, and Coulomb friction, N·m.
const FRICTION: [f64; 2] = [0.3, 0.4];

/// Returns position and torque at a time.
fn motion(t: f64) -> [f64; 2] {
    let (w, v) = (2.1, 5.3);
    let q = -1.0 + 0.9 * (w * t).sin() + 0.3 * (v * t).cos();
    let qd = 0.9 * w * (w * t).cos() - 0.3 * v * (v * t).sin();
    let qdd = -0.9 * w * w * (w * t).sin() - 0.3 * v * v * (v * t).cos();
    let friction = FRICTION[0] * qd + FRICTION[1] * qd.signum();
    [q, INERTIA * qdd + GRAVITY * q.cos() + friction]
}

fn identify(data: &Path, out: &Path) -> Command {
    let mut command = rig();
    command
        .args(["identify", "--force", "--compare", "none", "--robot"])
        .arg(robot("one-link.toml"))
        .arg("--data")
        .arg(data)
        .arg("--out")
        .arg(out);
    command
}

/// A loop whose steps vary a little (uniform, ±`jitter` s) and whose stamps are rounded to milliseconds. Before, the
/// steps of one and three milliseconds parted the recording: it was refused, or fitted with wrong values.
#[test]
fn stamps_in_whole_milliseconds_give_the_values_of_exact_stamps() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("stamps.csv"), folder.path().join("out"));
    for (step, jitter) in [
        (2e-3, 0.09e-3),
        (2e-3, 0.17e-3),
        (2e-3, 0.35e-3),
        (2.02e-3, 0.0),
        (4e-3, 0.2e-3),
    ] {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let (mut now, mut text) = (0.0, String::from("t,q1,tau1\n"));
        for _ in 0..(24.0 / step) as usize {
            let [q, tau] = motion(now);
            let _ = writeln!(text, "{now:.3},{q:.5},{tau:.4}");
            now += step + jitter * (2.0 * rng.random::<f64>() - 1.0);
        }
        fs::write(&data, text).unwrap();
        succeed(&mut identify(&data, &out));
        let text = fs::read_to_string(out.join("identification.json")).unwrap();
        let found: serde_json::Value = serde_json::from_str(&text).unwrap();
        let list = found["base_parameters"].as_array().unwrap();
        let value = |name: &str| {
            let own = |one: &&serde_json::Value| {
                one["expression"].as_str().unwrap().split(' ').next() == Some(name)
            };
            list.iter().find(own).unwrap()["value"].as_f64().unwrap()
        };
        for (name, truth) in [
            ("mx1", GRAVITY / 9.81),
            ("Izz1", INERTIA),
            ("fv1", FRICTION[0]),
            ("fc1", FRICTION[1]),
        ] {
            let found = value(name);
            println!("{step} {jitter}: {name} {found} for {truth}");
            assert!(
                (found - truth).abs() < 0.03 * truth,
                "{step} {jitter}: {name} {found} for {truth}"
            );
        }
        let said = found["warnings"].to_string();
        assert!(!said.contains("parted"), "{said}");
    }
}
