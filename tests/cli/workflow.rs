//! Whole ways through the program, from an empty folder to a number.

use std::fs;

use serde_json::Value;

use crate::run::{real_data, refuse, rig, robot, succeed};

fn json(path: &std::path::Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn value(result: &Value, expression: &str) -> (f64, f64) {
    let found = result["base_parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["expression"] == expression);
    let parameter = found.unwrap_or_else(|| panic!("no {expression} in {result:#}"));
    (
        parameter["value"].as_f64().unwrap(),
        parameter["std"].as_f64().unwrap(),
    )
}

/// A folder with the one-link description as `rig.toml`.
fn described() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut init = rig();
    init.args(["init", "one-link", "--out"]);
    succeed(init.arg(folder.path().join("rig.toml")));
    folder
}

#[test]
fn init_excite_record_identify_validate() {
    let folder = described();
    let at = |name: &str| folder.path().join(name);
    succeed(
        rig()
            .args(["excite", "--start", "-1.5707963", "--robot"])
            .arg(at("rig.toml"))
            .arg("--out")
            .arg(at("motion.toml")),
    );
    for (seed, name) in [("3", "train.csv"), ("3", "again.mcap")] {
        let said = succeed(
            rig()
                .args([
                    "record",
                    "--emulated",
                    "--home",
                    "-1.5707963",
                    "--seed",
                    seed,
                    "--robot",
                ])
                .arg(at("rig.toml"))
                .arg("--trajectory")
                .arg(at("motion.toml"))
                .arg("--out")
                .arg(at(name)),
        );
        assert!(said.contains("0 missing"), "{said}");
    }
    let identify = |data: &str, model: &str, out: &str| {
        succeed(
            rig()
                .args(["identify", "--model", model, "--robot"])
                .arg(at("rig.toml"))
                .arg("--data")
                .arg(at(data))
                .arg("--out")
                .arg(at(out)),
        );
        json(&at(out).join("identification.json"))
    };
    let differential = identify("train.csv", "differential", "by-torque");
    let integral = identify("train.csv", "integral", "by-energy");
    assert_eq!(differential["schema"], "rig-identification/1");
    for expression in ["fv1", "fc1"] {
        let ((a, sa), (b, sb)) = (
            value(&differential, expression),
            value(&integral, expression),
        );
        assert!(
            (a - b).abs() < 4.0 * sa.hypot(sb),
            "{expression}: {a} ± {sa} by torque, {b} ± {sb} by energy"
        );
    }
    // The same samples from the other format give the same numbers.
    let mcap = identify("again.mcap", "differential", "by-mcap");
    assert_eq!(value(&mcap, "fv1"), value(&differential, "fv1"));
    let said = succeed(
        rig()
            .args(["validate", "--robot"])
            .arg(at("by-torque").join("identified.toml"))
            .arg("--data")
            .arg(at("train.csv"))
            .arg("--out")
            .arg(at("check")),
    );
    assert!(said.contains("report"), "{said}");
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_each_run_its_own_noise() {
    let folder = tempfile::tempdir().unwrap();
    let record = |name: &str, seed: &str, run: &str| {
        let path = folder.path().join(name);
        succeed(
            rig()
                .args([
                    "record",
                    "--emulated",
                    "--seconds",
                    "2",
                    "--seed",
                    seed,
                    "--run",
                    run,
                    "--out",
                ])
                .arg(&path),
        );
        fs::read(path).unwrap()
    };
    let first = record("a.csv", "7", "1");
    assert_eq!(first, record("b.csv", "7", "1"));
    assert_ne!(first, record("c.csv", "8", "1"));
    let again = record("d.csv", "7", "2");
    assert_ne!(first, again);
    // The same rig: where its link hangs differs by what its encoder reads at rest.
    let start = |bytes: &[u8]| -> f64 {
        let text = String::from_utf8_lossy(bytes).into_owned();
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let column = lines.next().unwrap().split(',').position(|c| c == "q1");
        let row: Vec<&str> = lines.next().unwrap().split(',').collect();
        row[column.unwrap()].parse().unwrap()
    };
    assert!((start(&first) - start(&again)).abs() < 0.01);
}

/// A link that is said to stand level is held there until the drive has it: the angle begins where it was said to.
#[test]
fn an_emulated_link_begins_where_it_is_said_to_stand() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("level.csv");
    succeed(
        rig()
            .args(["record", "--emulated", "--seconds", "2", "--home", "0"])
            .arg("--out")
            .arg(&path),
    );
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let of = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let first: Vec<f64> = (lines.next().unwrap().split(','))
        .map(|value| value.parse().unwrap_or(f64::NAN))
        .collect();
    let (angle, speed) = (first[of("q1")], first.get(of("qd1")));
    assert!(angle.abs() < 0.02, "{angle}");
    assert!(speed.is_none_or(|v| v.abs() < 0.1), "{speed:?}");
}

/// Janot, Gautier & Brunot 2019: mass, viscous, Coulomb friction and offset of EMPS.
const PUBLISHED: [(&str, f64); 4] = [
    ("m1 + Ia1", 95.1089),
    ("fv1", 203.5034),
    ("fc1", 20.3935),
    ("off1", -3.1648),
];

fn emps(arguments: &[&str]) -> Option<Value> {
    let data = real_data("emps")?;
    let out = tempfile::tempdir().unwrap();
    succeed(
        rig()
            .arg("identify")
            .args(arguments)
            .arg("--robot")
            .arg(robot("emps.toml"))
            .arg("--data")
            .arg(data.join("train.csv"))
            .arg("--out")
            .arg(out.path()),
    );
    Some(json(&out.path().join("identification.json")))
}

fn within(result: &Value, share: f64, what: &str) {
    for (expression, published) in PUBLISHED {
        let (found, std) = value(result, expression);
        println!("{what}: {expression} {found:.4} ± {std:.4}, published {published}");
        assert!(
            (found / published - 1.0).abs() < share,
            "{what}: {expression} {found} against {published}"
        );
    }
}

#[test]
fn emps_with_the_published_treatment_is_within_half_a_percent() {
    let published = [
        "--estimator",
        "ols",
        "--cutoff",
        "100",
        "--decimation",
        "10",
        "--min-speed",
        "0",
    ];
    if let Some(result) = emps(&published) {
        within(&result, 0.005, "published treatment");
    }
}

#[test]
fn emps_with_the_defaults_is_within_two_percent_by_both_models_and_they_agree() {
    let (Some(differential), Some(integral)) = (emps(&[]), emps(&["--model", "integral"])) else {
        return;
    };
    within(&differential, 0.02, "differential");
    within(&integral, 0.02, "integral");
    for (expression, _) in PUBLISHED {
        let ((a, sa), (b, sb)) = (
            value(&differential, expression),
            value(&integral, expression),
        );
        assert!(
            (a - b).abs() < 1.96 * (sa + sb),
            "{expression}: {a} ± {sa} and {b} ± {sb}"
        );
    }
}

#[test]
fn arms_with_coupled_drives_go_from_template_to_parameters() {
    for template in ["irp6", "edda"] {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        succeed(rig().args(["init", template, "--out"]).arg(at("arm.toml")));
        succeed(
            rig()
                .args(["excite", "--starts", "1", "--harmonics", "2"])
                .args(["--periods", "1", "--robot"])
                .arg(at("arm.toml"))
                .arg("--out")
                .arg(at("motion.toml")),
        );
        succeed(
            rig()
                .args(["simulate", "--robot"])
                .arg(at("arm.toml"))
                .arg("--trajectory")
                .arg(at("motion.toml"))
                .arg("--out")
                .arg(at("train.csv")),
        );
        succeed(
            rig()
                .args(["identify", "--robot"])
                .arg(at("arm.toml"))
                .arg("--data")
                .arg(at("train.csv"))
                .arg("--out")
                .arg(at("found")),
        );
        let written = at("found").join("identified.toml");
        let loaded = rig_model::robot::Robot::load(&written).unwrap();
        assert!(loaded.joints.len() > 1);
        let result = json(&at("found").join("identification.json"));
        if template == "irp6" {
            // Friction of the motors as the description states it, in motor units.
            let (screw, _) = value(&result, "fcm3");
            assert!((screw / 0.08 - 1.0).abs() < 0.05, "{screw}");
        }
    }
}

/// What needs no board: a burst of ticks, a description told to the rig; and a sentence for what does need one.
#[test]
fn board_commands_on_the_emulated_rig() {
    let folder = tempfile::tempdir().unwrap();
    let burst = folder.path().join("burst.csv");
    let board = || {
        let mut command = rig();
        command.args(["board", "--emulated"]);
        command
    };
    let mut twice = rig();
    twice.args(["board", "--emulated", "disarm", "--port", "/dev/none"]);
    assert!(refuse(&mut twice).contains("one of --port"));
    let told = succeed(
        board()
            .args(["capture", "--after", "50", "--out"])
            .arg(&burst),
    );
    assert!(told.contains("control ticks"), "{told}");
    let text = std::fs::read_to_string(&burst).unwrap();
    assert!(text.starts_with("t,q1,i1,duty1,supply,ref1\n"), "{text}");
    assert!(refuse(board().args(["capture", "--out"]).arg(&burst)).contains("--force"));
    let model = robot("one-link.toml");
    succeed(
        board()
            .args(["upload", "--unstored", "--model"])
            .arg(&model),
    );
    let no_memory = refuse(board().args(["upload", "--model"]).arg(&model));
    assert!(no_memory.contains("no memory"), "{no_memory}");
    assert!(refuse(board().arg("store")).contains("no memory"));
    assert!(refuse(board().arg("health")).contains("emulated rig has none"));
    assert!(succeed(board().arg("fault")).contains("No fault is latched"));
    assert!(succeed(board().arg("clear")).contains("No fault is latched"));
    assert!(succeed(board().arg("disarm")).contains("The bridge is off"));
    let offset = std::fs::read_to_string(&model).unwrap()
        + "\n[[effect]]\nkind = 'current_offset'\njoint = 'link'\noffset = 3.0\n";
    let beyond = folder.path().join("beyond.toml");
    std::fs::write(&beyond, offset).unwrap();
    let refused = refuse(
        board()
            .args(["upload", "--unstored", "--model"])
            .arg(&beyond),
    );
    assert!(refused.contains("0.5 A at most"), "{refused}");
}

/// A description of another encoder or gear makes another emulated rig: no fault, and the parameters of the same link.
#[test]
fn the_emulated_rig_has_the_drive_of_its_description() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let template = fs::read_to_string(robot("one-link.toml")).unwrap();
    let others = [
        (
            "encoder_counts_per_rev = 8192",
            "encoder_counts_per_rev = 4000",
        ),
        (
            "encoder_counts_per_rev = 8192",
            "encoder_counts_per_rev = 65536",
        ),
        ("gear_ratio = 50.0", "gear_ratio = 31.5"),
        ("gear_ratio = 50.0", "gear_ratio = -50.0"),
        ("torque_constant = 0.05", "torque_constant = 0.08"),
        ("resistance = 0.6", "resistance = 1.1"),
        ("inductance = 0.5e-3", "inductance = 2e-3"),
        ("rotor_inertia = 2.0e-5", "rotor_inertia = 5e-6"),
    ];
    for (old, new) in others {
        assert!(template.contains(old));
        fs::write(at("rig.toml"), template.replace(old, new)).unwrap();
        succeed(
            rig()
                .args([
                    "excite",
                    "--force",
                    "--start",
                    "-1.5707963",
                    "--starts",
                    "4",
                ])
                .args(["--seed", "5", "--robot"])
                .arg(at("rig.toml"))
                .arg("--out")
                .arg(at("motion.toml")),
        );
        succeed(
            rig()
                .args([
                    "record",
                    "--emulated",
                    "--force",
                    "--home",
                    "-1.5707963",
                    "--robot",
                ])
                .arg(at("rig.toml"))
                .arg("--trajectory")
                .arg(at("motion.toml"))
                .arg("--out")
                .arg(at("train.csv")),
        );
        succeed(
            rig()
                .args(["identify", "--force", "--robot"])
                .arg(at("rig.toml"))
                .arg("--data")
                .arg(at("train.csv"))
                .arg("--out")
                .arg(at("found")),
        );
        let result = json(&at("found/identification.json"));
        // The link of the first rig: 0.171 kg·m as the described torque constant sees it, which is off by up to 30 %.
        let (weight, _) = value(&result, "mx1");
        assert!((0.12..0.25).contains(&weight), "{new}: {weight}");
    }
}

/// A recording that is ended from outside leaves what was recorded, and no hidden file.
#[cfg(unix)]
#[test]
fn a_recording_that_is_told_to_end_leaves_no_hidden_file() {
    let folder = tempfile::tempdir().unwrap();
    for signal in ["-TERM", "-INT", "-HUP"] {
        let path = folder.path().join("long.csv");
        let mut child = rig()
            .args([
                "record",
                "--emulated",
                "--force",
                "--seconds",
                "1e9",
                "--out",
            ])
            .arg(&path)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        // Until it has begun to write.
        for _ in 0..400 {
            std::thread::sleep(std::time::Duration::from_millis(25));
            let begun = fs::read_dir(folder.path()).unwrap().any(|entry| {
                let entry = entry.unwrap();
                entry.file_name().to_string_lossy().starts_with(".rig-")
                    && entry.metadata().unwrap().len() > 0
            });
            if begun {
                break;
            }
        }
        let told = std::process::Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status()
            .unwrap();
        assert!(told.success());
        assert!(!child.wait().unwrap().success());
        let names: Vec<String> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        assert_eq!(names, ["long.csv"], "{signal}");
    }
}

/// A fault is told in words: what, with unit, when, and what to do.
#[test]
fn a_motor_that_is_too_weak_is_told_with_numbers_and_its_fault_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let template = fs::read_to_string(robot("one-link.toml")).unwrap();
    succeed(
        rig()
            .args([
                "excite",
                "--start",
                "-1.5707963",
                "--starts",
                "4",
                "--robot",
            ])
            .arg(robot("one-link.toml"))
            .arg("--out")
            .arg(at("motion.toml")),
    );
    let weak = template.replace("gear_ratio = 50.0", "gear_ratio = 5.0");
    fs::write(at("weak.toml"), weak).unwrap();
    let output = rig()
        .args(["record", "--emulated", "--home", "-1.5707963", "--robot"])
        .arg(at("weak.toml"))
        .arg("--trajectory")
        .arg(at("motion.toml"))
        .arg("--out")
        .arg(at("weak.csv"))
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("The described drive is too weak") && said.contains("ends at 16.5 A"),
        "{said}"
    );
    if !output.status.success() {
        assert!(
            said.contains("The rig has stopped. The ") && said.contains("at t = "),
            "{said}"
        );
        assert!(
            said.contains("Check ") || said.contains("Let the motor cool"),
            "{said}"
        );
    }
}

#[test]
fn a_motion_that_starts_elsewhere_is_refused_with_what_to_give() {
    let folder = described();
    let at = |name: &str| folder.path().join(name);
    let mut design = rig();
    design.args(["excite", "--start", "-1.5708", "--kind", "reversals"]);
    succeed(
        (design.arg("--robot").arg(at("rig.toml")))
            .arg("--out")
            .arg(at("slow.toml")),
    );
    for (home, said) in [
        (None, "Give --home -1.5708 if it is there"),
        (Some("-90"), "-90 degrees are -1.5708 rad"),
        (Some("0.5"), "`rig excite --start 0.5000`"),
    ] {
        let mut record = rig();
        record
            .args(["record", "--emulated"])
            .args(home.map(|home| format!("--home={home}")));
        record.arg("--robot").arg(at("rig.toml"));
        record.arg("--trajectory").arg(at("slow.toml"));
        let sentence = refuse(record.arg("--out").arg(at("run.csv")));
        assert!(sentence.contains(said), "{home:?}: {sentence}");
    }
}
