//! `rig diagnose` from files to files.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::run::{real_data, refuse, rig, robot, succeed};

/// 20 s of the one-link rig with inertia, gravity and friction; `change` is done to position and torque.
fn recording(folder: &Path, change: impl Fn(f64, f64) -> (f64, f64)) -> PathBuf {
    let path = folder.join("recording.csv");
    written(&path, 3.0, 0.0, change);
    path
}

/// The same swung at `pace` rad/s on a base that is tilted by `tilt` rad. It begins and ends in full motion.
fn written(path: &Path, pace: f64, tilt: f64, change: impl Fn(f64, f64) -> (f64, f64)) {
    let mut text = String::from("t,q1,tau1\n");
    for k in 0..20_000 {
        let t = k as f64 * 1e-3;
        let (sin, cos) = (pace * t).sin_cos();
        let q = 1.5 * sin + 0.3 * (11.0 * t).cos();
        let qd = 1.5 * pace * cos - 3.3 * (11.0 * t).sin();
        let qdd = -1.5 * pace * pace * sin - 36.3 * (11.0 * t).cos();
        let tau = 0.12 * qdd + 2.9 * (q + tilt).cos() + 0.3 * qd + 0.4 * qd.signum();
        let (q, tau) = change(q, tau);
        text += &format!("{t:.3},{q:.9},{tau:.6}\n");
    }
    fs::write(path, text).unwrap();
}

/// Uniform noise of width 1.
fn noise(seed: u64) -> impl Fn() -> f64 {
    let state = std::cell::Cell::new(seed);
    move || {
        let next = (state.get().wrapping_mul(6_364_136_223_846_793_005))
            .wrapping_add(1_442_695_040_888_963_407);
        state.set(next);
        (next >> 40) as f64 / (1u64 << 24) as f64 - 0.5
    }
}

/// What `rig diagnose` with `options` writes and says of a recording.
fn diagnosed(options: &[&str], change: impl Fn(f64, f64) -> (f64, f64)) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let data = recording(folder.path(), change);
    let said = succeed(
        rig()
            .arg("diagnose")
            .arg("--robot")
            .arg(robot("one-link.toml"))
            .arg("--data")
            .arg(&data)
            .args(options)
            .arg("--out")
            .arg(&out),
    );
    for file in ["model.toml", "report.html"] {
        assert!(out.join(file).is_file(), "{file} is missing");
    }
    let text = fs::read_to_string(out.join("diagnosis.json")).unwrap();
    (serde_json::from_str(&text).unwrap(), said)
}

fn fault(change: impl Fn(f64, f64) -> (f64, f64), kind: &str, names: &str) {
    let (found, said) = diagnosed(&[], change);
    assert_eq!(found["verdict"], "data-fault", "{found}");
    assert_eq!(found["steps"], serde_json::json!([]));
    let faults = found["data_faults"].as_array().unwrap();
    let named = faults
        .iter()
        .any(|f| f["kind"] == kind && f["text"].as_str().unwrap_or_default().contains(names));
    assert!(named, "no {kind} of {names} in {faults:?}");
    assert!(said.contains("The data are at fault"), "{said}");
}

#[test]
fn degrees_are_a_fault_of_the_data() {
    fault(|q, tau| (q.to_degrees(), tau), "unit", "q1");
}

#[test]
fn a_torque_with_its_sign_swapped_is_a_fault_of_the_data() {
    fault(|q, tau| (q, -tau), "sign", "tau1");
}

/// Inertia and weight come out 200 times too large, as they were recorded, and that is said. (30 times would be the gear ratio of 50
/// applied twice, as far as a description is worth it.)
#[test]
fn a_recording_that_looks_wrong_is_fitted_where_asked_for() {
    let strong = |q: f64, tau: f64| (q, 200.0 * tau);
    fault(strong, "unit", "tau1");
    let (found, said) = diagnosed(&["--even-if-wrong"], strong);
    assert_ne!(found["verdict"], "data-fault", "{found}");
    assert!(!said.contains("The data are at fault"), "{said}");
    let text = found["data_faults"][0]["text"].as_str().unwrap();
    assert!(text.contains("tau1"), "{text}");
    let rms = |model: usize| found["waterfall"][0]["train"][model].as_f64().unwrap();
    assert!(rms(1) < 0.1 * rms(0), "{} of {}", rms(1), rms(0));
}

/// A servo without a current sensor: its voltage alone, of some of the recordings, names what its makers' study names.
#[test]
fn a_servo_is_diagnosed_by_its_voltage() {
    let Some(data) = real_data("rhoban_xl330") else {
        return;
    };
    let file = |motion: &str, gain: u32| data.join(format!("{motion}_kp{gain}_m0.49_l0.1.csv"));
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut command = rig();
    command
        .args(["diagnose", "--robot"])
        .arg(robot("xl330.toml"));
    for gain in [100, 800] {
        for motion in ["sin_sin", "up_and_down"] {
            command.arg("--data").arg(file(motion, gain));
        }
    }
    command.arg("--holdout").arg(file("sin_time_square", 200));
    let said = succeed(command.arg("--out").arg(&out));
    assert!(said.contains("No torque or current was recorded"), "{said}");
    let text = fs::read_to_string(out.join("diagnosis.json")).unwrap();
    let found: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(found["residual"], "position");
    let fall = &found["waterfall"][0];
    assert_eq!(fall["unit"], "rad");
    // Duclusaud et al. 2024 leave 45 to 67 mrad with their models, fitted to such recordings.
    let held = fall["holdout"].as_array().unwrap();
    let last = held.last().unwrap().as_f64().unwrap();
    assert!(last < 0.06, "{held:?}");
    assert!(!found["steps"].as_array().unwrap().is_empty(), "{found}");
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("mrad") && page.contains("position, measured and simulated"));
    let model = out.join("model.toml");
    let toml = fs::read_to_string(&model).unwrap();
    assert!(toml.contains("[joint.voltage_controller]") && toml.contains("supply = ["));
    used_by_other_commands(&model, &file("sin_time_square", 200), last, folder.path());
}

/// `rig validate` leaves on the hold-out what `rig diagnose` left there, and next to nothing of what `rig simulate` wrote.
fn used_by_other_commands(model: &Path, held: &Path, left: f64, folder: &Path) {
    let validated = |data: &Path, name: &str| {
        let out = folder.join(name);
        let mut command = rig();
        command.args(["validate", "--robot"]).arg(model);
        let said = succeed(command.arg("--data").arg(data).arg("--out").arg(&out));
        assert!(
            said.contains("rad rms") && said.contains("mean absolute"),
            "{said}"
        );
        assert!(
            said.contains("controller that the recording shows"),
            "{said}"
        );
        let text = fs::read_to_string(out.join("validation.json")).unwrap();
        let found: Value = serde_json::from_str(&text).unwrap();
        assert!(out.join("report.html").exists());
        found["motion"]["rms"].as_f64().unwrap()
    };
    let rms = validated(held, "validated");
    // The steps of the simulation are chosen by the recordings at hand.
    assert!((rms - left).abs() < 0.02 * left, "{rms} {left}");
    let simulated = folder.join("simulated.csv");
    let mut command = rig();
    command.args(["simulate", "--robot"]).arg(model);
    command.arg("--trajectory").arg(held);
    succeed(command.arg("--out").arg(&simulated));
    let rms = validated(&simulated, "again");
    assert!(rms < 1e-3, "{rms}");
}

/// With a second recording of the rig with nothing that pulls on it: what is gone there comes from outside, what stays does not.
#[test]
fn what_pulls_on_the_joint_is_gone_where_it_is_taken_off() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, constant: f64| {
        let own = folder.path().join(name);
        fs::create_dir(&own).unwrap();
        let noise = noise(name.len() as u64);
        recording(&own, |q, tau| (q, tau + constant + 0.1 * noise()))
    };
    let (pulled, free) = (made("pulled", 0.3), made("free", 0.0));
    let (own, again) = (made("own", 0.3), made("again twice", 0.3));
    let diagnose = |data: &Path, free: &Path| {
        let mut command = rig();
        (command.args(["diagnose", "--robot"])).arg(robot("one-link.toml"));
        (command.arg("--data").arg(data))
            .arg("--pulls-off")
            .arg(free);
        command.arg("--out").arg(folder.path().join("out"));
        // One folder for all of them.
        command.arg("--force");
        command
    };
    let name = |data: &Path, free: &Path| {
        succeed(&mut diagnose(data, free));
        let text = fs::read_to_string(folder.path().join("out/diagnosis.json")).unwrap();
        let found: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(found["steps"].as_array().unwrap().len(), 1, "{found}");
        found["steps"][0]["effect"].as_str().unwrap().to_owned()
    };
    assert_eq!(name(&pulled, &free), "torque_offset");
    assert_ne!(name(&own, &again), "torque_offset");
    let sentence = refuse(&mut diagnose(&pulled, &pulled));
    assert!(sentence.contains("given twice"), "{sentence}");
    let copy = folder.path().join("copy.csv");
    fs::copy(&pulled, &copy).unwrap();
    let sentence = refuse(&mut diagnose(&pulled, &copy));
    assert!(sentence.contains("holds samples of"), "{sentence}");
}

/// What the filters make of a motion that is under way where the recording begins is nothing that is left, and a tilt of 3.4
/// degrees is no play. A hold-out of the motion that was learnt from is said to be one, and a longer copy is no second recording.
#[test]
fn a_recording_may_begin_in_motion_and_a_hold_out_is_another_motion() {
    let folder = tempfile::tempdir().unwrap();
    let tilted = |name: &str, pace: f64, seed: u64| {
        let path = folder.path().join(name);
        let noise = noise(seed);
        written(&path, pace, 0.06, |q, tau| (q, tau + 0.04 * noise()));
        path
    };
    let command = |data: &[&Path], holdout: &Path| {
        let mut command = rig();
        (command.args(["diagnose", "--verbose", "--robot"])).arg(robot("one-link.toml"));
        for path in data {
            command.arg("--data").arg(path);
        }
        command.arg("--holdout").arg(holdout);
        command.arg("--out").arg(folder.path().join("out"));
        // One folder for all of them.
        command.arg("--force");
        command
    };
    let train = tilted("train.csv", 3.0, 1);
    let other = tilted("other.csv", 2.3, 2);
    let again = tilted("again.csv", 3.0, 3);
    let repeats = "repeats the motion of";
    let said = succeed(&mut command(&[&train], &other));
    assert!(!said.contains(repeats), "{said}");
    let text = fs::read_to_string(folder.path().join("out/diagnosis.json")).unwrap();
    let found: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(found["verdict"], "explained", "{said}");
    let steps = found["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 1, "{said}");
    assert_eq!(steps[0]["effect"], "gravity_tilt");
    let angle = steps[0]["parameters"]["angle"]["value"].as_f64().unwrap();
    assert!((angle - 0.06).abs() < 1e-3, "{angle}");

    // The figures as pictures, those of another result gone; an effect that is left out of the library is not named, and that is said.
    let picture = |name: &str| folder.path().join("out").join(name);
    let drawn = fs::read_to_string(picture("gap-1.svg")).unwrap();
    assert!(drawn.contains("gravity tilt") && picture("effect-1.svg").is_file());
    fs::write(picture("effect-7.svg"), "of another result").unwrap();
    let said = succeed(command(&[&train], &other).args(["--without", "gravity_tilt"]));
    assert!(
        said.contains("Left out of the library, as asked: gravity_tilt."),
        "{said}"
    );
    assert!(!picture("effect-7.svg").exists());
    let text = fs::read_to_string(folder.path().join("out/diagnosis.json")).unwrap();
    let found: Value = serde_json::from_str(&text).unwrap();
    for step in found["steps"].as_array().unwrap() {
        assert_ne!(step["effect"], "gravity_tilt", "{said}");
    }
    let wrong = (command(&[&train], &other).args(["--without", "tilt"]))
        .output()
        .unwrap();
    let sentence = String::from_utf8(wrong.stderr).unwrap();
    assert_eq!(wrong.status.code(), Some(2));
    assert!(
        sentence.contains("tilt") && sentence.contains("gravity_tilt"),
        "{sentence}"
    );

    let said = succeed(&mut command(&[&train], &again));
    assert!(said.contains(repeats), "{said}");

    let shorter = folder.path().join("shorter.csv");
    let text = fs::read_to_string(&train).unwrap();
    let lines: Vec<&str> = text.lines().take(15_000).collect();
    fs::write(&shorter, lines.join("\n") + "\n").unwrap();
    let sentence = refuse(&mut command(&[&shorter, &train], &other));
    assert!(sentence.contains("holds samples of"), "{sentence}");
}

/// The workflow of the README on two emulated rigs, from the identified description. A free fit of the contact has elements
/// with a negative share there.
#[test]
fn what_an_identified_description_lacks_is_named_and_explained() {
    std::thread::scope(|scope| {
        for seed in ["1", "4"] {
            scope.spawn(move || explained_from_identified(seed));
        }
    });
}

fn explained_from_identified(seed: &str) {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &str| {
        succeed(
            rig()
                .current_dir(folder.path())
                .args(words.split_whitespace()),
        );
    };
    run("init one-link --out rig.toml");
    run("excite --robot rig.toml --start -1.5708 --out motion.toml");
    run("excite --robot rig.toml --start -1.5708 --seed 2 --out other.toml");
    run("excite --robot rig.toml --start -1.5708 --kind reversals --out slow.toml");
    let recordings = [
        ("1", "motion", "train"),
        ("2", "motion", "again"),
        ("3", "slow", "slow"),
        ("4", "other", "other"),
    ];
    for (number, motion, data) in recordings {
        run(&format!(
            "record --emulated --seed {seed} --run {number} --robot rig.toml --home -1.5708 --trajectory {motion}.toml --out {data}.csv"
        ));
    }
    run("identify --robot rig.toml --data train.csv --holdout other.csv --out found");
    run(
        "diagnose --robot found/identified.toml --data train.csv --data again.csv --data slow.csv --holdout other.csv --out lacking",
    );
    let text = std::fs::read_to_string(folder.path().join("lacking/diagnosis.json")).unwrap();
    let result: Value = serde_json::from_str(&text).unwrap();
    let names: Vec<&str> = (result["steps"].as_array().unwrap().iter())
        .map(|step| step["effect"].as_str().unwrap())
        .collect();
    assert_eq!(result["verdict"], "explained", "{seed}: {names:?}");
    assert_eq!(names, ["presliding", "stribeck"], "{seed}");
    let closed = result["gap_closed"].as_f64().unwrap();
    assert!(closed > 0.85, "{seed}: {closed}");
}
