//! `rig doctor`, on computers that folders and small programs stand for.
#![cfg(target_os = "linux")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::run::rig;

/// Writes a program that runs these lines of a shell.
fn program(folder: &Path, name: &str, lines: &str) {
    let path = folder.join("bin").join(name);
    fs::write(&path, format!("#!/bin/sh\n{lines}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
}

/// A computer with these programs alone.
fn doctor(folder: &Path, data: Option<&str>) -> Command {
    let mut command = rig();
    command.arg("doctor").arg("--root").arg(folder);
    command
        .env("PATH", folder.join("bin"))
        .env_remove("RIG_DATA");
    if let Some(data) = data {
        command.env("RIG_DATA", folder.join(data));
    }
    command
}

fn text(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn a_bare_computer_has_notes_and_no_fault() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("bin")).unwrap();
    let output = doctor(folder.path(), None).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let found = text(&output);
    for words in [
        "ok     program: rig ",
        "note   serial port",
        "rig record --emulated",
        "note   debug probe: probe-rs is not installed",
        "cargo install probe-rs-tools",
        "note   compiler: rustc is not installed",
        "note   Python package: python3 is not installed",
        "note   recordings: RIG_DATA is not set",
    ] {
        assert!(found.contains(words), "{words}:\n{found}");
    }
    assert!(!found.contains("fault"), "{found}");
}

#[test]
fn each_fault_is_a_sentence_with_the_command_that_mends_it() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path();
    for name in ["bin", "dev", "etc"] {
        fs::create_dir(own.join(name)).unwrap();
    }
    // Nobody can use a port that leads nowhere, root neither.
    std::os::unix::fs::symlink(own.join("gone"), own.join("dev/ttyACM0")).unwrap();
    fs::write(own.join("dev/ttyUSB1"), "").unwrap();
    fs::write(own.join("dev/tty0"), "").unwrap();
    program(own, "probe-rs", "echo probe-rs 0.32.0");
    program(own, "rustc", "echo 'rustc 1.80.0 (051478957 2024-07-21)'");
    program(own, "python3", "echo 0.0.1");
    let output = doctor(own, Some("nowhere")).output().unwrap();
    assert_eq!(output.status.code(), Some(10));
    let found = text(&output);
    for words in [
        "fault  serial port: you may not use",
        "ttyUSB1 can be used",
        "ok     debug probe: probe-rs 0.32.0",
        "fault  debug probe: udev has no rule",
        "69-probe-rs.rules",
        "fault  compiler: rustc 1.80.0 (051478957 2024-07-21) is older than",
        "`rustup update stable`",
        "fault  Python package: rig_dynamics 0.0.1 is of another version",
        "`pip install ./host/python`",
        "fault  recordings: RIG_DATA names",
        "`export RIG_DATA=FOLDER`",
    ] {
        assert!(found.contains(words), "{words}:\n{found}");
    }
    assert!(!found.contains("tty0"), "{found}");
    // The same as JSON, with the same exit status.
    let output = doctor(own, Some("nowhere")).arg("--json").output().unwrap();
    assert_eq!(output.status.code(), Some(10));
    let json: Value = serde_json::from_str(&text(&output)).unwrap();
    assert_eq!(json["schema"], "rig-doctor/1");
    let list = json["findings"].as_array().unwrap();
    let faults = list.iter().filter(|own| own["state"] == "fault").count();
    assert_eq!(json["faults"], faults);
    assert_eq!(faults, 5);
}

#[test]
fn a_computer_with_everything_is_well() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path();
    for name in ["bin", "dev", "recordings", "library"] {
        fs::create_dir(own.join(name)).unwrap();
    }
    fs::create_dir_all(own.join("etc/udev/rules.d")).unwrap();
    fs::write(own.join("etc/udev/rules.d/69-probe-rs.rules"), "").unwrap();
    fs::write(own.join("dev/ttyACM0"), "").unwrap();
    program(own, "probe-rs", "echo probe-rs 0.32.0");
    let library = own.join("library");
    program(
        own,
        "rustc",
        &format!(
            "case $1 in --print) echo {};; *) echo 'rustc 1.95.0 (a 2026-04-16)';; esac",
            library.display()
        ),
    );
    program(own, "python3", concat!("echo ", env!("CARGO_PKG_VERSION")));
    let output = doctor(own, Some("recordings")).output().unwrap();
    let found = text(&output);
    assert_eq!(output.status.code(), Some(0), "{found}");
    assert!(found.lines().all(|line| line.starts_with("ok ")), "{found}");
    assert!(
        found.contains("thumbv7em-none-eabihf is installed"),
        "{found}"
    );
    // Without its library the chip's target is a note.
    fs::remove_dir(&library).unwrap();
    let found = text(&doctor(own, None).output().unwrap());
    assert!(
        found.contains("`rustup target add thumbv7em-none-eabihf`"),
        "{found}"
    );
}
