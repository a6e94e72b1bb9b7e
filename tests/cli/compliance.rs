//! `rig compliance`: stiffness of the joints, and the compliance of the tool point.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::run::{refuse, rig, robot, succeed};

fn compliance(robot: &Path, out: &Path) -> Command {
    let mut command = rig();
    command.args(["compliance", "--robot"]).arg(robot);
    command.arg("--out").arg(out);
    command
}

fn json(folder: &Path) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("compliance.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The rig with an elastic gear, and without it.
fn elastic(folder: &Path) -> [PathBuf; 2] {
    let text = fs::read_to_string(robot("one-link.toml")).unwrap();
    let text = text.replace("theta = 0.0 ", "theta = -1.5707963267948966 ");
    let effect = "\n[[effect]]\nkind = \"joint_elasticity\"\njoint = \"link\"\nstiffness = 1200.0\ndamping = 0.6\nlink_friction = 0.0\n";
    let paths = ["elastic.toml", "rigid.toml"].map(|name| folder.join(name));
    fs::write(&paths[0], format!("{text}{effect}")).unwrap();
    fs::write(&paths[1], text).unwrap();
    paths
}

/// Designed, simulated and identified: the stiffness that was put in comes out, and its file is part of a description.
#[test]
fn a_stiffness_is_identified_by_a_chirp_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [elastic, rigid] = elastic(folder.path());
    let mut excite = rig();
    excite.args(["excite", "--kind", "chirp", "--band", "1,50", "--robot"]);
    succeed(excite.arg(&rigid).arg("--out").arg(at("chirp.toml")));
    let mut simulate = rig();
    simulate.args(["simulate", "--rate", "1000", "--noise-torque", "0.05"]);
    simulate.args(["--noise-position", "1e-5", "--robot"]);
    simulate
        .arg(&elastic)
        .arg("--trajectory")
        .arg(at("chirp.toml"));
    succeed(simulate.arg("--out").arg(at("run.csv")));
    let mut command = compliance(&rigid, &at("found"));
    let said = succeed(command.arg("--frequency").arg(at("run.csv")));
    assert!(said.contains("antiresonance"), "{said}");
    for name in ["compliance.toml", "report.html"] {
        assert!(at("found").join(name).is_file(), "{name}");
    }
    let found = json(&at("found"));
    assert_eq!(found["schema"], "rig-compliance/1");
    let stiffness = found["drives"][0]["stiffness"]["value"].as_f64().unwrap();
    assert!((stiffness / 1200.0 - 1.0).abs() < 0.05, "{stiffness}");
    // A clock in milliseconds makes every frequency a thousandth.
    let text = fs::read_to_string(at("run.csv")).unwrap();
    let late = |(row, line): (usize, &str)| match (row, line.split_once(',')) {
        (0, _) | (_, None) => line.to_owned(),
        (_, Some((t, rest))) => format!("{},{rest}", 1e3 * t.parse::<f64>().unwrap()),
    };
    let lines: Vec<String> = text.lines().enumerate().map(late).collect();
    fs::write(at("late.csv"), lines.join("\n") + "\n").unwrap();
    let mut command = compliance(&rigid, &at("late"));
    let said = refuse(command.arg("--frequency").arg(at("late.csv")));
    assert!(said.contains("t looks like milliseconds"), "{said}");
    // The blocks belong into a description, and are read from there.
    let blocks = fs::read_to_string(at("found/compliance.toml")).unwrap();
    let text = fs::read_to_string(&rigid).unwrap();
    fs::write(at("whole.toml"), format!("{text}\n{blocks}")).unwrap();
    succeed(compliance(&at("whole.toml"), &at("again")).args(["--tool", "0.5", "0", "0"]));
    let again = json(&at("again"));
    assert_eq!(again["drives"][0]["source"], "description");
    let back = again["drives"][0]["stiffness"]["value"].as_f64().unwrap();
    assert!((back / stiffness - 1.0).abs() < 1e-6);
    let principal = &again["poses"][0]["principal"][0]["compliance"]["value"];
    assert!((principal.as_f64().unwrap() * stiffness / 0.25 - 1.0).abs() < 1e-6);
    // The same input gives the same bytes, and nothing is overwritten.
    let mut command = compliance(&rigid, &at("found"));
    let said = refuse(command.arg("--frequency").arg(at("run.csv")));
    assert!(said.contains("--force"), "{said}");
    let before = fs::read(at("found/compliance.json")).unwrap();
    succeed(command.arg("--force"));
    assert_eq!(before, fs::read(at("found/compliance.json")).unwrap());
}

/// Friction stops the motor of a chirp near the antiresonance; a multisine keeps it moving, and its periods are averaged.
#[test]
fn a_stiffness_is_identified_by_whole_periods_of_a_multisine() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [elastic, rigid] = elastic(folder.path());
    let mut excite = rig();
    excite.args(["excite", "--kind", "multisine", "--band", "1,50"]);
    excite.args(["--start", "0", "--robot"]).arg(&rigid);
    let said = refuse(excite.arg("--out").arg(at("multisine.toml")));
    assert!(said.contains("give a .csv"), "{said}");
    let mut excite = rig();
    excite.args(["excite", "--kind", "multisine", "--band", "1,50"]);
    excite.args(["--start", "0", "--robot"]).arg(&rigid);
    let said = succeed(excite.arg("--out").arg(at("multisine.csv")));
    assert!(said.contains("5 periods of 16 s"), "{said}");
    let mut simulate = rig();
    simulate.args(["simulate", "--noise-torque", "0.05"]);
    simulate.args(["--noise-position", "1e-5", "--robot"]);
    simulate.arg(&elastic).arg("--trajectory");
    simulate.arg(at("multisine.csv"));
    succeed(simulate.arg("--out").arg(at("run.csv")));
    let mut command = compliance(&rigid, &at("found"));
    command.args(["--tool", "0.5", "0", "0", "--pose", "0"]);
    succeed(command.arg("--frequency").arg(at("run.csv")));
    let found = json(&at("found"));
    let periodic = &found["frequency"]["periodic"];
    assert_eq!(periodic["periods"], 4);
    assert!(periodic["odd"].as_f64() > periodic["noise"].as_f64());
    let stiffness = found["drives"][0]["stiffness"]["value"].as_f64().unwrap();
    assert!((stiffness / 1200.0 - 1.0).abs() < 0.01, "{stiffness}");
    assert_eq!(found["warnings"].as_array().unwrap().len(), 0, "{found}");
    let page = fs::read_to_string(at("found/report.html")).unwrap();
    assert!(page.contains("the mean over 4 periods") && page.contains("odd distortion"));
}

#[test]
fn matrices_and_map_come_from_a_given_stiffness() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut command = compliance(&robot("tx40.toml"), &at("found"));
    command.args(["--stiffness", "2e4,2.5e4,1.2e4,4e3,3e3,1.5e3"]);
    command.args(["--stiffness-std", "400,500,240,80,60,30"]);
    command.args(["--pose", "0.3,-0.5,1.2,0.4,0.8,-0.6"]);
    command.args(["--pose", "-1.2", "0.4", "0.9", "-0.7", "-1.1", "2.0"]);
    let said = succeed(&mut command);
    assert_eq!(said.matches("largest displacement").count(), 2, "{said}");
    let found = json(&at("found"));
    assert_eq!(found["poses"][0]["rank"], 6);
    assert!(found["poses"][1]["stiffness"][0][0].as_f64().unwrap() > 0.0);
    assert_eq!(found["map"]["values"].as_array().unwrap().len(), 41);
    let page = fs::read_to_string(at("found/report.html")).unwrap();
    assert!(page.contains("Compliance over the workspace") && page.contains("most compliant"));
    let blocks = fs::read_to_string(at("found/compliance.toml")).unwrap();
    assert!(blocks.contains("No stiffness was measured"), "{blocks}");
}

#[test]
fn wrong_options_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let arm = robot("irp6.toml");
    for (options, said) in [
        (&[][..], "stiffness of no joint"),
        (&["--stiffness", "1,2"], "5 joints"),
        (&["--stiffness", "1,2,3,4,0"], "greater than 0"),
        (&["--stiffness", "-1,2,3,4,5"], "--stiffness -1 of joint"),
        (
            &["--stiffness", "1,2,3,4,5", "--stiffness-std", "-3,4"],
            "--stiffness-std -3 of joint \"column\" is not possible: a standard deviation is 0 or greater",
        ),
        (
            &["--stiffness", "4e4,1.5,1.2,5e3,3e3", "--pose", "-1", "2"],
            "5 joints",
        ),
        (
            &["--stiffness", "4e4,1.5,1.2,5e3,3e3", "--pose", "1,2"],
            "5 joints",
        ),
        (
            &["--stiffness", "4e4,1.5,1.2,5e3,3e3", "--pose", "1,x,3,4,5"],
            "`x` is not a number",
        ),
        (
            &[
                "--stiffness",
                "4e4,1.5,1.2,5e3,3e3",
                "--map",
                "column,elbow",
            ],
            "no joint of",
        ),
        (
            &[
                "--stiffness",
                "4e4,1.5,1.2,5e3,3e3",
                "--map",
                "column,column",
            ],
            "two different",
        ),
        (
            &[
                "--stiffness",
                "4e4,1.5,1.2,5e3,3e3",
                "--tool",
                "0",
                "0",
                "150",
            ],
            "at most 10 m",
        ),
    ] {
        let sentence = refuse(compliance(&arm, &at("out")).args(options));
        assert!(sentence.contains(said), "{options:?}: {sentence}");
    }
    assert!(!at("out").exists());
}

#[test]
fn recordings_that_show_no_stiffness_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let arm = robot("irp6.toml");
    let given = ["--stiffness", "4e4,1.5,1.2,5e3,3e3"];
    let rows = |head: &str, row: &dyn Fn(f64) -> String| {
        let list: Vec<String> = (0..3000)
            .map(|k| format!("{:.3},{}", 0.001 * f64::from(k), row(0.001 * f64::from(k))))
            .collect();
        format!("t,{head}\n{}\n", list.join("\n"))
    };
    let file = |name: &str, text: String| {
        fs::write(at(name), text).unwrap();
        at(name)
    };
    let joints = "q1,q2,q3,q4,q5";
    let torques = "tau1,tau2,tau3,tau4,tau5";
    let plain = file(
        "plain.csv",
        rows(&format!("{joints},{torques}"), &|t| {
            format!(
                "{:.6},-1.5,0,0,0,{:.4},1,1,1,1",
                0.1 * (9.0 * t).sin(),
                (9.0 * t).cos()
            )
        }),
    );
    let loose = file(
        "loose.csv",
        rows(&format!("{joints},dz"), &|_| "0,-1.5,0,0,0,0.001".into()),
    );
    let moving = file(
        "moving.csv",
        rows(&format!("{joints},dz,fx,fy,fz"), &|t| {
            format!("{:.5},-1.5,0,0,0,0.001,0,0,{t:.4}", 0.1 * t)
        }),
    );
    let refused = |option: &str, data: &Path, more: &[&str]| {
        refuse(
            compliance(&arm, &at("out"))
                .args(given)
                .arg(option)
                .arg(data)
                .args(more),
        )
    };
    assert!(refused("--static", &plain, &[]).contains("shows no deflection"));
    assert!(refused("--static", &loose, &[]).contains("no force"));
    assert!(refused("--static", &moving, &[]).contains("hold the motors"));
    assert!(refused("--frequency", &plain, &["--joint", "lower_arm"]).contains("turns a screw"));
    assert!(refused("--frequency", &plain, &["--joint", "wrist"]).contains("no joint of"));
    assert!(
        refused("--frequency", &plain, &["--instrument", "reference"]).contains("no reference")
    );
    assert!(refused("--static", &at("missing.csv"), &[]).contains("missing.csv"));
    assert!(!at("out").exists());
}

/// Recordings of a held arm: the gear has 1500 N·m/rad, the arm 0.5 m. The file may have other units and names.
#[test]
fn units_and_names_of_held_recordings_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let held = |name: &str, head: &str, q: f64, torque: &str| {
        let mut text = format!("{head}\n");
        for k in 0..2000 {
            let force = 20.0 * (0.0063 * f64::from(k)).sin();
            let deflection = 0.25 * force / 1500.0;
            let t = 0.02 * f64::from(k);
            text.push_str(&format!(
                "{t:.2},{q},0,0,{force:.5},{deflection:.9}{torque}\n"
            ));
        }
        fs::write(at(name), text).unwrap();
        at(name)
    };
    let rig = robot("one-link.toml");
    let run = |data: &Path, out: &str, options: &[&str]| {
        let mut command = compliance(&rig, &at(out));
        command
            .arg("--static")
            .arg(data)
            .args(["--tool", "0.5", "0", "0"]);
        command.args(options);
        command
    };
    let head = "t,q1,fx,fy,fz,dz";
    let good = held("good.csv", head, 0.0, "");
    let said = succeed(&mut run(&good, "good", &["--pose", "0"]));
    // The deflection is written to first order of the twist, 3 mrad at most.
    let is_right = |said: &str| {
        let value = said.split("stiffness ").nth(1).unwrap();
        let value: f64 = value.split(' ').next().unwrap().parse().unwrap();
        (value / 1500.0 - 1.0).abs() < 1e-4
    };
    assert!(is_right(&said), "{said}");
    // Motors held at 68.75° and torques in N·mm.
    let said = refuse(&mut run(&held("deg.csv", head, 68.75, ""), "out", &[]));
    assert!(said.contains("q1 looks like degrees"), "{said}");
    let many = held("nmm.csv", "t,q1,fx,fy,fz,dz,tau1", 0.0, ",2900");
    let said = refuse(&mut run(&many, "out", &[]));
    assert!(said.contains("tau1") && said.contains("2900"), "{said}");
    // A pose in degrees.
    let said = refuse(&mut run(&good, "out", &["--pose", "-90"]));
    assert!(
        said.contains("looks like degrees") && said.contains("-1.571"),
        "{said}"
    );
    // Other names: listed, then mapped.
    let other = held("names.csv", "t,q1,push_x,push_y,push_z,dz", 0.0, "");
    let said = refuse(&mut run(&other, "out", &[]));
    for word in ["`push_z`", "--map", "--mapping", "rig inspect"] {
        assert!(said.contains(word), "{said}");
    }
    let maps = [
        "--map",
        "fx=push_x",
        "--map",
        "fy=push_y",
        "--map",
        "fz=push_z",
    ];
    let said = succeed(&mut run(&other, "mapped", &maps));
    assert!(is_right(&said), "{said}");
}
