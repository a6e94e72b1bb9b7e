//! Recordings of a joint with an imperfect clock, with rows that the clock does not count, and without noise.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::run::{refuse, rig, robot, succeed};

/// Weight in line with the link, N·m, and inertia about the axis, kg·m².
const GRAVITY: f64 = 2.6;
const INERTIA: f64 = 0.14;
/// Viscous friction, N·m·s/rad, and Coulomb friction, N·m.
const FRICTION: [f64; 2] = [0.3, 0.4];

/// Returns position and torque at a time. `friction`: viscous and Coulomb.
fn motion(t: f64, friction: [f64; 2]) -> [f64; 2] {
    let (w, v) = (2.1, 5.3);
    let q = -1.0 + 0.9 * (w * t).sin() + 0.3 * (v * t).cos();
    let qd = 0.9 * w * (w * t).cos() - 0.3 * v * (v * t).sin();
    let qdd = -0.9 * w * w * (w * t).sin() - 0.3 * v * v * (v * t).cos();
    let friction = friction[0] * qd + friction[1] * qd.signum();
    [q, INERTIA * qdd + GRAVITY * q.cos() + friction]
}

/// Writes `rows` of the motion at `rate`, with a time column that counts them.
fn written(path: &Path, rate: f64, rows: &[usize], friction: [f64; 2], resolution: f64) {
    let mut text = String::from("t,q1,tau1\n");
    for (k, row) in rows.iter().enumerate() {
        let [q, tau] = motion(*row as f64 / rate, friction);
        let read = (q / resolution).round() * resolution;
        let _ = writeln!(text, "{},{read},{tau}", k as f64 / rate);
    }
    fs::write(path, text).unwrap();
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

/// Asserts that all values of an identification are within a share of the truth; returns the identification.
fn near_truth(out: &Path, within: f64, label: &str) -> serde_json::Value {
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
        println!("{label}: {name} {found} for {truth}");
        assert!(
            (found - truth).abs() < within * truth,
            "{label}: {name} {found} for {truth}"
        );
    }
    found
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
        let (mut now, mut text) = (0.0, String::from("t,q1,tau1\n"));
        for row in 0..(24.0 / step) as u64 {
            let [q, tau] = motion(now, FRICTION);
            let _ = writeln!(text, "{now:.3},{q:.5},{tau:.4}");
            // 64-bit mixing (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators").
            let mixed = (row + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let share = (mixed >> 11) as f64 / (1_u64 << 53) as f64;
            now += step + jitter * (2.0 * share - 1.0);
        }
        fs::write(&data, text).unwrap();
        succeed(&mut identify(&data, &out));
        let found = near_truth(&out, 0.03, &format!("{step} {jitter}"));
        let said = found["warnings"].to_string();
        assert!(!said.contains("parted"), "{said}");
    }
}

#[test]
fn rows_that_are_lost_while_time_is_counted_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("rows.csv"), folder.path().join("out"));
    let every = |rows: usize, n: usize| (0..rows).filter(move |k| k % n != n / 2);
    for (rate, resolution, rows, words) in [
        (
            1000.0,
            1e-5,
            every(20_000, 97).collect(),
            "t counts on over missing rows",
        ),
        (
            250.0,
            1e-4,
            every(6_000, 13).collect::<Vec<usize>>(),
            "t counts on over missing rows",
        ),
        (
            500.0,
            2e-5,
            (0..4_000).chain(4_003..9_000).collect(),
            "at one place (first at t = 7.998 s) the positions advance in one row by what 4 rows",
        ),
    ] {
        written(&data, rate, &rows, [0.3, 0.4], resolution);
        let sentence = refuse(&mut identify(&data, &out));
        assert!(sentence.contains(words), "{words}: {sentence}");
        let sound: Vec<usize> = (0..rows.len()).collect();
        written(&data, rate, &sound, [0.3, 0.4], resolution);
        succeed(&mut identify(&data, &out));
    }
}

/// Repeated rows spoil the values by their share or less: the fit goes on, and it is said.
#[test]
fn repeated_rows_are_said_with_their_share() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("rows.csv"), folder.path().join("out"));
    let kept = |rows: usize, n: usize| (0..rows).map(move |k| k - usize::from(k % n == n / 2));
    let twice = |rows: usize, n: usize| {
        (0..rows).flat_map(move |k| std::iter::repeat_n(k, 1 + usize::from(k % n == 0)))
    };
    let (kept_why, twice_why) = ("the logger kept the last value", "they were written twice");
    for (rate, resolution, rows, words, within) in [
        (1000.0, 1e-5, kept(20_000, 97).collect(), kept_why, 0.01),
        (250.0, 1e-4, kept(6_000, 29).collect(), kept_why, 0.01),
        (
            100.0,
            1e-4,
            kept(3_000, 11).collect::<Vec<usize>>(),
            kept_why,
            0.01,
        ),
        (1000.0, 1e-5, twice(15_000, 61).collect(), twice_why, 0.04),
    ] {
        written(&data, rate, &rows, FRICTION, resolution);
        let output = identify(&data, &out).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        assert!(said.contains(words), "{words}: {said}");
        near_truth(&out, within, &format!("{rate} Hz, {words}"));
    }
}

/// A friction of zero is found as 10⁻⁶ of the torque, above or below zero, with a standard deviation of 10⁻⁸.
#[test]
fn rounding_of_a_recording_without_noise_is_no_finding() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("exact.csv"), folder.path().join("out"));
    let other = folder.path().join("other.csv");
    let rows: Vec<usize> = (0..20_000).collect();
    for rate in [1000.0, 500.0, 2000.0] {
        written(&data, rate, &rows, [0.0, 0.0], 1e-12);
        written(&other, rate, &rows[7_000..15_000], [0.0, 0.0], 1e-12);
        let output = identify(&data, &out)
            .arg("--holdout")
            .arg(&other)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        for words in ["No robot can have", "hold-out", "below zero", "leaves more"] {
            assert!(!said.contains(words), "{rate}: {said}");
        }
    }
}
