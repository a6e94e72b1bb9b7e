//! Arms recorded by another dynamics engine (MuJoCo, Pinocchio): identified, they must predict another motion to the
//! noise that was put in, or as near to it as that noise lets least squares with the exact regressor come. And URDF files as
//! they are written, read by the parser of another.
//!
//! The recordings are made by `tests/other_engine/record.py`. It needs a Python with the packages of
//! `tests/other_engine/requirements.txt`: the one named in RIG_PYTHON, `python3`, or else one that these tests furnish with
//! pip beside the build. Where that is not to be had they say so and pass.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::Command;

use rig_data::Source;
use rig_data::prepare::Recording;
use rig_identify::{Estimator, ModelKind, Options, identified_robot, identify};
use rig_model::robot::{Description, EDDA_TEMPLATE, IRP6_TEMPLATE, ONE_LINK_TEMPLATE, Robot};
use rig_output::data_dir;
use rig_tests::engines::{self, printed, scripts};

/// A Python with both engines.
fn python() -> Option<&'static PathBuf> {
    engines::python(Path::new(env!("CARGO_TARGET_TMPDIR")))
}

/// robot.urdf, train.csv, holdout.csv and truth.json of an arm, made in `place`.
fn record(python: &Path, place: &Path, arm: &str, engine: &str, seed: u64) {
    let seed = seed.to_string();
    let options = ["--arm", arm, "--engine", engine, "--seed", &seed, "--out"];
    printed(
        Command::new(python)
            .arg(scripts().join("record.py"))
            .args(options)
            .arg(place),
    );
}

/// Identifies one arm in both models and compares the hold-out's residual with the noise, joint by joint.
fn at_the_noise(arm: &str, engine: &str, seed: u64) {
    let Some(python) = python() else { return };
    let place = tempfile::tempdir().unwrap();
    record(python, place.path(), arm, engine, seed);
    let truth: serde_json::Value =
        serde_json::from_slice(&std::fs::read(place.path().join("truth.json")).unwrap()).unwrap();
    let robot = Robot::load(&place.path().join("robot.urdf")).unwrap();
    let open = |name: &str| Source::open(&place.path().join(name), &robot).unwrap();
    let (train, holdout) = (open("train.csv"), open("holdout.csv"));
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let options = Options {
            model,
            estimator: Estimator::for_robot(&robot),
            look_beyond: true,
            ..Default::default()
        };
        let found = identify(
            &robot,
            &[&train as &dyn Recording],
            &[&holdout as &dyn Recording],
            &options,
        )
        .unwrap();
        let noise = truth["noise_rms"]["holdout"].as_array().unwrap();
        let ratios: Vec<f64> = found
            .joints
            .iter()
            .zip(noise)
            .map(|(joint, sigma)| joint.holdout_residual_rms.unwrap() / sigma.as_f64().unwrap())
            .collect();
        let exact: Vec<f64> = truth["exact_least_squares"]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect();
        println!(
            "{arm} by {engine}, {model:?}: residual over noise {ratios:.3?}, of exact least squares {exact:.3?}"
        );
        for (j, (ratio, exact)) in ratios.iter().zip(&exact).enumerate() {
            assert!(
                *ratio > 0.8 && *ratio < 1.1 * exact,
                "{arm} by {engine}, {model:?}, joint {}: {ratio:.3} times the noise, exact least squares {exact:.3}",
                j + 1
            );
        }
    }
}

#[test]
fn ur5_likeness_by_mujoco() {
    at_the_noise("ur5", "mujoco", 3);
}

#[test]
fn panda_likeness_by_pinocchio() {
    at_the_noise("panda", "pinocchio", 4);
}

#[test]
fn panda_likeness_by_mujoco() {
    at_the_noise("panda", "mujoco", 5);
}

#[test]
fn random_arm_with_prismatic_joints_by_both() {
    at_the_noise("random", "mujoco", 6);
    at_the_noise("random", "pinocchio", 7);
}

/// Two axes follow a joint: the engine moves all six, the recording has the four joints.
#[test]
fn arm_whose_axes_follow_joints_by_both() {
    at_the_noise("mimic", "mujoco", 8);
    at_the_noise("mimic", "pinocchio", 9);
}

/// Pinocchio reads the text with urdfdom; its torques must be those of its own model of the description.
fn reads_as(python: &Path, robot: &Robot, urdf: &str) {
    let place = tempfile::tempdir().unwrap();
    let [description, file] = ["robot.toml", "robot.urdf"].map(|name| place.path().join(name));
    std::fs::write(&description, robot.to_toml().unwrap()).unwrap();
    std::fs::write(&file, urdf).unwrap();
    let said = printed(
        Command::new(python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/urdf/check.py"))
            .args([&description, &file])
            .args(["--most", "1e-11"]),
    );
    println!("{}", said.trim());
    assert!(said.contains("torques differ by"), "{}", robot.name);
}

#[test]
fn urdf_written_from_a_description_loads_in_a_standard_parser() {
    let Some(python) = python() else { return };
    let irp6 = Robot::from_toml(IRP6_TEMPLATE, Path::new("irp6.toml")).unwrap();
    let mut robots = vec![irp6];
    for file in ["staubli_tx40/tx40.urdf", "kuka_lwr4/kuka_lwr4.urdf"] {
        let Some(path) = data_dir().map(|d| d.join(file)).filter(|p| p.is_file()) else {
            println!("SKIPPED: {file} is not there; set RIG_DATA to the folder of the recordings.");
            continue;
        };
        let read = Description::load(&path).unwrap();
        // The file as its author wrote it says the same as what was read from it.
        reads_as(
            python,
            &read.robot,
            &std::fs::read_to_string(&path).unwrap(),
        );
        robots.push(read.robot);
    }
    for robot in robots {
        reads_as(python, &robot, &robot.to_urdf().unwrap().text);
        // On a base that leans.
        let mut leaning = robot.clone();
        leaning.gravity = [1.0, -2.0, -(9.81f64.powi(2) - 5.0).sqrt()];
        reads_as(python, &leaning, &leaning.to_urdf().unwrap().text);
    }
}

/// An arm with prismatic joints, identified: a file of its own, and the arm's file with other values.
#[test]
fn urdf_of_an_identified_arm_loads_in_a_standard_parser() {
    let Some(python) = python() else { return };
    let place = tempfile::tempdir().unwrap();
    record(python, place.path(), "random", "pinocchio", 7);
    let described = Description::load(&place.path().join("robot.urdf")).unwrap();
    let robot = &described.robot;
    let train = Source::open(&place.path().join("train.csv"), robot).unwrap();
    let options = Options {
        estimator: Estimator::for_robot(robot),
        ..Default::default()
    };
    let found = identify(robot, &[&train as &dyn Recording], &[], &options).unwrap();
    let (identified, _) = identified_robot(robot, &found);
    assert_ne!(&identified, robot);
    reads_as(python, &identified, &identified.to_urdf().unwrap().text);
    let original = described.urdf.as_ref().unwrap();
    reads_as(
        python,
        &identified,
        &original.with_values(&identified).unwrap().text,
    );
}

/// `tests/sdf/load.cpp` built with sdformat, the parser of Gazebo (Debian: libsdformat-dev), if that is here.
fn gazebo(place: &Path) -> Option<PathBuf> {
    let library = (12..=16)
        .map(|version| format!("sdformat{version}"))
        .find(|name| {
            let found = Command::new("pkg-config").args(["--exists", name]).status();
            found.is_ok_and(|status| status.success())
        });
    let Some(library) = library else {
        println!(
            "SKIPPED: sdformat, the parser of Gazebo, is not here; on Debian, apt-get install g++ pkg-config libsdformat-dev."
        );
        return None;
    };
    let flags = printed(Command::new("pkg-config").args(["--cflags", "--libs", &library]));
    let (source, program) = (
        Path::new(env!("CARGO_MANIFEST_DIR")).join("sdf/load.cpp"),
        place.join("load"),
    );
    printed(
        Command::new("c++")
            .args(["-std=c++17", "-o"])
            .args([&program, &source])
            .args(flags.split_whitespace()),
    );
    Some(program)
}

/// All joints, the masses, and the frames at zero positions in a level world must be those of the description.
fn gazebo_reads(program: &Path, place: &Path, robot: &Robot) {
    let file = place.join("robot.urdf");
    let urdf = robot.to_urdf().unwrap();
    std::fs::write(&file, &urdf.text).unwrap();
    let said = printed(Command::new(program).arg(&file));
    let mut links = said.lines().filter_map(|line| line.strip_prefix("link "));
    // Down is -z in Gazebo: the same turn brings it there for each frame.
    let down = nalgebra::Vector3::from(robot.gravity).normalize();
    let mut frame = nalgebra::Isometry3::identity();
    for joint in &robot.joints {
        frame *= joint.pose(0.0);
        let fields: Vec<&str> = links.next().unwrap().split(' ').collect();
        assert_eq!(fields[0], format!("{}_link", joint.name));
        let numbers: Vec<f64> = fields[1..].iter().map(|f| f.parse().unwrap()).collect();
        let mass = joint.inertial.as_ref().map_or(numbers[0], |own| own.mass);
        assert!((numbers[0] - mass).abs() < 1e-9 * mass);
        let [x, y, z, w, i, j, k] = *numbers.last_chunk().unwrap();
        let own = nalgebra::Isometry3::from_parts(
            nalgebra::Translation3::new(x, y, z),
            nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k)),
        );
        // What a bubble level and a plumb line on the link show.
        let level = own.rotation.inverse() * -nalgebra::Vector3::z();
        let height = own.translation.vector.z + frame.translation.vector.dot(&down);
        assert!(
            (level - frame.rotation.inverse() * down).norm() < 1e-9,
            "{}",
            joint.name
        );
        assert!(height.abs() < 1e-9, "{}", joint.name);
        assert!((own.translation.vector.norm() - frame.translation.vector.norm()).abs() < 1e-9);
        let kind = said
            .lines()
            .find_map(|line| line.strip_prefix(&format!("joint {} ", joint.name)));
        assert!(kind.is_some(), "{} in {said}", joint.name);
    }
    assert!(links.next().is_none(), "{said}");
}

/// Gazebo passes over a link without inertia and what it carries, and refuses masses and inertias that no body has.
#[test]
fn gazebo_takes_written_urdf_files() {
    let place = tempfile::tempdir().unwrap();
    let Some(program) = gazebo(place.path()) else {
        return;
    };
    for (name, text) in [
        ("one-link", ONE_LINK_TEMPLATE),
        ("irp6", IRP6_TEMPLATE),
        ("edda", EDDA_TEMPLATE),
    ] {
        let robot = Robot::from_toml(text, Path::new(name)).unwrap();
        gazebo_reads(&program, place.path(), &robot);
        let mut leaning = robot.clone();
        leaning.gravity = [1.0, -2.0, -(9.81f64.powi(2) - 5.0).sqrt()];
        gazebo_reads(&program, place.path(), &leaning);
    }
}

/// `tests/mjcf/load.py` gives the fragment to MuJoCo, at joints of the same names.
#[test]
fn mujoco_takes_the_values_of_joints_from_a_written_fragment() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mjcf = Path::new(env!("CARGO_MANIFEST_DIR")).join("mjcf");
    let robot = Description::load(&mjcf.join("arm.xml")).unwrap().robot;
    let path = folder.path().join("joints.xml");
    std::fs::write(&path, robot.to_mjcf_joints().text).unwrap();
    let names = robot.joints.iter().map(|joint| joint.name.as_str());
    let said = printed(
        Command::new(python)
            .arg(mjcf.join("load.py"))
            .arg(&path)
            .args(names),
    );
    let found: serde_json::Value = serde_json::from_str(&said).unwrap();
    for (name, key, want) in [
        ("pan", "armature", 0.01),
        ("lift", "armature", 0.3),
        ("lift", "damping", 1.5),
        ("lift", "frictionloss", 0.8),
        ("lift", "gear", -80.0),
        ("roll", "gear", 1.0),
        ("slide", "damping", 0.2),
    ] {
        let own = found[name][key].as_f64().unwrap();
        assert!((own - want).abs() < 1e-12, "{name} {key}: {own}");
    }
}
