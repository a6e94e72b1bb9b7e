//! Small inputs of which public bug reports tell, each with what a user would want. They lie beside the project (`../shared/cases`)
//! and are run there as their `cmd` says.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use tempfile::TempDir;

use crate::run::{rig, succeed};

/// The cases, copied, with the sound inputs that they are made from; nothing after having said so where they are not here.
fn cases() -> Option<&'static Path> {
    static COPY: OnceLock<Option<TempDir>> = OnceLock::new();
    let copy = COPY.get_or_init(|| {
        let beside = rig_output::data_dir()?.parent()?.join("cases");
        if !beside.is_dir() {
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        for entry in fs::read_dir(&beside).unwrap() {
            let from = entry.unwrap().path();
            if from.is_dir() {
                copied(&from, &folder.path().join(from.file_name().unwrap()));
            }
        }
        sound(folder.path());
        repeatable(folder.path());
        Some(folder)
    });
    if copy.is_none() {
        println!("skipped: no folder `cases` beside the real recordings (RIG_DATA)");
    }
    copy.as_ref().map(TempDir::path)
}

/// Lets each command of a case replace the results of the one before.
fn repeatable(cases: &Path) {
    for entry in fs::read_dir(cases).unwrap() {
        let cmd = entry.unwrap().path().join("cmd");
        if cmd.is_file() {
            let text = read(cmd.clone());
            let text = text.replace("$RIG identify ", "$RIG identify --force ");
            let text = text.replace("$RIG friction-map ", "$RIG friction-map --force ");
            fs::write(cmd, text).unwrap();
        }
    }
}

fn copied(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        fs::write(to.join(path.file_name().unwrap()), fs::read(&path).unwrap()).unwrap();
    }
}

fn read(path: PathBuf) -> String {
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Columns of a file, each row through `change`.
fn changed(from: PathBuf, change: impl Fn(&mut Vec<String>)) -> String {
    let rows = read(from);
    let rows = rows.lines().map(|line| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        change(&mut fields);
        fields.join(",") + "\n"
    });
    rows.collect()
}

/// The folder `base` of the inputs before they were damaged: what a case has damaged is mended in it.
fn sound(cases: &Path) {
    let base = cases.join("base");
    if base.is_dir() {
        return;
    }
    fs::create_dir(&base).unwrap();
    let toml = read(cases.join("limits-in-degrees/deg.toml"))
        .replace("position = [-178, 178]", "position = [-3.1, 3.1]")
        .replace("velocity = 340", "velocity = 6.0");
    fs::write(base.join("rig.toml"), toml).unwrap();
    let urdf =
        read(cases.join("start-on-the-limit/a.urdf")).replace("lower=\"0\"", "lower=\"-2.8\"");
    fs::write(base.join("arm.urdf"), urdf).unwrap();
    let clean = changed(cases.join("velocity-column-of-zeros/x.csv"), |row| {
        row.truncate(3);
    });
    let slow: Vec<&str> = (clean.lines().take(1))
        .chain(clean.lines().skip(1).step_by(4))
        .collect();
    fs::write(base.join("clean-250Hz.csv"), slow.join("\n") + "\n").unwrap();
    fs::write(base.join("clean.csv"), clean).unwrap();
    let arm = changed(cases.join("zero-offset-of-an-inner-joint/x.csv"), |row| {
        if let Ok(q) = row[3].parse::<f64>() {
            row[3] = (q - std::f64::consts::FRAC_PI_2).to_string();
        }
    });
    fs::write(base.join("arm-clean.csv"), arm).unwrap();
    other_motions(&base);
    spiked_velocity(cases);
}

/// A measured velocity with a spike wherever the position passes zero, which one of the cases needs.
fn spiked_velocity(cases: &Path) {
    let folder = cases.join("velocity-spikes-at-zero-crossing");
    if folder.is_dir() {
        return;
    }
    let clean = read(cases.join("base/clean.csv"));
    let rows: Vec<[f64; 3]> = (clean.lines().skip(1))
        .map(|line| {
            let mut fields = line.split(',').map(|field| field.parse().unwrap());
            [(); 3].map(|()| fields.next().unwrap())
        })
        .collect();
    let mut text = String::from("t,q1,i1,qd1\n");
    for (k, [t, q, i]) in rows.iter().enumerate() {
        let (a, b) = (rows[k.max(4) - 4], rows[(k + 4).min(rows.len() - 1)]);
        let passes = k > 0 && (q < &-1.0) != (rows[k - 1][1] < -1.0);
        let qd = if passes {
            -1200.0
        } else {
            (b[1] - a[1]) / (b[0] - a[0])
        };
        writeln!(text, "{t},{q},{i},{qd}").unwrap();
    }
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("x.csv"), text).unwrap();
}

/// Recordings of other motions, simulated.
fn other_motions(base: &Path) {
    let run = |words: &[&str]| succeed(rig().args(words).current_dir(base));
    run(&[
        "identify",
        "--robot",
        "rig.toml",
        "--data",
        "clean.csv",
        "--compare",
        "none",
        "--out",
        "fit",
    ]);
    let motions = [
        (
            "arm.urdf",
            "arm.urdf",
            "arm-other.csv",
            "1e-5",
            "0.05",
            "0,0,0",
        ),
        (
            "rig.toml",
            "fit/identified.toml",
            "other.csv",
            "1e-5",
            "0.02",
            "-1.5708",
        ),
    ];
    for (limits, robot, out, position, torque, start) in motions {
        run(&[
            "excite", "--robot", limits, "--starts", "2", "--seed", "5", "--start", start, "--out",
            "m.toml", "--force",
        ]);
        run(&[
            "simulate",
            "--robot",
            robot,
            "--trajectory",
            "m.toml",
            "--rate",
            "500",
            "--noise-position",
            position,
            "--noise-torque",
            torque,
            "--seed",
            "3",
            "--out",
            out,
        ]);
    }
}

/// What a case's `cmd` prints; none where the cases are not here.
fn said(name: &str) -> Option<String> {
    let folder = cases()?.join(name);
    assert!(folder.is_dir(), "no case {name}");
    let output = Command::new("sh")
        .arg("./cmd")
        .env("RIG", env!("CARGO_BIN_EXE_rig"))
        .current_dir(&folder)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let text = text + &String::from_utf8_lossy(&output.stderr);
    println!("{text}");
    assert!(!text.contains("panicked"), "{name}");
    Some(text)
}

/// Asserts that a case prints all of `wanted` and nothing of `unwanted`.
fn says(name: &str, wanted: &[&str], unwanted: &[&str]) {
    let Some(text) = said(name) else {
        return;
    };
    for words in wanted {
        assert!(text.contains(words), "{name}: no \"{words}\"");
    }
    for words in unwanted {
        assert!(!text.contains(words), "{name}: \"{words}\"");
    }
}

#[test]
fn every_case_has_a_test() {
    let Some(cases) = cases() else {
        return;
    };
    for entry in fs::read_dir(cases).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            include_str!("cases.rs").contains(&format!("\"{name}\"")),
            "no test runs the case {name}"
        );
    }
}

#[test]
fn a_clipped_current_is_said_to_be_clipped() {
    says(
        "current-clipped",
        &[
            "tau1 (from i1) is cut at 2.497",
            "tau1 (from i1) is cut at 3.746",
            "the torque stands at its limit",
        ],
        &["livelier"],
    );
}

#[test]
fn a_current_without_its_sign_is_said_to_be_unsigned() {
    says(
        "current-unsigned",
        &[
            "tau1 (from i1) is never negative, but in 58 % of the rows",
            "two's complement",
            "tau1 (from i1) is never negative though the joint turns both ways",
            "verdict: The data are at fault",
        ],
        &["opposite senses", "mN·m", "mx1"],
    );
}

#[test]
fn a_ratio_upside_down_is_said_with_the_ratio_that_fits() {
    says(
        "gear-ratio-inverted",
        &["it is 0.1667", "and 6 fits", "it is 0.02", "and 50 fits"],
        &["per degree", "looks like degrees", "kN·m"],
    );
}

#[test]
fn columns_of_the_motor_are_named() {
    says(
        "motor-side-values-in-joint-columns",
        &[
            "it looks like the angle of the motor; divide it by the gear ratio 50",
            "as the motor's torque is before its gear (50 to 1)",
            "as if the gear ratio (50) had been applied twice",
        ],
        &["degree", "mN·m"],
    );
}

#[test]
fn one_fault_has_one_cause() {
    says(
        "one-fault-two-causes",
        &["the axis of joint elbow points the other way"],
        &["clock", "one of them", "Another explanation"],
    );
}

#[test]
fn turns_are_told_at_a_single_joint() {
    says(
        "position-in-turns-one-joint",
        &[
            "it looks like turns; give it in rad",
            "The data are at fault",
        ],
        &["payload", "rpm", "mx1"],
    );
}

#[test]
fn rows_stamped_on_arrival_are_told_from_rows_that_are_lost() {
    says(
        "rows-stamped-on-arrival-in-bursts",
        &["bursts of 4", "1000 Hz in the mean"],
        &["fewer rows are lost"],
    );
}

#[test]
fn repeated_samples_are_named() {
    says(
        "staircase-diagnose",
        &[
            "q1, q2 and q3 change only in every second row: a topic of 250 Hz in a recording of 500 Hz",
            "The data are at fault",
        ],
        &["measurement_delay", "gravity_tilt"],
    );
    says(
        "staircase-position-10",
        &["q1 changes only in every 10th row: a topic of 100 Hz in a recording of 1000 Hz"],
        &["fc1"],
    );
    says(
        "staircase-torque-5",
        &[
            "tau1 (from i1) changes only in every 5th row: values of 200 Hz in a recording of 1000 Hz",
            "late by 2 ms",
        ],
        &[],
    );
}

#[test]
fn a_velocity_column_of_zeros_is_named() {
    says(
        "velocity-column-of-zeros",
        &["qd1 is 0 in every row while the joint moves"],
        &["livelier"],
    );
}

#[test]
fn voltages_that_are_none_are_faults_of_the_data() {
    says(
        "voltage-that-is-none",
        &[
            "u1 is 0 in every row while the joint moves",
            "u1 stays at 12 V while the joint turns both ways: it looks like the supply",
            "u1 looks like mV",
            "it looks like turns; give it in rad",
        ],
        &["gravity_tilt", "Unexplained residual", "cannot be built"],
    );
}

#[test]
fn the_zero_of_an_inner_joint_is_found() {
    says(
        "zero-offset-of-an-inner-joint",
        &["Gravity fits with the zero of joint shoulder_lift turned by -90 degrees"],
        &["position_friction", "elbow"],
    );
}

#[test]
fn impossible_values_do_not_pass() {
    says(
        "impossible-values-without-a-word",
        &[
            "exit 1",
            "qd1 is -1200 rad/s",
            "q1 changes only in every 10th row",
        ],
        &["exit 0", "fc1", "Izz1"],
    );
}

#[test]
fn gravity_in_other_units_is_remarked() {
    says(
        "gravity-in-other-units",
        &[
            "were it in g, it would be 9.81",
            "were it in mm/s², it would be 9.81",
        ],
        &[],
    );
}

#[test]
fn no_motion_is_sized_by_limits_in_degrees() {
    says(
        "limits-in-degrees",
        &["were these degrees, they would be", "so none was designed"],
        &["condition number", "the motion,"],
    );
}

#[test]
fn a_start_on_the_limit_and_a_period_without_motion_are_refused() {
    says(
        "start-on-the-limit",
        &[
            "it must lie strictly between 0 and 2.8",
            "This motion identifies nothing",
        ],
        &["the motion,"],
    );
}

#[test]
fn a_sweep_of_another_rate_gives_the_same_friction() {
    let Some(text) = said("friction-map-two-rates") else {
        return;
    };
    let values = |name: &str| -> Vec<f64> {
        let figures = text.lines().filter(|line| line.starts_with("coulomb "));
        let after = |line: &str| {
            let mut words = line.split_whitespace().skip_while(|word| *word != name);
            words.nth(1).unwrap().parse().unwrap()
        };
        figures.map(after).collect()
    };
    let (coulomb, viscous) = (values("coulomb"), values("viscous"));
    assert!(
        coulomb.len() == 4 && viscous.len() == 4,
        "{coulomb:?} {viscous:?}"
    );
    assert!(
        coulomb.iter().all(|c| (c - 0.47).abs() < 0.02),
        "{coulomb:?}"
    );
    assert!(
        viscous.iter().all(|v| (v - 0.35).abs() < 0.02),
        "{viscous:?}"
    );
}

#[test]
fn csv_as_other_programs_write_it_is_read_or_told() {
    let Some(text) = said("csv-forms") else {
        return;
    };
    let read = [
        "quoted",
        "german-quoted",
        "blank-first",
        "d-exponent",
        "semicolon",
    ];
    for form in read {
        let line = text
            .lines()
            .find(|line| line.starts_with(&format!("{form}:")));
        let line = line.unwrap_or_else(|| panic!("{form} is missing"));
        assert!(!line.contains("error:"), "{line}");
    }
    // Its lines are read; its rows stand there three times.
    assert!(text.contains("cr.csv:12002: column `t` jumps back"));
    assert_eq!(text.matches("error:").count(), 1, "{text}");
}

#[test]
fn mcap_as_recorders_write_it_is_read_or_told() {
    says(
        "mcap-as-recorders-write-it",
        &[
            "message 501: column `i1` holds NaN",
            "the chunk's check sum is wrong at byte",
            "2660 messages are read",
            "is a ROS 1 bag; convert it",
            "is an SQLite database, as rosbag2 writes",
        ],
        &["recover it with the mcap tool", "same keys", "#ROSBAG"],
    );
}

#[test]
fn elements_of_a_urdf_that_stand_twice_or_are_misspelt_are_refused() {
    says(
        "urdf-element-twice-or-misspelt",
        &[
            "this is a second <inertial> of link",
            "this is a second <limit> of joint",
            "this is a second <origin> of joint",
            "is `upper` meant?",
            "is `damping` meant?",
        ],
        &["position ="],
    );
}

#[test]
fn a_urdf_is_read_in_its_own_encoding() {
    says(
        "urdf-in-its-own-encoding",
        &["remove the empty line", "type=\"continuous\""],
        &["not a text file", "is not text", "has no `effort`; give it"],
    );
}

#[test]
fn other_hardware_is_emulated_or_told_in_words() {
    let Some(text) = said("record-emulated-other-hardware") else {
        return;
    };
    // Three encoders and a gear of 10 run; the gear of 5 is too weak for the motion and that of 100 needs more than the
    // supply gives, which is told with the remedy.
    for words in [
        "The described drive is too weak to move the link of the emulated rig like this.",
        "converter code 4095 of 0 to 4095 [AdcStuck, at t =",
        "The motion needs a torque of 10.7 N·m, but limits.torque of the description is 8.00 N·m.",
        "is above its continuous rating [Overload, at t =",
        "Design a slower or smaller motion from this description",
    ] {
        assert!(text.contains(words), "no \"{words}\"");
    }
    assert_eq!(text.matches("error:").count(), 2, "{text}");
    assert_eq!(text.matches(" 0 missing in 0 gaps").count(), 4, "{text}");
}
