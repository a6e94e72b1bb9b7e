//! `rig control`: laws of arms in a simulated closed loop.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::run::{refuse, rig, robot, succeed};

fn control(name: &str, options: &[&str], out: &Path) -> Command {
    let mut command = rig();
    command.args(["control", "--robot"]).arg(robot(name));
    command.args(options).arg("--out").arg(out);
    command
}

fn result(folder: &Path) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("control.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The first command that a student types, and the same bytes from the same command.
#[test]
fn laws_track_the_default_motion_and_repeat_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let options = [
        "--duration",
        "3",
        "--scale",
        "0.8",
        "--wrong",
        "30",
        "--draws",
        "3",
    ];
    let said = succeed(&mut control("irp6.toml", &options, &at("a")));
    for word in [
        "pid with",
        "computed-torque with",
        "adaptive with",
        "3 failed",
    ] {
        assert!(said.contains(word), "{said}");
    }
    succeed(&mut control("irp6.toml", &options, &at("b")));
    for name in [
        "control.json",
        "pid.csv",
        "computed-torque.csv",
        "adaptive.csv",
    ] {
        let read = |folder: &str| fs::read(at(folder).join(name)).unwrap();
        assert_eq!(read("a"), read("b"), "{name}");
    }
    let found = result(&at("a"));
    assert_eq!(found["schema"], "rig-control/1");
    let laws = found["tracking"].as_array().unwrap();
    assert_eq!(laws.len(), 3);
    assert!(laws.iter().all(|law| law["robustness"]["draws"] == 3));
    let header = fs::read_to_string(at("a").join("pid.csv")).unwrap();
    assert!(header.starts_with("t,q1,qd1,tau1,ref1,q2,"));
    // Nothing is overwritten.
    let said = refuse(&mut control("irp6.toml", &options, &at("a")));
    assert!(said.contains("--force"), "{said}");
}

/// The recording of a law identifies the robot, and the identified model serves a law.
#[test]
fn recordings_are_identified_and_the_model_serves_the_laws() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let options = ["--law", "computed-torque", "--duration", "12"];
    succeed(&mut control("edda.toml", &options, &at("own")));
    let mut identify = rig();
    identify
        .args(["identify", "--robot"])
        .arg(robot("edda.toml"));
    identify.arg("--data").arg(at("own/computed-torque.csv"));
    succeed(identify.arg("--out").arg(at("identified")));
    let mut command = control("edda.toml", &["--law", "computed-torque"], &at("both"));
    command.arg("--model").arg(robot("edda.toml"));
    succeed(command.arg(at("identified/identified.toml")));
    let found = result(&at("both"));
    let error = |k: usize| found["tracking"][k]["tool_rms"].as_f64().unwrap();
    assert_eq!(found["tracking"][1]["model"], "identified.toml");
    assert!(error(1) < 10.0 * error(0), "{} {}", error(0), error(1));
    assert!(at("both/computed-torque-2.csv").is_file());
}

#[test]
fn tool_presses_with_the_wanted_force() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["irp6.toml", "edda.toml", "one-link.toml"] {
        let said = succeed(&mut control(name, &["--law", "contact"], &at(name)));
        assert!(
            said.contains("hybrid with") && said.contains("impedance with"),
            "{said}"
        );
        let found = result(&at(name));
        let hybrid = &found["contact"][0];
        assert!(
            hybrid["overshoot"].as_f64().unwrap() <= 0.1,
            "{name}: {hybrid}"
        );
        // The overshoot is that of the whole contact.
        let peak = hybrid["slide_peak"].as_f64().unwrap_or(0.0);
        let band =
            (1.0 + hybrid["overshoot"].as_f64().unwrap()) * hybrid["force"].as_f64().unwrap();
        assert!(peak <= band + 1e-9, "{name}: {hybrid}");
        assert!(hybrid["overshoot_before_slide"].is_number(), "{name}");
        assert_eq!(hybrid["bounces"], 0, "{name}");
        let error = hybrid["steady_error"].as_f64().unwrap().abs();
        assert!(
            error < 0.05 * hybrid["force"].as_f64().unwrap(),
            "{name}: {hybrid}"
        );
    }
    let page = fs::read_to_string(at("irp6.toml").join("report.html")).unwrap();
    assert!(page.contains("Force on the surface"));
}

#[test]
fn wrong_options_are_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (name, options, word) in [
        ("edda.toml", &["--bandwidth", "500"][..], "bandwidth 500"),
        ("edda.toml", &["--rate", "1"], "rate 1"),
        ("edda.toml", &["--wrong", "95"], "--wrong 95"),
        ("edda.toml", &["--scale", "0"], "--scale 0"),
        ("edda.toml", &["--draws", "0"], "--draws 0"),
        // Negative values reach the check of the value.
        ("edda.toml", &["--scale", "-1"], "--scale -1"),
        ("edda.toml", &["--damping", "-0.5"], "damping -0.5"),
        ("edda.toml", &["--law", "contact", "--press", "-20"], "-20"),
        (
            "edda.toml",
            &["--law", "contact", "--gap", "-0.01"],
            "-0.01",
        ),
        // Options without effect.
        (
            "edda.toml",
            &["--law", "pid", "--stiffness", "5"],
            "--stiffness belongs to --law",
        ),
        (
            "edda.toml",
            &["--law", "hybrid", "--impedance", "5"],
            "--impedance belongs to --law impedance",
        ),
        (
            "edda.toml",
            &["--law", "contact", "--duration", "3"],
            "--duration belongs to --law",
        ),
        (
            "edda.toml",
            &["--trajectory", "nowhere.toml"],
            "nowhere.toml",
        ),
    ] {
        let said = refuse(&mut control(name, options, &out));
        assert!(said.contains(word), "{options:?}: {said}");
    }
    let contact = |options: &[&str]| {
        let mut all = vec!["--law", "hybrid"];
        all.extend(options);
        refuse(&mut control("edda.toml", &all, &out))
    };
    assert!(contact(&["--normal", "0", "0", "1"]).contains("does not move it there"));
    assert!(contact(&["--press", "10000"]).contains("torque limits"));
    assert!(contact(&["--stiffness", "0"]).contains("surface stiffness 0"));
    assert!(contact(&["--pose", "0"]).contains("one for each of the 2 joints"));
    for pose in [&["nan", "0"][..], &["nan,0"]] {
        let options = [&["--pose"], pose].concat();
        assert!(contact(&options).contains("--pose contains NaN"));
    }
    for pose in [&["-9", "-8", "1"][..], &["-9,-8,1"], &["-9,-8", "1"]] {
        let options = [&["--pose"], pose].concat();
        assert!(
            contact(&options).contains("--pose has 3 numbers"),
            "{pose:?}"
        );
    }
    let impedance = ["--law", "impedance", "--impedance", "nan"];
    assert!(refuse(&mut control("edda.toml", &impedance, &out)).contains("impedance NaN"));
    assert!(contact(&["--slide", "1", "--pose", "0.5,0.4"]).contains("--slide"));
    // A model of another robot.
    let mut command = control("edda.toml", &[], &out);
    let said = refuse(command.arg("--model").arg(robot("irp6.toml")));
    assert!(said.contains("5 joints, and the robot has 2"), "{said}");
    assert!(!out.exists());
}

/// With --force no recording of the earlier run stays beside the new results, and the user's own files do.
#[test]
fn recordings_of_an_earlier_run_are_removed_with_force() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let short = ["--duration", "3", "--law"];
    let run = |law: &[&str]| control("one-link.toml", &[&short[..], law].concat(), &out);
    succeed(&mut run(&["pid", "computed-torque"]));
    fs::write(out.join("mine.csv"), "mine").unwrap();
    succeed(&mut run(&["pid", "--force"]));
    assert!(out.join("pid.csv").is_file() && out.join("mine.csv").is_file());
    assert!(!out.join("computed-torque.csv").exists());
}

/// A recording of 100 rows a second is followed at the rate of the loop, as well as the motion that it was made from.
#[test]
fn a_slow_recording_is_followed_at_the_rate_of_the_loop() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // Two sines from rest, written by this test.
    let motion = |rate: f64, name: &str| {
        let mut text = "t,q1,ref1,q2,ref2\n".to_owned();
        for k in 0..=(6.0 * rate) as usize {
            let t = k as f64 / rate;
            let ease = (t / 2.0).min(1.0).powi(3)
                * (10.0 - 15.0 * (t / 2.0).min(1.0) + 6.0 * (t / 2.0).min(1.0).powi(2));
            let [a, b] = [0.8, 1.3].map(|w| 0.5 * ease * (w * 3.0 * t).sin());
            text.push_str(&format!("{t},{a},{a},{b},{b}\n"));
        }
        fs::write(at(name), text).unwrap();
        at(name)
    };
    let error = |path: &Path, name: &str, options: &[&str]| {
        let mut command = control("edda.toml", &["--law", "all"], &at(name));
        succeed(command.args(options).arg("--trajectory").arg(path));
        let found = result(&at(name));
        let list = found["tracking"].as_array().unwrap();
        let errors: Vec<f64> = list
            .iter()
            .map(|own| own["tool_rms"].as_f64().unwrap())
            .collect();
        (errors, found)
    };
    let (fast, _) = error(&motion(1000.0, "fast.csv"), "fast", &[]);
    let slow = motion(100.0, "slow.csv");
    let (errors, found) = error(&slow, "slow", &[]);
    for (a, b) in errors.iter().zip(&fast) {
        assert!((a / b - 1.0).abs() < 0.2, "{errors:?} {fast:?}");
    }
    let notes = found["notes"].to_string();
    assert!(
        notes.contains("slow.csv") && notes.contains("sampled at 100"),
        "{notes}"
    );
    let (_, found) = error(&slow, "asked", &["--rate", "2000"]);
    assert_eq!(found["settings"]["rate"], 2000.0);
    let coarse = motion(2.0, "coarse.csv");
    let mut command = control("edda.toml", &[], &at("coarse"));
    let said = refuse(command.arg("--trajectory").arg(coarse));
    assert!(said.contains("too seldom for this motion"), "{said}");
}

/// One law that fails does not take the others along.
#[test]
fn an_unstable_law_is_told_and_the_others_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let text = fs::read_to_string(robot("edda.toml")).unwrap();
    // Without torque limits an unstable loop leaves all bounds.
    let text: String = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("torque = "))
        .map(|line| format!("{line}\n"))
        .collect();
    let free = folder.path().join("free.toml");
    fs::write(&free, text).unwrap();
    let mut command = rig();
    command.args(["control", "--duration", "2", "--scale", "4", "--robot"]);
    let run = command.arg(&free).arg("--out").arg(&out).output().unwrap();
    let said = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(1), "{said}");
    let found = result(&out);
    let [failed, done] = ["failed", "tracking"].map(|key| found[key].as_array().unwrap().len());
    assert!(failed >= 1 && done >= 1, "{failed} {done}: {said}");
    assert!(
        said.contains("unstable") && said.contains("The other laws are in"),
        "{said}"
    );
    assert!(
        String::from_utf8(run.stdout)
            .unwrap()
            .contains("with free.toml")
    );
}

/// A described wrist sensor reads the force: its range bounds the task. Motors that leave their limits are told.
#[test]
fn the_described_sensor_and_the_limits_of_motors_are_heeded() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = fs::read_to_string(robot("irp6.toml")).unwrap();
    let sensor = "\n[wrist_sensor]\nrotation = [0.4, -0.9, 2.1]\nforce_range = 18.0\n";
    fs::write(at("sensor.toml"), format!("{text}{sensor}")).unwrap();
    let run = |name: &str, options: &[&str], out: &str| {
        let mut command = rig();
        command.args(["control", "--robot"]).arg(at(name));
        command.args(options).arg("--out").arg(at(out));
        command
    };
    let press = ["--law", "hybrid", "--press"];
    succeed(&mut run(
        "sensor.toml",
        &[&press[..], &["20"]].concat(),
        "a",
    ));
    let found = result(&at("a"));
    let notes = found["notes"].to_string();
    assert!(
        notes.contains("read by the described [wrist_sensor]"),
        "{notes}"
    );
    let error = found["contact"][0]["steady_error"].as_f64().unwrap();
    assert!(error.abs() < 0.05, "{error}");
    let said = refuse(&mut run(
        "sensor.toml",
        &[&press[..], &["30"]].concat(),
        "b",
    ));
    assert!(said.contains("its range is 18.0 N"), "{said}");
    // Behind the last joint stands its drive.
    let motor = "\n[joint.drive.limits]\nvelocity = 150.0\n";
    fs::write(at("motor.toml"), format!("{}{motor}", text.trim_end())).unwrap();
    let options = ["--law", "computed-torque", "--duration", "5"];
    succeed(&mut run("motor.toml", &options, "c"));
    let warnings = result(&at("c"))["tracking"][0]["warnings"].to_string();
    assert!(
        warnings.contains("the speed of the motor of joint"),
        "{warnings}"
    );
}

/// A heavier model gives larger gains, so that PID follows better with it; the right model gives the better computed torque.
#[test]
fn a_wrong_model_that_tracks_better_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let text = fs::read_to_string(robot("one-link.toml")).unwrap();
    let heavy = text
        .replace("mass = 1.0 ", "mass = 1.5 ")
        .replace("[0.3, 0.0, 0.0]", "[0.45, 0.0, 0.0]")
        .replace("0.0, 0.12]", "0.0, 0.2]");
    assert_ne!(text, heavy);
    fs::write(at("heavy.toml"), heavy).unwrap();
    let mut command = control("one-link.toml", &["--duration", "3"], &at("out"));
    command.arg("--model").arg(robot("one-link.toml"));
    let run = command.arg(at("heavy.toml")).output().unwrap();
    let said = String::from_utf8(run.stderr).unwrap();
    assert!(
        said.contains("pid tracks better with heavy.toml than with one-link.toml"),
        "{said}"
    );
    assert!(!said.contains("computed-torque tracks better"), "{said}");
}
