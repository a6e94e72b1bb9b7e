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
    assert!(contact(&["--pose", "nan", "0"]).contains("--pose contains NaN"));
    assert!(contact(&["--impedance", "nan"]).contains("impedance NaN"));
    assert!(contact(&["--slide", "1"]).contains("--slide"));
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
