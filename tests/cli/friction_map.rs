//! `rig friction-map` on sweeps as they come: another rate, a wrong sign, a torque at its limit, no reference.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::run::{refuse, rig, robot, succeed};

/// Weight in line with the link, N·m, inertia about the axis, and friction of the link that is made.
const GRAVITY: f64 = 2.5;
const INERTIA: f64 = 0.11;
const COULOMB: f64 = 0.42;
const VISCOUS: f64 = 0.33;
/// Friction at standstill above Coulomb's, N·m, and the speed at which it has fallen to half of that, rad/s: a rational law (Hess
/// & Soom 1990), not the one that the map fits.
const EXCESS: f64 = 0.12;
const WEAK: f64 = 0.06;

/// Seeded noise of variance one.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        let mut sum = -6.0;
        for _ in 0..12 {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            sum += (state >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}

fn torque(q: f64, qd: f64, qdd: f64) -> f64 {
    let weak = EXCESS / (1.0 + (qd / WEAK).powi(2));
    INERTIA * qdd + GRAVITY * q.cos() + qd.signum() * (COULOMB + weak) + VISCOUS * qd
}

/// Writes a recording of `motion` (position, velocity, acceleration over time).
fn written(
    path: &Path,
    rate: f64,
    seconds: f64,
    motion: impl Fn(f64) -> [f64; 3],
    change: impl Fn(f64) -> f64,
    reference: bool,
) {
    let mut noise = noise(rate as u64);
    let mut text = String::from(if reference {
        "t,q1,tau1,ref1\n"
    } else {
        "t,q1,tau1\n"
    });
    for k in 0..(seconds * rate) as usize {
        let t = k as f64 / rate;
        let [q, qd, qdd] = motion(t);
        let tau = change(torque(q, qd, qdd) + 0.02 * noise());
        // An encoder's noise, in which the velocity of the slow passes drowns behind a filter of 50 Hz.
        let measured = q + 2e-5 * noise();
        let _ = write!(text, "{t:.6},{measured:.9},{tau:.6}");
        if reference {
            let _ = write!(text, ",{q:.9}");
        }
        text.push('\n');
    }
    fs::write(path, text).unwrap();
}

fn excitation(t: f64) -> [f64; 3] {
    let (w, v) = (2.1, 5.3);
    [
        -1.0 + 0.9 * (w * t).sin() + 0.3 * (v * t).cos(),
        0.9 * w * (w * t).cos() - 0.3 * v * (v * t).sin(),
        -0.9 * w * w * (w * t).sin() - 0.3 * v * v * (v * t).cos(),
    ]
}

/// Speeds of the passes, rad/s, each both ways.
const SPEEDS: [f64; 9] = [0.02, 0.035, 0.06, 0.1, 0.2, 0.4, 0.8, 1.5, 2.5];
/// Travel of a pass at constant speed, rad, with 0.1 s of linear rise and fall of the speed and 0.2 s of rest.
const TRAVEL: f64 = 0.6;
const RAMP: f64 = 0.1;
const REST: f64 = 0.2;

fn sweep_seconds() -> f64 {
    SPEEDS
        .iter()
        .map(|v| 2.0 * (TRAVEL / v + 2.0 * RAMP + REST))
        .sum()
}

fn sweep(t: f64) -> [f64; 3] {
    let mut left = t;
    let mut from = -1.8;
    for v in SPEEDS.iter().flat_map(|v| [*v, -*v]) {
        let cruise = TRAVEL / v.abs();
        let length = cruise + 2.0 * RAMP;
        let way = v * (cruise + RAMP);
        if left >= length + REST {
            left -= length + REST;
            from += way;
            continue;
        }
        let rise = |s: f64| 0.5 * v * s * s / RAMP;
        return if left < RAMP {
            [from + rise(left), v * left / RAMP, v / RAMP]
        } else if left < RAMP + cruise {
            [from + rise(RAMP) + v * (left - RAMP), v, 0.0]
        } else if left < length {
            let s = length - left;
            [from + way - rise(s), v * s / RAMP, -v / RAMP]
        } else {
            [from + way, 0.0, 0.0]
        };
    }
    [from, 0.0, 0.0]
}

struct Made {
    folder: tempfile::TempDir,
}

impl Made {
    fn new() -> Self {
        let made = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        for rate in [1000.0, 250.0] {
            let path = made.at(&format!("train-{rate}.csv"));
            written(&path, rate, 30.0, excitation, |tau| tau, true);
        }
        made
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn sweep(&self, name: &str, rate: f64, change: impl Fn(f64) -> f64, reference: bool) {
        written(
            &self.at(name),
            rate,
            sweep_seconds(),
            sweep,
            change,
            reference,
        );
    }

    fn command(&self, train: &str, sweep: &str) -> Command {
        let mut command = rig();
        command
            .args(["friction-map", "--force", "--robot"])
            .arg(robot("one-link.toml"))
            .arg("--data")
            .arg(self.at(train))
            .arg("--sweep")
            .arg(self.at(sweep))
            .arg("--out")
            .arg(self.at("map"));
        command
    }

    fn map(&self, train: &str, sweep: &str) -> (Value, String) {
        let said = succeed(self.command(train, sweep).arg("--verbose"));
        let text = fs::read_to_string(self.at("map/friction-map.json")).unwrap();
        (serde_json::from_str(&text).unwrap(), said)
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Every pass gives a point, the slow ones too, whatever the rates, with and without a reference; and each lies on the law that
/// made it.
#[test]
fn every_pass_of_a_sweep_of_any_rate_gives_a_point_on_its_law() {
    let made = Made::new();
    for rate in [1000.0, 250.0, 100.0] {
        made.sweep(&format!("sweep-{rate}.csv"), rate, |tau| tau, true);
    }
    made.sweep("sweep-bare.csv", 1000.0, |tau| tau, false);
    for (train, sweep) in [
        ("train-1000.csv", "sweep-1000.csv"),
        ("train-1000.csv", "sweep-250.csv"),
        ("train-250.csv", "sweep-1000.csv"),
        ("train-1000.csv", "sweep-100.csv"),
        ("train-1000.csv", "sweep-bare.csv"),
    ] {
        let (map, said) = made.map(train, sweep);
        let points = map["points"].as_array().unwrap();
        assert_eq!(points.len(), 2 * SPEEDS.len(), "{train} {sweep} {said}");
        assert_eq!(map["from_reference"], sweep != "sweep-bare.csv");
        for point in points {
            let (v, friction) = (number(&point["speed"]), number(&point["friction"]));
            let law = torque(std::f64::consts::FRAC_PI_2, v, 0.0);
            // What the fit makes of weakening friction bends weight and offset by some hundredths.
            assert!(
                (friction - law).abs() < 0.04,
                "{sweep}: {v} {friction} {law}"
            );
            let nearest = SPEEDS.iter().map(|s| (v.abs() / s - 1.0).abs());
            assert!(nearest.fold(1.0, f64::min) < 0.02, "{sweep}: {v}");
        }
        assert_eq!(map["warranted"], true, "{train} {sweep}: {said}");
        let law = &map["stribeck"];
        // The made friction weakens by another law than the fitted one, whose tail the viscous term takes up.
        assert!((number(&law["viscous"]) - VISCOUS).abs() < 0.03, "{law}");
    }
}

#[test]
fn a_sweep_is_judged_as_any_recording_and_what_is_left_out_is_listed() {
    let made = Made::new();
    made.sweep("minus.csv", 500.0, |tau| -tau, true);
    let sentence = refuse(&mut made.command("train-1000.csv", "minus.csv"));
    assert!(
        sentence.contains("minus.csv") && sentence.contains("tau1"),
        "{sentence}"
    );
    // Held at a limit that the fast passes reach.
    made.sweep("clipped.csv", 500.0, |tau| tau.min(1.5), true);
    let (map, said) = made.map("train-1000.csv", "clipped.csv");
    let dropped = map["dropped"].as_array().unwrap();
    let points = map["points"].as_array().unwrap();
    assert_eq!(points.len() + dropped.len(), 2 * SPEEDS.len(), "{said}");
    assert!(!dropped.is_empty());
    for pass in dropped {
        assert!(
            pass["why"]
                .as_str()
                .unwrap()
                .contains("torque is at its limit"),
            "{pass}"
        );
    }
    assert_eq!(said.matches("left out:").count(), dropped.len(), "{said}");
}

/// The same recording with one column changed from row to row: `change` is given time and value.
fn altered(from: &Path, to: &Path, column: &str, change: impl Fn(usize, &[f64]) -> f64) {
    let text = fs::read_to_string(from).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let place = header.split(',').position(|name| name == column).unwrap();
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|v| v.parse().unwrap()).collect())
        .collect();
    let values: Vec<f64> = rows.iter().map(|row| row[place]).collect();
    let mut out = format!("{header}\n");
    for (k, row) in rows.iter().enumerate() {
        let mut row = row.clone();
        row[place] = change(k, &values);
        let words: Vec<String> = row.iter().map(|v| format!("{v:.9}")).collect();
        out.push_str(&words.join(","));
        out.push('\n');
    }
    fs::write(to, out).unwrap();
}

/// Time stamps that jitter, rates that differ, rows that are missing: the same numbers, as the sweep's own stamps count.
#[test]
fn a_sweep_is_read_by_its_own_time_stamps() {
    let made = Made::new();
    for rate in [1000.0, 500.0, 200.0] {
        made.sweep("even.csv", rate, |tau| tau, false);
        let (even, _) = made.map("train-1000.csv", "even.csv");
        let mut random = noise(7);
        let jitter: Vec<f64> = (0..200_000)
            .map(|_| 2e-4 * random().clamp(-2.0, 2.0))
            .collect();
        altered(&made.at("even.csv"), &made.at("jitter.csv"), "t", |k, t| {
            t[k] + jitter[k]
        });
        let (map, said) = made.map("train-1000.csv", "jitter.csv");
        for name in ["coulomb", "viscous"] {
            let (a, b) = (
                number(&even["stribeck"][name]),
                number(&map["stribeck"][name]),
            );
            assert!((a - b).abs() < 0.02, "{rate} Hz, {name}: {a} {b} {said}");
        }
    }
}

/// A fault of the sweep or of both recordings is refused with its cause, and drawn all the same where that is wanted.
#[test]
fn a_sweep_of_another_clock_or_scale_is_refused_with_the_cause() {
    let made = Made::new();
    made.sweep("sound.csv", 1000.0, |tau| tau, true);
    let (sound, _) = made.map("train-1000.csv", "sound.csv");
    assert_eq!(sound["doubts"].as_array().unwrap().len(), 0, "{sound:#}");
    fs::remove_dir_all(made.at("map")).unwrap();
    let refused = |column: &str, change: &dyn Fn(usize, &[f64]) -> f64| {
        altered(&made.at("sound.csv"), &made.at("wrong.csv"), column, change);
        let sentence = refuse(&mut made.command("train-1000.csv", "wrong.csv"));
        assert!(!made.at("map").exists(), "{sentence}");
        assert!(sentence.contains("--even-if-wrong"), "{sentence}");
        sentence
    };
    // 15, 60 and 120 ms late, 40 ms early.
    for (rows, word) in [
        (15, "behind"),
        (60, "behind"),
        (120, "behind"),
        (-40, "ahead of"),
    ] {
        let sentence = refused("tau1", &|k, tau: &[f64]| {
            tau[(k as i64 - rows).clamp(0, tau.len() as i64 - 1) as usize]
        });
        assert!(
            sentence.contains(&format!("s {word} q1")) && sentence.contains("one clock"),
            "{rows}: {sentence}"
        );
    }
    for factor in [0.4, 0.7, 1.5] {
        let sentence = refused("tau1", &|k, tau: &[f64]| factor * tau[k]);
        // By gravity, or by friction and inertia, whichever explains more.
        let told = (sentence.split("changes with q1 ").nth(1))
            .or_else(|| sentence.split("tau1 is ").nth(1))
            .unwrap();
        let told: f64 = told.split(' ').next().unwrap().parse().unwrap();
        // What the fit makes of weakening friction bends the weight that it is compared with.
        assert!((told / factor - 1.0).abs() < 0.05, "{factor}: {sentence}");
    }
    let magnitude = refused("tau1", &|k, tau: &[f64]| tau[k].abs());
    assert!(
        magnitude.contains("tau1") && magnitude.contains("sign"),
        "{magnitude}"
    );
    let half = refused("q1", &|k, q: &[f64]| 0.5 * q[k]);
    assert!(half.contains("q1"), "{half}");
    let motor = refused("q1", &|k, q: &[f64]| 50.0 * q[k]);
    assert!(motor.contains("q1"), "{motor}");
    let reversed = refused("ref1", &|k, reference: &[f64]| -reference[k]);
    assert!(
        reversed.contains("ref1") && reversed.contains("the other way"),
        "{reversed}"
    );
    // What is asked for is drawn, with the reason on the page and in the file.
    altered(
        &made.at("sound.csv"),
        &made.at("wrong.csv"),
        "tau1",
        |k, tau| tau[k.saturating_sub(60)],
    );
    let mut command = made.command("train-1000.csv", "wrong.csv");
    let output = command.arg("--even-if-wrong").output().unwrap();
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("behind q1"));
    let map: Value =
        serde_json::from_str(&fs::read_to_string(made.at("map/friction-map.json")).unwrap())
            .unwrap();
    assert_eq!(map["doubts"].as_array().unwrap().len(), 1);
}

/// A joint about a vertical axis has no gravity that could show: that is no reason to doubt its sweep.
#[test]
fn a_sweep_of_a_joint_without_gravity_is_not_doubted() {
    let made = Made::new();
    made.sweep("sloping.csv", 500.0, |tau| tau, true);
    let level = |from: &str, to: &str| {
        let text = fs::read_to_string(made.at(from)).unwrap();
        let mut lines = text.lines();
        let mut out = format!("{}\n", lines.next().unwrap());
        for line in lines {
            let row: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            let tau = row[2] - GRAVITY * row[1].cos();
            let _ = writeln!(out, "{:.6},{:.9},{tau:.6},{:.9}", row[0], row[1], row[3]);
        }
        fs::write(made.at(to), out).unwrap();
    };
    level("sloping.csv", "level.csv");
    level("train-1000.csv", "train-level.csv");
    let text = fs::read_to_string(robot("one-link.toml")).unwrap();
    let vertical = text.replace("alpha = 1.5707963267948966", "alpha = 0.0");
    assert_ne!(text, vertical);
    fs::write(made.at("vertical.toml"), vertical).unwrap();
    succeed(
        rig()
            .args(["friction-map", "--robot"])
            .arg(made.at("vertical.toml"))
            .arg("--data")
            .arg(made.at("train-level.csv"))
            .arg("--sweep")
            .arg(made.at("level.csv"))
            .arg("--out")
            .arg(made.at("map")),
    );
    let text = fs::read_to_string(made.at("map/friction-map.json")).unwrap();
    let map: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(map["doubts"].as_array().unwrap().len(), 0, "{map:#}");
    assert!((number(&map["stribeck"]["viscous"]) - VISCOUS).abs() < 0.03);
}

/// A loop that settles slowly accelerates the joint within its passes, and a link that swings about the horizontal shows little
/// gravity there: that torque is inertia, and no gravity of another scale.
#[test]
fn a_sweep_of_a_slow_controller_about_the_horizontal_is_mapped() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = fs::read_to_string(robot("one-link.toml")).unwrap();
    let slow = "\n[joint.controller]\nposition_gain = 20\nvelocity_gain = 3\ntorque_gain = 1.0\n";
    fs::write(at("rig.toml"), text + slow).unwrap();
    for (options, name) in [
        (&["--start", "-1.5708"][..], "data"),
        (
            &[
                "--kind", "sweep", "--start", "0", "--speeds", "8", "--speed", "0.1,2",
            ],
            "sweep",
        ),
    ] {
        let (motion, out) = (at(&format!("{name}.toml")), at(&format!("{name}.csv")));
        let mut design = rig();
        design
            .arg("excite")
            .arg("--robot")
            .arg(at("rig.toml"))
            .args(options);
        succeed(design.arg("--out").arg(&motion));
        let mut run = rig();
        run.arg("simulate")
            .arg("--robot")
            .arg(at("rig.toml"))
            .arg("--trajectory")
            .arg(&motion);
        run.args([
            "--rate",
            "500",
            "--noise-position",
            "1e-5",
            "--noise-torque",
            "0.02",
        ]);
        succeed(run.arg("--out").arg(&out));
    }
    let mut map = rig();
    map.arg("friction-map").arg("--robot").arg(at("rig.toml"));
    map.arg("--data")
        .arg(at("data.csv"))
        .arg("--sweep")
        .arg(at("sweep.csv"));
    succeed(map.arg("--out").arg(at("map")));
    let found: Value =
        serde_json::from_str(&fs::read_to_string(at("map/friction-map.json")).unwrap()).unwrap();
    let value = |name: &str| found["simple"][name].as_f64().unwrap();
    assert!((value("coulomb") / 0.4 - 1.0).abs() < 0.03, "{found}");
    assert!((value("viscous") / 0.3 - 1.0).abs() < 0.1, "{found}");
}
