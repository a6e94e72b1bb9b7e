//! `rig inspect`, and its proposals taken by the other commands.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::run::{refuse, rig, robot, succeed};

/// A file that another program wrote (`tests/recordings/make.py`).
fn of_others(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/recordings")
        .join(name)
}

/// Writes a log with other names and units: a link of 0.11 kg·m² with gravity and friction, over 12 s at 250 Hz.
fn foreign_log(path: &Path) {
    let mut text = String::from("Time [ms];Motor on;Angle [deg];Torque [mNm]\n");
    for k in 0..3000 {
        let t = 0.004 * f64::from(k);
        let q = 0.9 * (1.7 * t).sin() + 0.5 * (4.1 * t).sin();
        let qd = 0.9 * 1.7 * (1.7 * t).cos() + 0.5 * 4.1 * (4.1 * t).cos();
        let qdd = -0.9 * 1.7 * 1.7 * (1.7 * t).sin() - 0.5 * 4.1 * 4.1 * (4.1 * t).sin();
        // A sum of waves that no model has, in place of noise.
        let rest = 0.003 * (611.0 * t).sin() + 0.003 * (487.0 * t).cos();
        let tau = 0.11 * qdd + 2.5 * q.cos() + 0.4 * qd.signum() + 0.3 * qd + rest;
        writeln!(
            text,
            "{};1;{:.6};{:.4}",
            4 * k,
            q.to_degrees(),
            1000.0 * tau
        )
        .unwrap();
    }
    fs::write(path, text).unwrap();
}

#[test]
fn the_options_that_inspect_proposes_make_a_foreign_log_readable() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    foreign_log(&log);
    let one_link = robot("one-link.toml");
    let identify = |more: &[&str], out: &str| {
        let mut command = rig();
        command
            .args(["identify", "--compare", "none", "--robot"])
            .arg(&one_link);
        command
            .arg("--data")
            .arg(&log)
            .arg("--out")
            .arg(folder.path().join(out));
        command.args(more);
        command
    };
    let refused = refuse(&mut identify(&[], "plain"));
    assert!(refused.contains("q1"), "{refused}");
    let page = folder.path().join("page");
    let json = succeed(
        rig()
            .arg("inspect")
            .arg(&log)
            .arg("--json")
            .arg("--out")
            .arg(&page),
    );
    let found: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(found["schema"], "rig-inspect/1");
    assert_eq!(found["topics"][0]["rows"], 3000);
    let options = found["proposal"]["options"].as_array().unwrap();
    // As a shell takes them: without the quotation marks.
    let words: Vec<String> = (options.iter())
        .flat_map(|option| {
            let (name, value) = option.as_str().unwrap().split_once(' ').unwrap();
            [name.to_owned(), value.trim_matches('\'').to_owned()]
        })
        .collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    succeed(&mut identify(&words, "mapped"));
    let text = fs::read_to_string(folder.path().join("mapped/identification.json")).unwrap();
    let result: Value = serde_json::from_str(&text).unwrap();
    let value = |name: &str| {
        let all = result["base_parameters"].as_array().unwrap();
        let own = all
            .iter()
            .find(|p| p["expression"].as_str().unwrap().contains(name));
        own.unwrap()["value"].as_f64().unwrap()
    };
    assert!((value("fv1") - 0.3).abs() < 0.02 && (value("mx1").abs() * 9.81 - 2.5).abs() < 0.02);
    for file in ["report.html", "inspect.json"] {
        assert!(
            fs::metadata(page.join(file)).unwrap().len() > 1000,
            "{file}"
        );
    }
    // Nothing is overwritten.
    let again = refuse(rig().arg("inspect").arg(&log).arg("--out").arg(&page));
    assert!(again.contains("--force"), "{again}");
}

#[test]
fn a_bag_is_described_and_a_wrong_file_is_refused_in_one_sentence() {
    let text = succeed(rig().arg("inspect").arg(of_others("bag_split")));
    for words in [
        "/joint_states (sensor_msgs/msg/JointState): 200 rows",
        "/ft_sensor/wrench (geometry_msgs/msg/WrenchStamped): 40 rows",
        "position/elbow",
        "fx = ft_sensor/wrench/wrench/force/x",
        "find these columns without options",
    ] {
        assert!(text.contains(words), "{words}:\n{text}");
    }
    let missing = refuse(rig().args(["inspect", "no-such-file.csv"]));
    assert!(missing.contains("no-such-file.csv"), "{missing}");
    let folder = tempfile::tempdir().unwrap();
    let empty = refuse(rig().arg("inspect").arg(folder.path()));
    assert!(empty.contains("metadata.yaml"), "{empty}");
    let unit = refuse(
        rig()
            .args(["identify", "--unit", "q=grad", "--robot"])
            .arg(robot("one-link.toml"))
            .arg("--data")
            .arg(of_others("other.mcap"))
            .args(["--out", "unused"]),
    );
    assert!(
        unit.contains("--unit q=grad") && unit.contains("deg"),
        "{unit}"
    );
}

#[test]
fn a_file_that_identify_refuses_is_not_called_readable() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    let rows = |end: &str| -> String {
        let row = |k: usize| format!("{},0.5,1{end}\n", 0.001 * k as f64);
        (0..100).map(row).collect()
    };
    fs::write(&log, format!("t [s],q1 [rad],tau1 [Nm]\n{}", rows(""))).unwrap();
    let text = succeed(rig().arg("inspect").arg(&log));
    assert!(!text.contains("refused by"), "{text}");
    fs::write(&log, format!("t,q1,tau1\n{}", rows(","))).unwrap();
    let text = succeed(rig().arg("inspect").arg(&log));
    assert!(
        text.contains("refused by `rig identify`") && text.contains("csv:2"),
        "{text}"
    );
    assert!(!text.contains("without options"), "{text}");
}
