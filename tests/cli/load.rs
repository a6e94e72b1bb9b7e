//! `rig load`, `rig excite --load` and `rig simulate --load`: a load at the flange with a wrist sensor.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::run::{refuse, rig, robot, succeed};

const LOAD: &str =
    "mass = 1.0\nfirst_moment = [0.0, 0.02, 0.1]\ninertia = [0.02, 0.0, 0.0, 0.02, 0.0, 0.005]\n";

/// An arm of five joints with a sensor at its flange.
fn sensed(folder: &Path) -> PathBuf {
    let text = fs::read_to_string(robot("irp6.toml")).unwrap();
    let path = folder.join("sensed.toml");
    let sensor = "\n[wrist_sensor]\nposition = [0.0, 0.0, 0.05]\nreads = \"load\"\nforce_range = 60.0\nmoment_range = 3.0\n";
    fs::write(&path, text + sensor).unwrap();
    path
}

fn excite(robot: &Path, options: &[&str], out: &Path) -> Command {
    let mut command = rig();
    command.args(["excite", "--robot"]).arg(robot);
    command.args(options).arg("--out").arg(out);
    command
}

fn simulate(robot: &Path, trajectory: &Path, out: &Path) -> Command {
    let mut command = rig();
    command.args(["simulate", "--rate", "100", "--robot"]);
    command.arg(robot).arg("--trajectory").arg(trajectory);
    command.arg("--out").arg(out);
    command
}

#[test]
fn poses_are_designed_simulated_and_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let arm = sensed(folder.path());
    let poses = ["--load", "--poses", "4"];
    let said = succeed(excite(&arm, &poses, &at("poses.toml")).arg("--verbose"));
    assert!(
        said.contains("Pose 4: gravity along") && said.contains("kg per N"),
        "{said}"
    );
    succeed(&mut excite(&arm, &poses, &at("again.toml")));
    let read = |name: &str| fs::read_to_string(at(name)).unwrap();
    assert_eq!(read("poses.toml"), read("again.toml"));

    fs::write(at("load.toml"), LOAD).unwrap();
    for name in ["run.csv", "same.csv"] {
        let mut command = simulate(&arm, &at("poses.toml"), &at(name));
        command.arg("--load").arg(at("load.toml"));
        command.args(["--noise-force", "0.2", "--noise-moment", "0.005"]);
        command.args(["--sensor-bias", "1", "-2", "3", "0.1", "-0.2", "0.3"]);
        succeed(&mut command);
    }
    let recording = read("run.csv");
    assert_eq!(recording, read("same.csv"));
    assert!(
        recording
            .lines()
            .next()
            .unwrap()
            .ends_with("fx,fy,fz,mx,my,mz")
    );
    // The joints' columns do not depend on the sensor.
    let mut plain = simulate(&robot("irp6.toml"), &at("poses.toml"), &at("plain.csv"));
    succeed(plain.arg("--load").arg(at("load.toml")));
    let joints = |line: &str| line.split(',').take(21).collect::<Vec<_>>().join(",");
    assert!(read("plain.csv").lines().eq(recording.lines().map(joints)));
}

#[test]
fn motion_for_a_load_names_what_it_identifies() {
    let folder = tempfile::tempdir().unwrap();
    let arm = sensed(folder.path());
    let out = folder.path().join("m.toml");
    let quick = ["--load", "--starts", "1", "--harmonics", "2"];
    let said = succeed(&mut excite(&arm, &quick, &out));
    assert!(said.contains("six unknown biases: m, mx, my, mz"), "{said}");
    let other = folder.path().join("t.toml");
    let said = succeed(&mut excite(&robot("irp6.toml"), &quick, &other));
    assert!(said.contains("by the joint torques"), "{said}");
}

#[test]
fn wrong_options_of_a_motion_for_a_load_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let arm = sensed(folder.path());
    let out = folder.path().join("m.toml");
    let plain = robot("irp6.toml");
    for (robot, options, said) in [
        (&arm, &["--load", "--poses", "2"][..], "3 and 16"),
        (
            &arm,
            &["--load", "--poses", "4", "--harmonics", "3"],
            "--harmonics",
        ),
        (&plain, &["--load", "--poses", "4"], "[wrist_sensor]"),
        (
            &plain,
            &["--load", "--sensor-noise", "1,0.1"],
            "--torque-noise",
        ),
        (&arm, &["--load", "--sensor-noise", "1"], "two"),
        (&arm, &["--load", "--sensor-noise", "1,0"], "greater than 0"),
        (
            &arm,
            &["--load", "--torque-noise", "1,1,1,1,1"],
            "--sensor-noise",
        ),
        (&arm, &["--load", "--kind", "sweep"], "--load"),
    ] {
        let sentence = refuse(&mut excite(robot, options, &out));
        assert!(sentence.contains(said), "{options:?}: {sentence}");
    }
    for options in [&["--poses", "4"][..], &["--load", "--parameters", "links"]] {
        let output = excite(&arm, options, &out).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{options:?}");
    }
    assert!(!out.exists());
}

#[test]
fn wrong_loads_and_sensor_options_of_a_simulation_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let arm = sensed(folder.path());
    let out = at("run.csv");
    let trajectory = at("motion.toml");
    let staircase = ["--kind", "staircase", "--start", "-1.5708"];
    succeed(&mut excite(
        &robot("one-link.toml"),
        &staircase,
        &trajectory,
    ));
    fs::write(at("wrong.toml"), LOAD.replace("mass", "weight")).unwrap();
    for (name, said) in [("none.toml", "none.toml"), ("wrong.toml", "wrong.toml:1:")] {
        let mut command = simulate(&arm, &trajectory, &out);
        let sentence = refuse(command.arg("--load").arg(at(name)));
        assert!(sentence.contains(said), "{sentence}");
    }
    let mut command = simulate(&arm, &trajectory, &out);
    let sentence = refuse(command.args(["--noise-force", "-1"]));
    assert!(sentence.contains("--noise-force -1"), "{sentence}");
    let mut command = simulate(&robot("irp6.toml"), &trajectory, &out);
    let sentence = refuse(command.args(["--noise-moment", "0.1"]));
    assert!(sentence.contains("no [wrist_sensor]"), "{sentence}");
    let mut command = simulate(&arm, &trajectory, &out);
    command.args(["--sensor-bias", "1", "2", "3"]);
    assert_eq!(command.output().unwrap().status.code(), Some(2));
    assert!(!out.exists());
}

/// Designed, simulated and identified: the load that was put in comes out, and its files are read again.
#[test]
fn a_load_is_identified_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let arm = sensed(folder.path());
    fs::write(at("load.toml"), LOAD).unwrap();
    let poses = ["--load", "--poses", "6"];
    succeed(&mut excite(&arm, &poses, &at("poses.toml")));
    let record = |load: &str, out: &str| {
        let mut command = simulate(&arm, &at("poses.toml"), &at(out));
        command.arg("--load").arg(at(load));
        command.args(["--noise-force", "0.05", "--noise-moment", "0.002"]);
        command.args(["--sensor-bias", "1", "-2", "3", "0.1", "-0.2", "0.3"]);
        succeed(&mut command);
    };
    record("load.toml", "run.csv");
    let identify = |data: &str, options: &[&str], out: &str| {
        let mut command = rig();
        command.args(["load", "--robot"]).arg(&arm);
        command.arg("--data").arg(at(data)).args(options);
        command.arg("--out").arg(at(out));
        command
    };
    let said = succeed(&mut identify("run.csv", &[], "found"));
    assert!(
        said.contains("mass ") && said.contains("set_target_payload("),
        "{said}"
    );
    for name in ["load.json", "load.urdf", "report.html"] {
        assert!(at("found").join(name).is_file(), "{name}");
    }
    let json = fs::read_to_string(at("found/load.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["schema"], "rig-load/1");
    let off = json["mass"]["value"].as_f64().unwrap() - 1.0;
    assert!(
        off.abs() < 4.0 * json["mass"]["std"].as_f64().unwrap(),
        "{off}"
    );
    // What was found can be carried, and subtracted again.
    record("found/load.toml", "again.csv");
    let tool = at("found/load.toml");
    let said = refuse(&mut identify(
        "again.csv",
        &["--subtract", tool.to_str().unwrap()],
        "nothing",
    ));
    assert!(said.contains("mass"), "{said}");
    // Nothing is overwritten.
    let said = refuse(&mut identify("run.csv", &[], "found"));
    assert!(said.contains("--force"), "{said}");
}

#[test]
fn wrong_recordings_and_options_of_a_load_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let arm = sensed(folder.path());
    let rows = |columns: &str, row: &str| {
        let rows: Vec<String> = (0..300)
            .map(|k| format!("{},{row}", 0.01 * f64::from(k)))
            .collect();
        format!("t,q1,q2,q3,q4,q5,{columns}\n{}\n", rows.join("\n"))
    };
    let file = |name: &str, text: &str| {
        fs::write(at(name), text).unwrap();
        at(name)
    };
    let sensorless = file("sensorless.csv", &rows("fx", "0,-1.5,0,0,0,1"));
    let still = file(
        "still.csv",
        &rows("fx,fy,fz,mx,my,mz", "0,-1.5,0,0,0,1,2,3,4,5,6"),
    );
    let load = |data: &Path, options: &[&str]| {
        let mut command = rig();
        command
            .args(["load", "--robot"])
            .arg(&arm)
            .arg("--data")
            .arg(data);
        command.args(options).arg("--out").arg(at("out"));
        refuse(&mut command)
    };
    assert!(load(&sensorless, &[]).contains("no column `fy`"));
    assert!(load(&still, &[]).contains("in every row"));
    assert!(load(&at("missing.csv"), &[]).contains("missing.csv"));
    assert!(load(&still, &["--by", "torque"]).contains("tau1"));
    assert!(load(&still, &["--sensor-rotation", "0", "0", "90"]).contains("at most 7 rad"));
    assert!(!at("out").exists());
}

/// A copy counts the noise of a recording twice, whatever its name.
#[test]
fn a_copy_of_a_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let header = "t,q1,tau1,fx,fy,fz,mx,my,mz\n";
    let row = |k: u32| format!("{k},0.{k},0,1,2,{k},0,0,0.{k}\n");
    let rows: String = (0..9).map(row).collect();
    for name in ["own.csv", "copy.csv"] {
        fs::write(at(name), header.to_owned() + &rows).unwrap();
    }
    let refused = |command: &str, options: &[(&str, &str)]| {
        let mut rig = rig();
        rig.args([command, "--robot"]).arg(robot("one-link.toml"));
        for (option, name) in options {
            rig.arg(option).arg(at(name));
        }
        refuse(rig.arg("--out").arg(at("out")))
    };
    let says = |said: &str| said.contains("copy.csv holds samples of") && said.contains("own.csv");
    for (command, option) in [
        ("load", "--data"),
        ("compliance", "--static"),
        ("identify", "--data"),
    ] {
        let said = refused(command, &[(option, "own.csv"), (option, "copy.csv")]);
        assert!(says(&said), "{said}");
    }
    let said = refused("load", &[("--data", "own.csv"), ("--without", "copy.csv")]);
    assert!(said.contains("has the same bytes"), "{said}");
    assert!(!at("out").exists());
}

/// Friction of a gear that grows with the load is no part of the mass, and is told with its joint.
#[test]
fn friction_that_grows_with_the_load_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let effect =
        "\n[[effect]]\nkind = \"load_friction\"\njoint = \"lower_arm\"\ncoefficient = 0.1\n";
    let text = fs::read_to_string(robot("irp6.toml")).unwrap();
    fs::write(at("rubs.toml"), text + effect).unwrap();
    fs::write(at("part.toml"), LOAD).unwrap();
    succeed(&mut excite(
        &robot("irp6.toml"),
        &["--load", "--starts", "1", "--period", "12"],
        &at("motion.toml"),
    ));
    for (name, seed, load) in [("with.csv", "1", true), ("without.csv", "2", false)] {
        let mut command = rig();
        command.args(["simulate", "--robot"]).arg(at("rubs.toml"));
        command.arg("--trajectory").arg(at("motion.toml"));
        command.args(["--rate", "100", "--noise-torque", "0.5", "--seed", seed]);
        if load {
            command.arg("--load").arg(at("part.toml"));
        }
        succeed(command.arg("--out").arg(at(name)));
    }
    let mut command = rig();
    command
        .args(["load", "--by", "torque", "--robot"])
        .arg(robot("irp6.toml"));
    command.arg("--data").arg(at("with.csv"));
    command.arg("--without").arg(at("without.csv"));
    let said = succeed(command.arg("--out").arg(at("out")));
    println!("{said}");
    let text = fs::read_to_string(at("out/load.json")).unwrap();
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let rubbing = found["torque"]["load_friction"].as_array().unwrap();
    assert!(rubbing.iter().any(|own| own["joint"] == 1), "{found}");
    let mass = found["mass"]["value"].as_f64().unwrap();
    assert!((mass - 1.0).abs() < 0.03, "{mass}");
}

/// A limit of a motor that leaves no motion is named by file, line and joint.
#[test]
fn a_limit_of_a_motor_of_the_wrist_is_refused_by_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrist.toml");
    let text = fs::read_to_string(robot("irp6.toml")).unwrap();
    for (limit, line) in [
        ("position = [1e4, 2e4]", "position ="),
        ("torque = 1e-9", "torque = 1e-9"),
    ] {
        let text = text.clone() + "\n[joint.drive.limits]\n" + limit + "\n";
        let number = text.lines().count();
        assert!(text.lines().last().unwrap().starts_with(line));
        fs::write(&path, &text).unwrap();
        let out = folder.path().join("motion.toml");
        let said = refuse(&mut excite(&path, &["--load"], &out));
        let place = format!("wrist.toml:{number}:");
        assert!(
            said.contains(&place) && said.contains("wrist_turn"),
            "{said}"
        );
    }
}

/// Values of the sensor's temperature that are no numbers are refused by line and text, as those of its forces.
#[test]
fn temperatures_that_are_no_numbers_are_refused_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let arm = sensed(folder.path());
    for (written, said) in [
        ("nan", "\"nan\""),
        ("", "nothing"),
        ("warm", "\"warm\""),
        ("inf", "\"inf\""),
    ] {
        let rows: Vec<String> = (0..300)
            .map(|k| {
                let temp = if k == 100 { written } else { "25.5" };
                format!("{},0,-1.5,0,0,{k},1,2,3,4,5,6,{temp}", 0.01 * f64::from(k))
            })
            .collect();
        let data = folder.path().join("run.csv");
        let header = "t,q1,q2,q3,q4,q5,fx,fy,fz,mx,my,mz,temp";
        fs::write(&data, format!("{header}\n{}\n", rows.join("\n"))).unwrap();
        let mut command = rig();
        command
            .args(["load", "--robot"])
            .arg(&arm)
            .arg("--data")
            .arg(&data);
        let text = refuse(command.arg("--out").arg(folder.path().join("out")));
        assert!(
            text.contains("run.csv:102:") && text.contains("`temp`"),
            "{text}"
        );
        assert!(text.contains(said), "{written}: {text}");
    }
}
