//! `rig simulate` of an arm whose gears are elastic or have backlash.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::run::{refuse, rig, robot, succeed};

fn simulate(robot: &Path, trajectory: &Path, out: &Path) -> Command {
    let mut command = rig();
    command.args(["simulate", "--rate", "200", "--robot"]);
    command.arg(robot).arg("--trajectory").arg(trajectory);
    command.arg("--out").arg(out);
    command
}

/// A column of a recording.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = header.iter().position(|own| own.trim() == name).unwrap();
    lines
        .map(|line| line.split(',').nth(place).unwrap().trim().parse().unwrap())
        .collect()
}

#[test]
fn gears_of_an_arm_with_coupled_drives_are_simulated() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let plain = fs::read_to_string(robot("irp6.toml")).unwrap();
    let with =
        |joint: &str, rest: &str| format!("{plain}\n[[effect]]\njoint = \"{joint}\"\n{rest}\n");
    // All of the coupled drives; the stiffness of a screw is that at its motor.
    let spring = |stiffness: &str, damping: &str| {
        format!(
            "kind = \"joint_elasticity\"\nstiffness = {stiffness}\ndamping = {damping}\nlink_friction = 0.0"
        )
    };
    let loose =
        "kind = \"backlash\"\ngap = 0.01\nstiffness = 3.0e3\ndamping = 3.0\nlink_friction = 0.0";
    let gears = |tilt: &str| {
        let others = [
            ("lower_arm", spring("4.0", "1.0e-3")),
            ("wrist_tilt", tilt.to_owned()),
            ("wrist_turn", spring("2.0e4", "5.0")),
        ];
        others.iter().fold(
            with("upper_arm", &spring("0.16", "2.0e-4")),
            |text, (joint, rest)| format!("{text}\n[[effect]]\njoint = \"{joint}\"\n{rest}\n"),
        )
    };
    fs::write(at("soft.toml"), gears(&spring("2.0e4", "5.0"))).unwrap();
    fs::write(at("both.toml"), gears(loose)).unwrap();
    fs::write(at("one.toml"), with("upper_arm", &spring("0.16", "2.0e-4"))).unwrap();
    fs::write(at("loose.toml"), with("wrist_tilt", loose)).unwrap();
    let mut excite = rig();
    excite.args([
        "excite",
        "--kind",
        "staircase",
        "--joint",
        "upper_arm",
        "--robot",
    ]);
    excite
        .arg(robot("irp6.toml"))
        .arg("--out")
        .arg(at("motion.toml"));
    succeed(&mut excite);
    let motion = at("motion.toml");
    succeed(&mut simulate(
        &robot("irp6.toml"),
        &motion,
        &at("stiff.csv"),
    ));
    for name in ["soft", "both", "one", "loose"] {
        let description = at(&format!("{name}.toml"));
        succeed(&mut simulate(
            &description,
            &motion,
            &at(&format!("{name}.csv")),
        ));
    }
    let speed = |name: &str, joint: usize| column(&at(name), &format!("qd{joint}"));
    let apart = |a: &[f64], b: &[f64]| {
        let sum: f64 = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum();
        (sum / a.len() as f64).sqrt()
    };
    let stiff = speed("stiff.csv", 3);
    let off = apart(&stiff, &speed("soft.csv", 3));
    let most = stiff.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    // The elastic gear is seen in the motor's speed, and the motor still follows.
    assert!(off > 1e-4 * most && off < 0.2 * most, "{off} of {most}");
    // Backlash at the wrist is seen there.
    let [one, other] = ["soft.csv", "both.csv"].map(|name| speed(name, 4));
    assert!(apart(&one, &other) > 1e-6, "{}", apart(&one, &other));
    // The same input gives the same bytes.
    succeed(&mut simulate(&at("both.toml"), &motion, &at("again.csv")));
    assert_eq!(
        fs::read(at("both.csv")).unwrap(),
        fs::read(at("again.csv")).unwrap()
    );
    // A spring at one of the coupled drives alone does there what it does beside stiffer ones at the others, which add
    // little; so does backlash.
    let alone = apart(&stiff, &speed("one.csv", 3));
    let beside = apart(&speed("one.csv", 3), &speed("soft.csv", 3));
    assert!(
        alone > 1e-4 * most && beside < 0.5 * alone,
        "{beside} of {alone}"
    );
    let loose = apart(&speed("stiff.csv", 4), &speed("loose.csv", 4));
    assert!(loose > 1e-6, "{loose}");
    // A gear without a mass before it cannot be simulated.
    let massless = with("column", &spring("4.0e3", "5.0"))
        .replace("rotor_inertia = 2.0e-4", "rotor_inertia = 0.0");
    fs::write(at("massless.toml"), massless).unwrap();
    let said = refuse(&mut simulate(
        &at("massless.toml"),
        &motion,
        &at("none.csv"),
    ));
    assert!(
        said.contains("rotor_inertia") && said.contains("column"),
        "{said}"
    );
    assert!(!at("none.csv").exists());
}

/// What a recording of 200 Hz without noise tells is the description, as one of any other rate: the motion between its samples
/// obeys the same equations.
#[test]
fn a_slow_recording_tells_the_same_inertia_as_its_description() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut design = rig();
    design.args(["excite", "--starts", "1", "--seed", "1", "--robot"]);
    design
        .arg(robot("edda.toml"))
        .arg("--out")
        .arg(at("motion.toml"));
    succeed(&mut design);
    succeed(&mut simulate(
        &robot("edda.toml"),
        &at("motion.toml"),
        &at("run.csv"),
    ));
    let mut identify = rig();
    identify.args(["identify", "--estimator", "weighted", "--robot"]);
    identify
        .arg(robot("edda.toml"))
        .arg("--data")
        .arg(at("run.csv"));
    succeed(identify.arg("--out").arg(at("found")));
    let text = fs::read_to_string(at("found/identification.json")).unwrap();
    let found: serde_json::Value = serde_json::from_str(&text).unwrap();
    let value = |start: &str| -> f64 {
        let list = found["base_parameters"].as_array().unwrap();
        let own = list
            .iter()
            .find(|own| own["expression"].as_str().unwrap().starts_with(start));
        own.unwrap()["value"].as_f64().unwrap()
    };
    // Izz1 + Ia1 + a² m2 of the description.
    let truth = 1.0276 + 0.25 + 0.2025 * 6.0;
    let inertia = value("Izz1 + Ia1");
    assert!((inertia / truth - 1.0).abs() < 2e-5, "{inertia}");
    assert!((value("fv1") / 0.4 - 1.0).abs() < 1e-3, "{}", value("fv1"));
}

/// A sampled motion is interpolated to the rate that is asked for; without --rate the recording has that of the file.
#[test]
fn a_sampled_motion_is_simulated_at_the_rate_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rig_file = robot("one-link.toml");
    for name in ["motion.toml", "motion.csv"] {
        let mut command = rig();
        command.args(["excite", "--rate", "100", "--starts", "2", "--robot"]);
        command.arg(&rig_file).arg("--out").arg(at(name));
        succeed(&mut command);
    }
    let run = |motion: &str, options: &[&str], out: &str| {
        let mut command = rig();
        command.args(["simulate", "--robot"]).arg(&rig_file);
        command.arg("--trajectory").arg(at(motion)).args(options);
        command.arg("--out").arg(at(out));
        command
    };
    succeed(&mut run("motion.toml", &["--rate", "500"], "direct.csv"));
    succeed(&mut run("motion.csv", &["--rate", "500"], "resampled.csv"));
    succeed(&mut run("motion.csv", &[], "own.csv"));
    let period = |name: &str| column(&at(name), "t")[1] - column(&at(name), "t")[0];
    assert!((period("resampled.csv") - 0.002).abs() < 1e-9);
    assert!((period("own.csv") - 0.01).abs() < 1e-9);
    for (name, most) in [("ref1", 1e-5), ("q1", 1e-4)] {
        let [direct, resampled] =
            ["direct.csv", "resampled.csv"].map(|file| column(&at(file), name));
        assert!(direct.len().abs_diff(resampled.len()) < 6);
        let apart = direct.iter().zip(&resampled).map(|(a, b)| (a - b).abs());
        let worst = apart.fold(0.0, f64::max);
        assert!(worst < most, "{name}: {worst:e}");
    }
    let said = refuse(&mut run("motion.csv", &["--rate", "0"], "none.csv"));
    assert!(
        said.contains("rate") && said.contains("between 1 and 1000000 Hz"),
        "{said}"
    );
}

#[test]
fn a_trajectory_in_milliseconds_or_degrees_is_refused_and_one_in_si_units_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.csv");
    let with = |name: &str, time: f64, angle: f64| {
        let path = folder.path().join(name);
        let mut text = String::from("t,q1,q2\n");
        for k in 0..300 {
            let t = 0.01 * f64::from(k);
            let (a, b) = (0.8 * t.sin(), 0.6 * (1.3 * t).sin());
            text += &format!("{},{},{}\n", time * t, angle * a, angle * b);
        }
        fs::write(&path, text).unwrap();
        simulate(&robot("edda.toml"), &path, &out)
    };
    let said = refuse(&mut with("ms.csv", 1e3, 1.0));
    assert!(said.contains("ms.csv: t looks like milliseconds"), "{said}");
    let said = refuse(&mut with("deg.csv", 1.0, 57.3));
    assert!(said.contains("deg.csv: q1 looks like degrees"), "{said}");
    assert!(!out.exists());
    succeed(&mut with("si.csv", 1.0, 1.0));
}
