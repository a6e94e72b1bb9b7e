//! Control and contact against other dynamics engines (MuJoCo, Pinocchio): the laws' quantities in operational space, and
//! simulated contacts.
//!
//! `tests/other_engine/contact.py` reads the description, the task and the recorded motion, and knows nothing else. A Python
//! with both engines is found as in `other_engine.rs`; where there is none, the tests say so and pass.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::Path;
use std::process::Command;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rig_control::{Bench, ContactOptions, ContactTask, LawKind, LawModel, Settings, Surface, save};
use rig_model::robot::{EDDA_TEMPLATE, IRP6_TEMPLATE, Robot};
use rig_model::simulate::Model;
use rig_shared::control::arm::{Inputs, Law, Operational, Task, impedance};
use rig_shared::precompensation::PrecompensationSettings;
use rig_shared::trajectory::Reference;
use rig_tests::engines::{printed, python, scripts};
use serde_json::{Value, json};

fn templates() -> [(&'static str, Robot); 2] {
    [("edda", EDDA_TEMPLATE), ("irp6", IRP6_TEMPLATE)]
        .map(|(name, text)| (name, Robot::from_toml(text, Path::new(name)).unwrap()))
}

/// Runs the script on a folder and returns what it found.
fn ask(python: &Path, what: &str, folder: &Path) -> Value {
    let said = printed(
        Command::new(python)
            .arg(scripts().join("contact.py"))
            .arg(what)
            .arg(folder),
    );
    println!("{}", said.trim());
    serde_json::from_str(&said).unwrap()
}

/// A random state with the torques that the impedance law gives in it, and what they are made of.
fn case(
    model: &LawModel,
    law: &impedance::Config<'_, f64>,
    start: &[f64],
    random: &mut Pcg64Mcg,
) -> Value {
    let n = start.len();
    let mut near = |size: f64| size * (2.0 * random.random::<f64>() - 1.0);
    let q: Vec<f64> = start.iter().map(|q| q + near(0.3)).collect();
    let qd: Vec<f64> = q.iter().map(|_| near(1.0)).collect();
    let mut reference = |size: f64| Reference {
        position: near(size),
        velocity: near(1.0),
        acceleration: near(2.0),
    };
    let mut posture: Vec<_> = q.iter().map(|_| reference(0.1)).collect();
    for (own, q) in posture.iter_mut().zip(&q) {
        own.position += q;
    }
    let task = [0; 3].map(|_| reference(0.05));
    let force = [0; 3].map(|_| near(30.0));
    let input = Inputs {
        position: &q,
        velocity: &qd,
        reference: &posture,
        task,
        force,
        feedforward: &[],
    };
    let mut torque = vec![0.0; n];
    law.step(&mut (), &input, &mut torque).unwrap();
    let motion = (law.operational.task)
        .motion(&model.chain, &q, &qd)
        .unwrap();
    let mut mass = vec![0.0; n * n];
    model.view().inertia_matrix(&q, &mut mass).unwrap();
    let count = law.operational.task.directions.len();
    let list = |r: &Reference<f64>| [r.position, r.velocity, r.acceleration];
    json!({
        "q": q, "qd": qd, "force": force, "torque": torque,
        "posture": posture.iter().map(list).collect::<Vec<_>>(),
        "task": task[..count].iter().map(list).collect::<Vec<_>>(),
        "inertia": mass.chunks(n).collect::<Vec<_>>(),
        "jacobian": motion.rows[..count].iter().map(|row| &row[..n]).collect::<Vec<_>>(),
        "convective": motion.convective[..count],
    })
}

/// Inertia in operational space, Jacobian and J̇·q̇ of the laws, and the torques that they give.
#[test]
fn torques_in_operational_space_are_those_of_pinocchio() {
    let Some(python) = python(Path::new(env!("CARGO_TARGET_TMPDIR"))) else {
        return;
    };
    for (name, robot) in templates() {
        let place = tempfile::tempdir().unwrap();
        let model = LawModel::of(&robot).unwrap();
        let settings = Settings::default();
        let chosen = ContactTask::choose(&model, &ContactOptions::default(), &settings).unwrap();
        let endless = vec![f64::INFINITY; robot.joints.len()];
        let posture = [900.0, 60.0];
        let law = impedance::Config {
            operational: Operational {
                model: model.view(),
                task: Task {
                    tool: [0.1, -0.05, 0.08],
                    origin: chosen.origin,
                    directions: &chosen.directions,
                },
                posture,
                friction: PrecompensationSettings::default(),
                torque_limit: &endless,
            },
            targets: &chosen.targets,
        };
        let mut random = Pcg64Mcg::seed_from_u64(36);
        let cases: Vec<Value> = (0..40)
            .map(|_| case(&model, &law, &chosen.pose, &mut random))
            .collect();
        let targets = chosen.targets.iter();
        let targets: Vec<_> = targets.map(|t| [t.mass, t.damping, t.stiffness]).collect();
        let laws = json!({
            "tool": law.operational.task.tool, "origin": chosen.origin, "posture": posture,
            "directions": chosen.directions, "targets": targets, "cases": cases,
        });
        fs::write(place.path().join("laws.json"), laws.to_string()).unwrap();
        fs::write(place.path().join("robot.toml"), robot.to_toml().unwrap()).unwrap();
        let found = ask(python, "laws", place.path());
        assert_eq!(found["cases"], 40);
        for (what, most) in [
            ("torque", 1e-7),
            ("inertia", 1e-9),
            ("jacobian", 1e-12),
            ("bend", 1e-9),
        ] {
            let off = found[what].as_f64().unwrap();
            assert!(off < most, "{name}: {what} differs by {off}");
        }
    }
}

/// A contact with exact sensors, in a folder as the script reads it.
fn record(name: &str, robot: &Robot, law: LawKind) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    let model = LawModel::of(robot).unwrap();
    let settings = Settings {
        resolution: 0.0,
        ..Settings::default()
    };
    let options = ContactOptions {
        surface: Surface {
            damping: 30.0,
            ..Surface::default()
        },
        slide: 0.05,
        ..ContactOptions::default()
    };
    let task = ContactTask::choose(&model, &options, &settings).unwrap();
    let reference = task.joint_reference((task.duration * settings.rate) as usize);
    let bench = Bench {
        robot,
        truth: &Model::from_robot(robot).unwrap(),
        reference: &reference,
        tool: task.tool,
        settings,
        wrong: None,
    };
    let run = bench.press(law, &model, name, &task).unwrap();
    let [motion, described, asked] =
        ["motion.csv", "robot.toml", "task.json"].map(|file| place.path().join(file));
    save(&motion, robot, &run.trace, &reference).unwrap();
    fs::write(described, robot.to_toml().unwrap()).unwrap();
    fs::write(asked, serde_json::to_string(&task).unwrap()).unwrap();
    place
}

/// Force closure, tick by tick: torque = inverse dynamics + friction + Jᵀ·force. And the same motion and force from the
/// recorded torques.
///
/// Largest values that were found with MuJoCo 4.0.0 and Pinocchio 4.1.0 (29 November 2026): 0.00032 of the largest torque
/// where all joints and the tool slide, 0.0094 where some rest or the tool creeps, 0.0022 in 99 of 100 ticks; force 0.031 N,
/// tool 3.1 µm. The friction of the surface at creeping speeds, which the simulation takes at the start of its step, makes
/// most of it.
#[test]
fn contacts_are_those_of_other_engines() {
    let Some(python) = python(Path::new(env!("CARGO_TARGET_TMPDIR"))) else {
        return;
    };
    for (name, robot) in templates() {
        for law in [LawKind::Hybrid, LawKind::Impedance] {
            let place = record(name, &robot, law);
            let found = ask(python, "motion", place.path());
            let at = |part: &str, key: &str| found[part][key].as_f64().unwrap();
            let largest = found["largest_force"].as_f64().unwrap();
            assert!(largest > 10.0, "{name}");
            // The column of the IRp-6 rests in this task.
            assert!(at("inverse", "sticking_ticks") > 50.0);
            assert!(name == "irp6" || at("inverse", "sliding_ticks") > 50.0);
            for (key, most) in [
                ("pressed", 1e-9),
                ("sliding", 1e-3),
                ("sticking", 2e-2),
                ("in_99_of_100", 3e-3),
            ] {
                let off = at("inverse", key);
                assert!(off < most, "{name} {key}: {off}");
            }
            assert!(at("again", "stretches") >= 6.0 && at("again", "moved") > 1e-3);
            let [force, tool] = ["force", "tool"].map(|key| at("again", key));
            assert!(force < 0.05, "{name}: force differs by {force} N");
            assert!(tool < 5e-6, "{name}: tool differs by {tool} m");
        }
    }
}

/// The comparison fails where the two differ: friction of a joint by a tenth, the surface by a hundredth.
#[test]
fn a_contact_of_another_arm_or_surface_is_told_from_this_one() {
    let Some(python) = python(Path::new(env!("CARGO_TARGET_TMPDIR"))) else {
        return;
    };
    let [(name, robot), _] = templates();
    let place = record(name, &robot, LawKind::Hybrid);
    let mut other = robot.clone();
    other.joints[0].friction.as_mut().unwrap().coulomb *= 1.1;
    fs::write(place.path().join("robot.toml"), other.to_toml().unwrap()).unwrap();
    let found = ask(python, "motion", place.path());
    assert!(found["inverse"]["sliding"].as_f64().unwrap() > 5e-3);
    assert!(found["inverse"]["in_99_of_100"].as_f64().unwrap() > 3e-3);
    fs::write(place.path().join("robot.toml"), robot.to_toml().unwrap()).unwrap();
    let task = place.path().join("task.json");
    let mut changed: Value = serde_json::from_slice(&fs::read(&task).unwrap()).unwrap();
    let stiffness = changed["surface"]["stiffness"].as_f64().unwrap();
    changed["surface"]["stiffness"] = json!(1.01 * stiffness);
    fs::write(&task, changed.to_string()).unwrap();
    let found = ask(python, "motion", place.path());
    assert!(found["inverse"]["pressed"].as_f64().unwrap() > 0.1);
    assert!(found["again"]["force"].as_f64().unwrap() > 0.05);
}
