//! `rig excite` says what a motion is not checked against, and what is strange about limits and starts.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::run::{refuse, rig, robot};

fn excite(robot: &Path, options: &[&str], out: &Path) -> Command {
    let mut command = rig();
    command.args(["excite", "--force", "--robot"]).arg(robot);
    command.args(options).arg("--out").arg(out);
    command
}

/// Standard output and standard error of a run that must succeed.
fn both(command: &mut Command) -> [String; 2] {
    let output = command.output().unwrap();
    let [said, remarked] =
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{remarked}");
    [said, remarked]
}

/// A URDF arm of two joints with these limits of the first.
fn urdf(path: &Path, limit: &str, more: &str) {
    let inertial = "<inertial><origin xyz=\"0.1 0 0\"/><mass value=\"1\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" iyz=\"0\" izz=\"0.01\"/></inertial>";
    let joint = |name: &str, parent: &str, child: &str, limit: &str, more: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"0.3 0 0\"/><axis xyz=\"0 1 0\"/><limit {limit}/>{more}</joint>"
        )
    };
    let text = format!(
        "<robot name=\"arm\"><link name=\"a\"/><link name=\"b\">{inertial}</link><link name=\"c\">{inertial}</link>{}{}</robot>",
        joint("lift", "a", "b", limit, more),
        joint(
            "elbow",
            "b",
            "c",
            "lower=\"-2\" upper=\"2\" velocity=\"3\" effort=\"40\"",
            ""
        )
    );
    fs::write(path, text).unwrap();
}

#[test]
fn every_motion_comes_with_what_it_is_not_checked_against() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("m.toml");
    for kind in ["fourier", "sweep"] {
        let options = ["--kind", kind, "--start", "-1.5708"];
        let [said, _] = both(&mut excite(&robot("one-link.toml"), &options, &out));
        assert!(
            said.contains("self-collision") && said.contains("--speed-share"),
            "{said}"
        );
    }
}

#[test]
fn no_motion_is_sized_by_limits_in_degrees_unless_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    urdf(
        &at("deg.urdf"),
        "lower=\"-160\" upper=\"160\" velocity=\"180\" effort=\"40\"",
        "",
    );
    let refused = excite(&at("deg.urdf"), &["--kind", "sweep"], &at("m.toml"))
        .output()
        .unwrap();
    assert!(!refused.status.success() && !at("m.toml").exists());
    let [_, remarked] = both(&mut excite(
        &at("deg.urdf"),
        &["--kind", "sweep", "--even-if-wrong"],
        &at("m.toml"),
    ));
    assert!(
        remarked.contains("lift") && remarked.contains("-2.793"),
        "{remarked}"
    );
}

#[test]
fn a_start_on_a_limit_and_a_period_that_no_motion_has_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    urdf(
        &at("arm.urdf"),
        "lower=\"0\" upper=\"2.8\" velocity=\"3\" effort=\"40\"",
        "",
    );
    let out = at("m.toml");
    let options = ["--starts", "1", "--start", "0,0"];
    let sentence = refuse(&mut excite(&at("arm.urdf"), &options, &out));
    assert!(
        sentence.contains("strictly between") && sentence.contains("lift"),
        "{sentence}"
    );
    let options = ["--start", "-1.5708", "--period", "0.01", "--starts", "1"];
    let said = refuse(&mut excite(&robot("one-link.toml"), &options, &out));
    assert!(
        said.contains("identifies nothing") && said.contains("--period"),
        "{said}"
    );
    assert!(!out.exists());
}

#[test]
fn the_soft_limits_of_a_urdf_bound_its_motions() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    urdf(
        &at("soft.urdf"),
        "lower=\"-2\" upper=\"2\" velocity=\"3\" effort=\"40\"",
        "<safety_controller soft_lower_limit=\"-0.5\" soft_upper_limit=\"0.7\" k_velocity=\"10\"/>",
    );
    let out = at("m.toml");
    let too_far = ["--kind", "staircase", "--amplitude", "0.9", "--margin", "0"];
    let sentence = refuse(&mut excite(&at("soft.urdf"), &too_far, &out));
    assert!(
        sentence.contains("0.6") && sentence.contains("--amplitude")
            || sentence.contains("amplitude is 0.9"),
        "{sentence}"
    );
    let fits = [
        "--kind",
        "staircase",
        "--amplitude",
        "0.55",
        "--margin",
        "0",
    ];
    both(&mut excite(&at("soft.urdf"), &fits, &out));
    urdf(
        &at("degrees.urdf"),
        "lower=\"-2\" upper=\"2\" velocity=\"3\" effort=\"40\"",
        "<safety_controller soft_lower_limit=\"-90\" soft_upper_limit=\"90\" k_velocity=\"10\"/>",
    );
    let sentence = refuse(&mut excite(&at("degrees.urdf"), &fits, &out));
    assert!(sentence.contains("look like degrees"), "{sentence}");
}

#[test]
fn options_of_one_kind_are_refused_with_another_and_numbers_that_no_motion_has_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("m.toml");
    for (options, words) in [
        (vec!["--amplitude", "0.3"], vec!["--amplitude", "staircase"]),
        (
            vec!["--kind", "chirp", "--speed", "1"],
            vec!["--speed", "sweep"],
        ),
        (
            vec!["--kind", "sweep", "--band", "1,5"],
            vec!["--band", "chirp"],
        ),
        (
            vec!["--kind", "sweep", "--cycles", "3"],
            vec!["--cycles", "reversals"],
        ),
        (vec!["--kind", "sweep", "--speed", "1"], vec!["two above 0"]),
        (
            vec!["--kind", "sweep", "--speed", "0.1,50"],
            vec!["50", "velocity limit"],
        ),
        (
            vec!["--kind", "reversals", "--speed", "-1"],
            vec!["speed", "above 0"],
        ),
        (
            vec!["--kind", "chirp", "--band", "5,1"],
            vec!["band", "lower one first"],
        ),
        (
            vec!["--kind", "chirp", "--band", "5"],
            vec!["--band", "two"],
        ),
        (vec!["--margin", "2"], vec!["margin", "2"]),
        (vec!["--speed-share", "0"], vec!["speed share", "above 0"]),
        (
            vec!["--kind", "sweep", "--amplitude", "5"],
            vec!["amplitude is 5"],
        ),
    ] {
        let sentence = refuse(&mut excite(&robot("one-link.toml"), &options, &out));
        for word in words {
            assert!(sentence.contains(word), "{options:?}: {sentence}");
        }
    }
    assert!(!out.exists());
}
