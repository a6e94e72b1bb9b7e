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

/// Returns a number between 0 and 1 for a row, as chance would.
fn chance(row: u64) -> f64 {
    // 64-bit mixing (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators").
    let mixed = (row + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1_u64 << 53) as f64
}

/// Writes 24 s of the motion with noise in position and torque (uniform, ± rad and N·m); `kept` tells which rows, and
/// `read` what a sensor reads of position and torque.
fn noisy(
    path: &Path,
    rate: f64,
    noise: [f64; 2],
    kept: impl Fn(u64) -> bool,
    read: impl Fn(u64, [f64; 2]) -> [f64; 2],
) {
    let mut text = String::from("t,q1,tau1\n");
    let uniform = |row: u64| 2.0 * chance(row) - 1.0;
    for row in (0..(24.0 * rate) as u64).filter(|row| kept(*row)) {
        let t = row as f64 / rate;
        let [q, tau] = read(row, motion(t, FRICTION));
        let q = q + noise[0] * uniform(2 * row + 1_000_003);
        let tau = tau + noise[1] * uniform(2 * row + 2_000_006);
        let _ = writeln!(text, "{t:.6},{q:.7},{tau:.6}");
    }
    fs::write(path, text).unwrap();
}

/// Before, each missing row parted the recording: it was refused ("the longest stretch without one holds 257 rows"), or
/// fitted in short stretches.
#[test]
fn rows_that_are_missing_one_by_one_are_interpolated() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("rows.csv"), folder.path().join("out"));
    for (rate, share, seed) in [
        (1000.0, 0.002, 0),
        (500.0, 0.01, 1_000_000),
        (500.0, 0.02, 2_000_000),
        (250.0, 0.04, 3_000_000),
        (1000.0, 0.2, 4_000_000),
    ] {
        let kept = |row: u64| row < 3 || chance(row + seed) > share;
        noisy(&data, rate, [2e-5, 0.02], kept, |_, own| own);
        let output = identify(&data, &out).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{share}: {said}");
        let lost = (0..(24.0 * rate) as u64).filter(|row| !kept(*row)).count();
        // A fifth of the rows leaves a few gaps of more than four.
        let told = said.split_once(" missing rows").unwrap().0;
        let told: usize = told.rsplit(' ').next().unwrap().parse().unwrap();
        assert!(told <= lost && 100 * told > 99 * lost, "{lost}: {said}");
        assert!(!said.contains("independent stretches"), "{said}");
        near_truth(&out, 0.03, &format!("{rate} Hz, {share}"));
    }
}

/// A torque that is cut at a level with noise (uniform) of 0.02 to 1 % of it: the rows at the level are left out, and it is said.
#[test]
fn a_cut_torque_with_noise_on_its_plateau_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("cut.csv"), folder.path().join("out"));
    // The exact cut at 2.4 N·m gives 0.2523 ± 0.0042 kg·m for mx1, and 0.341 ± 0.029 N·m for fc1, too.
    for (rate, level, noise, within) in [
        (1000.0, 2.3, 1e-2, 0.02),
        (500.0, 2.4, 5e-4, 0.2),
        (1000.0, 2.5, 5e-3, 0.02),
        (250.0, 2.6, 2.6e-2, 0.02),
        (500.0, 2.7, 1e-2, 0.02),
    ] {
        let cut = |_, [q, tau]: [f64; 2]| [q, tau.clamp(-level, level)];
        noisy(&data, rate, [2e-5, noise], |_| true, cut);
        let output = identify(&data, &out).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        assert!(
            said.contains("tau1 is cut at 2."),
            "{level} {noise}: {said}"
        );
        near_truth(&out, within, &format!("cut at {level}, noise {noise}"));
        // The whole torque has none of it.
        noisy(&data, rate, [2e-5, noise], |_| true, |_, own| own);
        let output = identify(&data, &out).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() && !said.contains("is cut at"),
            "{said}"
        );
    }
}

/// Single wrong rows and columns that stop are told with the line, and with the cure.
#[test]
fn wrong_rows_and_columns_that_stop_are_told_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("rows.csv"), folder.path().join("out"));
    let place = |row: u64| motion(row as f64 / 500.0, FRICTION);
    let outlier = |row: u64, [q, tau]: [f64; 2]| [if row == 2866 { q + 3.0 } else { q }, tau];
    let torque = |row: u64, [q, tau]: [f64; 2]| [q, if row > 4000 { place(4000)[1] } else { tau }];
    let stale = |row: u64, _| {
        place(row - (row % 900).saturating_sub(700).min(12) * u64::from(row % 900 < 713))
    };
    let cases: [(&str, &dyn Fn(u64, [f64; 2]) -> [f64; 2], f64); 3] = [
        ("(line 2868), while the rows beside it have", &outlier, 2e-5),
        (
            "N·m from t = 8 s (line 4002) to the end, while q1 moves over",
            &torque,
            0.0,
        ),
        (
            "t is right: these rows are stale values. Take them out",
            &stale,
            0.0,
        ),
    ];
    for (words, read, noise) in cases {
        noisy(&data, 500.0, [noise, 0.0], |_| true, read);
        let said = refuse(&mut identify(&data, &out));
        assert!(said.contains(words), "{words}: {said}");
        assert!(!said.contains("recordings were put together"), "{said}");
    }
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
            now += step + jitter * (2.0 * chance(row) - 1.0);
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
