//! Nothing is overwritten without a word, by no command.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::run::{refuse, rig, robot, succeed};

/// A short recording of the one-link rig by its own model.
fn recorded(folder: &Path) -> PathBuf {
    let at = |name: &str| folder.join(name);
    succeed(
        rig()
            .args([
                "excite",
                "--starts",
                "1",
                "--periods",
                "2",
                "--start",
                "-1.5",
            ])
            .arg("--robot")
            .arg(robot("one-link.toml"))
            .arg("--out")
            .arg(at("motion.toml")),
    );
    let path = at("train.of-a-rig.csv");
    succeed(
        rig()
            .args(["simulate", "--noise-torque", "0.02", "--robot"])
            .arg(robot("one-link.toml"))
            .arg("--trajectory")
            .arg(at("motion.toml"))
            .arg("--out")
            .arg(&path),
    );
    path
}

#[test]
fn a_file_or_a_folder_of_results_is_replaced_with_force_alone() {
    let folder = tempfile::tempdir().unwrap();
    let data = recorded(folder.path());
    let command = |name: &str, input: [&str; 2], out: &Path| {
        let mut command = rig();
        command
            .arg(name)
            .args(["--robot"])
            .arg(robot("one-link.toml"));
        for option in input.iter().filter(|option| !option.is_empty()) {
            command.arg(option).arg(&data);
        }
        command.arg("--out").arg(out);
        command
    };
    let says = |mut command: Command, words: &[&str]| {
        let sentence = refuse(&mut command);
        for word in words {
            assert!(sentence.contains(word), "{sentence}");
        }
    };
    let file = folder.path().join("precious");
    fs::write(&file, "mine").unwrap();
    for (name, input) in [("simulate", "--trajectory"), ("urdf", ""), ("excite", "")] {
        says(command(name, [input, ""], &file), &["precious", "--force"]);
    }
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    succeed(command("urdf", ["", ""], &file).arg("--force"));
    assert_ne!(fs::read_to_string(&file).unwrap(), "mine");

    // What one command has written is in the way of all.
    let out = folder.path().join("found");
    succeed(&mut command("identify", ["--data", ""], &out));
    let before = fs::read_to_string(out.join("report.html")).unwrap();
    for (name, input) in [
        ("identify", ["--data", ""]),
        ("validate", ["--data", ""]),
        ("diagnose", ["--data", ""]),
        ("friction-map", ["--data", "--sweep"]),
    ] {
        says(
            command(name, input, &out),
            &["found", "report.html", "--force"],
        );
    }
    let mut demo = rig();
    demo.args(["demo", "--out"]).arg(&out);
    says(demo, &["found", "report.html", "--force"]);
    assert_eq!(fs::read_to_string(out.join("report.html")).unwrap(), before);
    succeed(command("validate", ["--data", ""], &out).arg("--force"));
    assert_ne!(fs::read_to_string(out.join("report.html")).unwrap(), before);
}
