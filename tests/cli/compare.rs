//! `rig compare`: several recordings of one robot, and robots that are simulated.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::run::{real_data, refuse, rig, robot, succeed};

/// Simulates the one-link rig on a designed motion.
fn recorded(folder: &Path, description: &Path, name: &str, seed: &str) -> PathBuf {
    let trajectory = folder.join(format!("{name}.toml"));
    let mut excite = rig();
    excite.args([
        "excite",
        "--starts",
        "2",
        "--harmonics",
        "3",
        "--seed",
        seed,
    ]);
    excite.arg("--robot").arg(robot("one-link.toml"));
    succeed(excite.arg("--out").arg(&trajectory));
    let out = folder.join(format!("{name}.csv"));
    let mut simulate = rig();
    simulate.args([
        "simulate",
        "--rate",
        "500",
        "--quantised",
        "--noise-torque",
        "0.02",
    ]);
    simulate.args(["--seed", seed, "--robot"]).arg(description);
    simulate.arg("--trajectory").arg(&trajectory);
    succeed(simulate.arg("--out").arg(&out));
    out
}

fn compare(description: &Path, data: &[&Path], options: &[&str], out: &Path) -> Command {
    let mut command = rig();
    command.args(["compare", "--robot"]).arg(description);
    if !data.is_empty() {
        command.arg("--data").args(data);
    }
    command.args(options).arg("--out").arg(out);
    command
}

fn json(folder: &Path) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("compare.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// Four recordings of one rig agree; with a fifth of a rig with more friction they differ, and friction is named.
/// The answer: the last line before the path of the report.
fn answer(said: &str) -> &str {
    let mut lines = said.lines().rev();
    assert!(lines.next().unwrap().starts_with("report: "), "{said}");
    lines.next().unwrap()
}

#[test]
fn recordings_of_one_rig_agree_and_one_with_more_friction_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rig_file = robot("one-link.toml");
    let text = fs::read_to_string(&rig_file).unwrap();
    let line = |key: &str| {
        text.lines()
            .find(|l| l.trim_start().starts_with(key))
            .unwrap()
            .to_owned()
    };
    let worn = text
        .replace(&line("viscous"), "viscous = 0.36")
        .replace(&line("coulomb"), "coulomb = 0.48");
    assert_ne!(worn, text);
    fs::write(at("worn.toml"), worn).unwrap();
    let same: Vec<PathBuf> = ["11", "12", "13", "14"]
        .map(|seed| recorded(folder.path(), &rig_file, &format!("day{seed}"), seed))
        .to_vec();
    let data: Vec<&Path> = same.iter().map(PathBuf::as_path).collect();

    let said = succeed(&mut compare(&rig_file, &data, &[], &at("agree")));
    assert_eq!(answer(&said), "The sets agree.", "{said}");
    let found = json(&at("agree"));
    assert_eq!(found["schema"], "rig-compare/1");
    assert_eq!(found["grade"], "agree");
    assert_eq!(found["sets"][0]["name"], "day11");
    let inertia = &found["parameters"][2];
    assert_eq!(inertia["expression"], "Izz1 + Ia1");
    let off = inertia["value"].as_f64().unwrap() - 0.17;
    assert!(
        off.abs() < inertia["half_interval"].as_f64().unwrap(),
        "{inertia}"
    );

    let changed = recorded(folder.path(), &at("worn.toml"), "worn-rig", "15");
    let joined = format!("before={},{}", same[0].display(), same[1].display());
    let after = format!("after={}", changed.display());
    let sets = ["--set", joined.as_str(), "--set", after.as_str()];
    let said = succeed(&mut compare(&rig_file, &data[2..], &sets, &at("differ")));
    assert!(said.contains("viscous and Coulomb friction"), "{said}");
    let found = json(&at("differ"));
    assert_eq!(found["grade"], "differ-and-matter");
    assert_eq!(found["causes"]["named"], "friction");
    let names: Vec<&str> = (found["sets"].as_array().unwrap().iter())
        .map(|set| set["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["before", "after", "day13", "day14"]);
    // With a larger tolerance the same difference does not matter, and the answer says so in one line.
    let tolerant = [&sets[..], &["--tolerance", "0.2"]].concat();
    let said = succeed(&mut compare(&rig_file, &data[2..], &tolerant, &at("same")));
    let line = answer(&said);
    assert!(
        line.starts_with("The parameters differ by more than their errors, but the torque")
            && line.ends_with("%: use whichever set."),
        "{said}"
    );
    assert_eq!(json(&at("same"))["grade"], "differ-without-effect");

    // The pooled description is one that other commands take.
    let mut base = rig();
    succeed(base.args(["base", "--robot"]).arg(at("agree/pooled.toml")));
    assert!(at("agree/report.html").is_file());
    // The same inputs give the same bytes, and nothing is overwritten.
    succeed(&mut compare(&rig_file, &data, &[], &at("again")));
    let read = |name: &str| fs::read(at(name)).unwrap();
    assert_eq!(read("agree/compare.json"), read("again/compare.json"));
    let said = refuse(&mut compare(&rig_file, &data, &[], &at("agree")));
    assert!(said.contains("--force"), "{said}");
    // The positions stand on the encoder's counts: 8192 a motor turn, 50 motor turns a turn of the link.
    let step = std::f64::consts::TAU / (8192.0 * 50.0);
    let recording = fs::read_to_string(&same[0]).unwrap();
    for line in recording.lines().skip(100).take(200) {
        let q: f64 = line.split(',').nth(1).unwrap().parse().unwrap();
        let counts = q / step;
        assert!((counts - counts.round()).abs() < 1e-5, "{q}");
    }
}

#[test]
fn wrong_sets_and_options_of_a_comparison_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let rig_file = robot("one-link.toml");
    let data = recorded(folder.path(), &rig_file, "run", "3");
    let said = refuse(&mut compare(&rig_file, &[&data], &[], &out));
    assert!(said.contains("at least two"), "{said}");
    let said = refuse(&mut compare(&rig_file, &[&data, &data], &[], &out));
    assert!(said.contains("twice"), "{said}");
    let other = recorded(folder.path(), &rig_file, "other", "4");
    let set = |file: &Path| format!("run={}", file.display());
    let twice = [set(&data), set(&other)];
    let options = ["--set", &twice[0], "--set", &twice[1]];
    let said = refuse(&mut compare(&rig_file, &[], &options, &out));
    assert!(said.contains("Two sets are named \"run\""), "{said}");
    let said = refuse(&mut compare(
        &rig_file,
        &[&data, &other],
        &["--tolerance", "0"],
        &out,
    ));
    assert!(said.contains("tolerance 0"), "{said}");
    let missing = folder.path().join("missing.csv");
    let said = refuse(&mut compare(&rig_file, &[&data, &missing], &[], &out));
    assert!(said.contains("missing.csv"), "{said}");
    for options in [
        &["--set", "run"][..],
        &["--simulated"],
        &["--set", "=a.csv"],
        &[],
    ] {
        let data: &[&Path] = if options == ["--simulated"] {
            &[&data]
        } else {
            &[]
        };
        let output = compare(&rig_file, data, options, &out).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{options:?}");
    }
    assert!(!out.exists());
}

#[test]
fn a_robot_is_simulated_and_identified_in_four_ways() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let options = ["--simulated", "--seed", "2"];
    let said = succeed(&mut compare(&robot("one-link.toml"), &[], &options, &out));
    for words in [
        "off-line differential",
        "on-line integral",
        "true parameters",
    ] {
        assert!(said.contains(words), "{said}");
    }
    assert!(out.join("report.html").is_file() && out.join("one-link/report.html").is_file());
    let found = json(&out.join("one-link"));
    assert_eq!(found["schema"], "rig-compare-simulated/1");
    for estimate in found["estimates"].as_array().unwrap() {
        assert!(estimate["torque_error"].as_f64().unwrap() < 1e-3);
    }
    let said = refuse(&mut compare(&robot("one-link.toml"), &[], &options, &out));
    assert!(said.contains("--force"), "{said}");
}

/// The table of docs/compare.md has what the command prints.
#[test]
fn the_documented_comparison_of_methods_is_what_is_printed() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = rig();
    command.args(["compare", "--simulated", "--out"]);
    let said = succeed(command.arg(folder.path().join("methods")));
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/compare.md");
    let page = fs::read_to_string(page).unwrap();
    let between = |text: &str, before: &str, after: &str| -> String {
        let rest = text.split_once(before).unwrap().1;
        rest.split_once(after).unwrap().0.to_owned()
    };
    for (name, shown) in [
        ("one-link", "one-link"),
        ("irp6", "IRp-6"),
        ("edda", "EDDA"),
    ] {
        let mut lines = said.lines();
        let head = lines
            .find(|line| line.starts_with(&format!("{name}: ")))
            .unwrap();
        let mut cells = vec![
            shown.to_owned(),
            between(head, ": ", " base parameters"),
            between(head, "motion of ", ","),
            between(head, "cut off at ", ","),
            between(head, "Hz, ", " rows/s") + " /s",
        ];
        for line in lines.take(4) {
            cells.push(between(line, "torque error ", ","));
        }
        let row = format!("| {} |", cells.join(" | "));
        assert!(page.contains(&row), "docs/compare.md lacks {row}");
    }
}

/// The two public recordings of EMPS agree: the second one gives 1 % less mass, and the pooled values are near the
/// published ones.
#[test]
fn the_public_recordings_of_emps_are_pooled() {
    let Some(data) = real_data("emps") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let files = [data.join("train.csv"), data.join("test_pulses.csv")];
    let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    succeed(&mut compare(&robot("emps.toml"), &files, &[], &out));
    let found = json(&out);
    // Each motion repeats, and so does what the model lacks; with one group a repetition the sets "differed".
    assert_eq!(found["grade"], "agree");
    for set in found["sets"].as_array().unwrap() {
        let period = set["repeats_after"].as_f64().unwrap();
        assert!((6.2..6.3).contains(&period), "{set}");
    }
    let mass = &found["parameters"][0];
    let of = |key: &str| mass[key].as_f64().unwrap();
    assert!(
        (of("value") - 95.1089).abs() < of("half_interval"),
        "{mass}"
    );
    assert!((of("value") - 95.1089).abs() < 1.5, "{mass}");
    let largest = found["torque"]["added"][0][0][1].as_f64().unwrap();
    assert!((0.01..0.04).contains(&largest), "{largest}");
}
