//! Wrong input gets one clear sentence and an exit status that is not 0.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::run::{refuse, rig, robot, succeed};

/// A recording of the one-link rig: 4 s at 1 kHz of a motion within the limits, changed by `change`.
fn recording(folder: &Path, change: impl Fn(usize, &mut Vec<String>)) -> PathBuf {
    let mut text = String::from("t,q1,tau1\n");
    for k in 0..4000 {
        let t = k as f64 * 1e-3;
        let q = 1.5 * (3.0 * t).sin() + 0.3 * (11.0 * t).cos();
        let mut row = vec![
            format!("{t:.3}"),
            format!("{q:.9}"),
            format!("{:.6}", 2.9 * q.cos() + 0.4),
        ];
        change(k, &mut row);
        text += &row.join(",");
        text.push('\n');
    }
    let path = folder.join("recording.csv");
    fs::write(&path, text).unwrap();
    path
}

fn identify(robot: &Path, data: &Path, out: &Path) -> std::process::Command {
    learn("identify", robot, data, out)
}

fn learn(verb: &str, robot: &Path, data: &Path, out: &Path) -> std::process::Command {
    let mut command = rig();
    command
        .arg(verb)
        .arg("--robot")
        .arg(robot)
        .arg("--data")
        .arg(data)
        .arg("--out")
        .arg(out);
    command
}

/// What `rig identify` says of the one-link rig and this file; nothing may be left behind.
fn sentence(data: &Path) -> String {
    let out = tempfile::tempdir().unwrap();
    let text = refuse(&mut identify(&robot("one-link.toml"), data, out.path()));
    assert_eq!(
        fs::read_dir(out.path()).unwrap().count(),
        0,
        "something was written"
    );
    text
}

/// Asserts that a sentence names all of these.
fn names(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no \"{part}\" in: {text}");
    }
}

#[test]
fn a_missing_column_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.csv");
    fs::write(&path, "t,q1\n0,0\n0.001,0\n").unwrap();
    names(&sentence(&path), &["recording.csv", "tau1", "i1"]);
    fs::write(&path, "t,tau1\n0,0\n0.001,0\n").unwrap();
    names(&sentence(&path), &["recording.csv", "q1"]);
    fs::write(&path, "q1,tau1\n0,0\n0.001,0\n").unwrap();
    names(&sentence(&path), &["recording.csv", "t"]);
}

#[test]
fn not_a_number_is_named_by_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    for bad in ["NaN", "inf", "hello", ""] {
        let path = recording(folder.path(), |k, row| {
            if k == 1234 {
                row[2] = bad.into();
            }
        });
        // One line of header, counted from 1.
        names(&sentence(&path), &["recording.csv:1236", "tau1"]);
    }
}

#[test]
fn time_that_jumps_back_is_named_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path(), |k, row| {
        if k == 2000 {
            row[0] = "0.5".into();
        }
    });
    names(&sentence(&path), &["recording.csv:2002"]);
}

#[test]
fn units_off_by_a_thousand_and_degrees_are_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let scaled = |column: usize, factor: f64| {
        recording(folder.path(), |_, row| {
            let value: f64 = row[column].parse().unwrap();
            row[column] = format!("{}", value * factor);
        })
    };
    names(&sentence(&scaled(1, 1000.0)), &["q1"]);
    names(&sentence(&scaled(2, 1000.0)), &["tau1", "1000"]);
    names(&sentence(&scaled(2, 0.001)), &["tau1", "1000"]);
    names(
        &sentence(&scaled(1, 180.0 / core::f64::consts::PI)),
        &["q1", "degrees"],
    );
    names(&sentence(&scaled(0, 1000.0)), &["t", "millisecond"]);
}

#[test]
fn a_motion_that_never_moves_is_no_identification() {
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path(), |_, row| row[1] = "0.25".into());
    sentence(&path);
}

#[test]
fn a_recording_too_short_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.csv");
    fs::write(&path, "t,q1,tau1\n0,0,0\n0.001,0,0\n0.002,0,0\n").unwrap();
    names(&sentence(&path), &["3 rows", "256"]);
}

#[test]
fn empty_file_directory_and_missing_file_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("empty.csv");
    fs::write(&empty, "").unwrap();
    names(&sentence(&empty), &["empty.csv", "empty"]);
    names(&sentence(folder.path()), &["directory"]);
    names(
        &sentence(&folder.path().join("absent.csv")),
        &["absent.csv"],
    );
}

#[test]
fn two_gigabytes_of_nothing_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["zeros.csv", "zeros.mcap"] {
        let path = folder.path().join(name);
        fs::File::create(&path).unwrap().set_len(2 << 30).unwrap();
        let begin = Instant::now();
        names(&sentence(&path), &[name]);
        // Not a matter of speed: reading it all would take far longer, holding it all would not fit.
        assert!(begin.elapsed() < Duration::from_secs(20));
    }
    let path = folder.path().join("zeros.toml");
    fs::File::create(&path).unwrap().set_len(2 << 30).unwrap();
    let text = refuse(&mut identify(&path, &path, folder.path()));
    names(&text, &["zeros.toml"]);
}

#[test]
fn a_description_with_a_fault_is_named_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let good = fs::read_to_string(robot("one-link.toml")).unwrap();
    let data = recording(folder.path(), |_, _| ());
    let out = folder.path().join("out");
    let said = |text: String| {
        let path = folder.path().join("robot.toml");
        fs::write(&path, text).unwrap();
        refuse(&mut identify(&path, &data, &out))
    };
    let line = |part: &str| good.lines().position(|l| l.starts_with(part)).unwrap() + 1;
    let at = format!("robot.toml:{}", line("mass"));
    names(
        &said(good.replace("mass = 1.0", "mass = -1.0")),
        &[&at, "mass"],
    );
    names(
        &said(good.replace("mass = 1.0", "mass = \"heavy\"")),
        &[&at],
    );
    names(
        &said(good.replace("gear_ratio = 50.0", "gear_ration = 50.0")),
        &["robot.toml:", "gear_ration"],
    );
    let effect = "\n[[effect]]\nkind = \"torque_offset\"\noffset = 0.1\njoint = \"lnik\"\n";
    names(
        &said(format!("{good}{effect}")),
        &["robot.toml:", "lnik", "link"],
    );
    names(&said(String::new()), &["robot.toml"]);
}

#[test]
fn a_urdf_whose_last_link_has_no_mass_is_told_with_link_and_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    fs::write(
        &path,
        r#"<robot name="arm"><link name="base"/><link name="upper"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="10"/></joint></robot>"#,
    )
    .unwrap();
    let data = recording(folder.path(), |_, _| ());
    let output = identify(&path, &data, &folder.path().join("out"))
        .output()
        .unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stderr).unwrap();
    names(&text, &["arm.urdf:2:1: ", "last link `upper` has no mass"]);
}

#[test]
fn a_place_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let data = recording(folder.path(), |_, _| ());
    let blocked = folder.path().join("file");
    fs::write(&blocked, "").unwrap();
    let text = refuse(&mut identify(
        &robot("one-link.toml"),
        &data,
        &blocked.join("out"),
    ));
    names(&text, &["file"]);
}

#[test]
fn an_existing_description_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    fs::write(&path, "my work").unwrap();
    let text = refuse(rig().args(["init", "one-link", "--out"]).arg(&path));
    names(&text, &["mine.toml", "--force"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), "my work");
}

#[test]
fn a_torque_of_the_wrong_sign_is_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path(), |k, row| {
        // A motion with friction, its torque recorded with the wrong sign.
        let t = k as f64 * 1e-3;
        let q = 1.5 * (3.0 * t).sin() + 0.3 * (11.0 * t).cos();
        let qd = 4.5 * (3.0 * t).cos() - 3.3 * (11.0 * t).sin();
        let qdd = -13.5 * (3.0 * t).sin() - 36.3 * (11.0 * t).cos();
        let tau = 0.12 * qdd + 2.9 * q.cos() + 0.3 * qd + 0.4 * qd.signum();
        row[2] = format!("{:.6}", -tau);
    });
    names(&sentence(&path), &["wrong sign", "reverse tau1"]);
}

#[test]
fn a_recording_cannot_judge_itself() {
    let folder = tempfile::tempdir().unwrap();
    let data = recording(folder.path(), |_, _| ());
    let out = folder.path().join("out");
    for verb in ["identify", "diagnose"] {
        let mut command = learn(verb, &robot("one-link.toml"), &data, &out);
        names(
            &refuse(command.arg("--holdout").arg(&data)),
            &["recording.csv", "--holdout"],
        );
        assert!(!out.exists());
    }
}

#[test]
fn a_recording_is_not_overwritten_and_a_strange_joint_is_not_moved() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let record = |out: &Path| {
        let mut command = rig();
        command
            .args(["record", "--emulated", "--seconds", "0.1", "--out"])
            .arg(out);
        command
    };
    fs::write(at("precious.csv"), "measured once").unwrap();
    names(
        &refuse(&mut record(&at("precious.csv"))),
        &["precious.csv", "--force"],
    );
    assert_eq!(
        fs::read_to_string(at("precious.csv")).unwrap(),
        "measured once"
    );
    let excite = || {
        let mut command = rig();
        command
            .args(["excite", "--kind", "reversals", "--robot"])
            .arg(robot("one-link.toml"))
            .arg("--out")
            .arg(at("motion.toml"));
        command
    };
    crate::run::succeed(&mut excite());
    // Nor is a designed motion.
    names(&refuse(&mut excite()), &["motion.toml", "--force"]);
    crate::run::succeed(excite().arg("--force"));
    let text = fs::read_to_string(at("motion.toml")).unwrap();
    fs::write(at("elbow.toml"), text.replace("\"link\"", "\"elbow\"")).unwrap();
    let mut command = record(&at("new.csv"));
    command
        .arg("--robot")
        .arg(robot("one-link.toml"))
        .arg("--trajectory")
        .arg(at("elbow.toml"));
    names(&refuse(&mut command), &["elbow"]);
}

/// What one option asks for another rules out: said, not passed over.
#[test]
fn options_that_contradict_each_other_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("motion.toml");
    let excite = |options: &[&str]| {
        let mut command = rig();
        command.arg("excite").args(options).arg("--robot");
        command.arg(robot("one-link.toml")).arg("--out").arg(&out);
        refuse(&mut command)
    };
    names(&excite(&["--joint", "link"]), &["--joint link", "--kind"]);
    for (option, value) in [
        ("--criterion", "cond"),
        ("--parameters", "all"),
        ("--scaling", "sizes"),
        ("--torque-noise", "0.1"),
        ("--harmonics", "5"),
        ("--period", "4"),
        ("--ramp", "1"),
        ("--periods", "5"),
        ("--starts", "24"),
        ("--seed", "1"),
    ] {
        let said = excite(&["--kind", "chirp", option, value]);
        names(&said, &[option, "chirp", "--kind fourier"]);
    }
    assert!(!out.exists());
    let path = recording(folder.path(), |_, _| ());
    let learn =
        |options: &[&str]| refuse(identify(&robot("one-link.toml"), &path, &out).args(options));
    names(&learn(&["--window", "0.5"]), &["0.5 s", "--model integral"]);
    names(
        &learn(&["--estimator", "ols", "--prior-uncertainty", "0.1"]),
        &["0.1", "ols", "--estimator ridge"],
    );
}

/// Files as other programs write them get a sentence that says what to do, whatever they are called.
#[test]
fn files_of_other_programs_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.csv");
    for (bytes, words) in [
        (
            b"#ROSBAG V2.0\n".as_slice(),
            ["a ROS 1 bag", "mcap convert"],
        ),
        (b"SQLite format 3\0", ["SQLite", "ros2 bag convert"]),
        (b"\x1f\x8b\x08", ["gzip", "decompress"]),
        (b"PAR1\x15", ["Parquet", "close the writer"]),
        (b"FEA1\x15", ["Feather", "to_parquet"]),
    ] {
        fs::write(&path, bytes).unwrap();
        names(&sentence(&path), &["recording.csv", words[0], words[1]]);
    }
}

/// A file of this program that is no recording is named as what it is.
#[test]
fn a_description_or_a_trajectory_in_place_of_a_recording_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["irp6.toml", "one-link.toml", "tx40.toml"] {
        names(
            &sentence(&robot(name)),
            &[
                name,
                "a robot description",
                "a recording of the robot is wanted",
                "--robot",
            ],
        );
    }
    let motion = folder.path().join("motion.toml");
    let mut excite = rig();
    excite.args(["excite", "--kind", "sweep", "--robot"]);
    succeed(excite.arg(robot("one-link.toml")).arg("--out").arg(&motion));
    names(
        &sentence(&motion),
        &[
            "motion.toml",
            "a trajectory",
            "a recording of the robot is wanted",
        ],
    );
}

/// A number that no measurement has is named by line and column, in few digits.
#[test]
fn impossible_numbers_are_named_by_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path(), |k, row| {
        if k == 700 {
            row[1] = "1.04e224".into();
        }
    });
    let said = sentence(&path);
    names(&said, &["recording.csv:702", "`q1`", "no position"]);
    assert!(!said.contains("0000000"), "{said}");
}

/// A trajectory of another kind than the command runs: one sentence says what the file holds and what is wanted.
#[test]
fn a_file_that_is_no_motion_is_named_as_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut excite = rig();
    excite.args([
        "excite",
        "--kind",
        "staircase",
        "--start",
        "-1.5708",
        "--robot",
    ]);
    excite.arg(robot("one-link.toml"));
    succeed(excite.arg("--out").arg(at("motion.csv")));
    let wanted = [
        "not the parameters of a motion",
        "rig excite --out motion.toml",
    ];
    let mut record = rig();
    record.args(["record", "--emulated", "--home", "-1.5708", "--trajectory"]);
    record.arg(at("motion.csv")).arg("--out").arg(at("run.csv"));
    let said = refuse(&mut record);
    names(&said, &["motion.csv holds samples in columns"]);
    names(&said, &wanted);
    let mut simulate = rig();
    simulate.args(["simulate", "--robot"]);
    simulate.arg(robot("one-link.toml"));
    simulate.arg("--trajectory").arg(robot("one-link.toml"));
    let said = refuse(simulate.arg("--out").arg(at("run.csv")));
    names(&said, &["one-link.toml holds a robot description"]);
    names(&said, &wanted);
    assert!(!at("run.csv").exists());
}
