//! Arms of several joints: with one joint at fault, made up; and real ones.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::time::Instant;

use rig_shared::effects::Kind;

use super::outcome::Step;
use super::scenario::{Arm, ArmScenario, Fault};
use super::waves::is_of_the_motor;
use super::{Diagnosis, Options, diagnose};
use crate::data::{Source, data_dir};
use crate::prepare::Recording;
use crate::robot::Robot;

fn made(scenario: &ArmScenario) -> Diagnosis {
    let recordings = scenario.make().unwrap();
    let training: Vec<&dyn Recording> = (recordings.train.iter())
        .map(|r| r as &dyn Recording)
        .collect();
    diagnose(
        &recordings.robot,
        &training,
        &[&recordings.holdout],
        &Options::default(),
        &mut |_| (),
    )
    .unwrap()
    .0
}

/// Effect and joint of each step.
fn named(diagnosis: &Diagnosis) -> Vec<(&str, &str)> {
    (diagnosis.steps.iter())
        .map(|s| (s.effect.as_str(), s.joint.as_str()))
        .collect()
}

fn told(what: &str, diagnosis: &Diagnosis) {
    println!("{what}: {:?}", named(diagnosis));
    for step in &diagnosis.steps {
        println!(
            "    {} on {}: {:?} p {:.1e} train {:.4?} holdout {:.4?} closed {:.2}",
            step.effect,
            step.joint,
            (step.parameters.iter())
                .map(|(n, v)| format!("{n} {:.4}±{:.4}", v.value, v.std))
                .collect::<Vec<_>>(),
            step.p_value,
            step.train_rms,
            step.holdout_rms,
            step.gap_closed
        );
    }
    for w in &diagnosis.waterfall {
        println!(
            "    {}: train {:.4?} holdout {:.4?} floor {:.4}",
            w.joint, w.train, w.holdout, w.floor
        );
    }
    let last = diagnosis.tried.iter().map(|t| t.step).max();
    for t in (diagnosis.tried.iter().filter(|t| Some(t.step) == last)).take(6) {
        println!(
            "    tried {} on {}: gain {:.4} ({:.1} sigmas) p {:.1e} {}",
            t.effect, t.joint, t.gain, t.gain_sigmas, t.p_value, t.refused
        );
    }
}

#[test]
#[ignore = "prints a measurement"]
fn faults_of_one_joint() {
    let wanted = std::env::var("RIG_ARM").unwrap_or_default();
    for (name, arm, fault) in [
        ("upright-none", Arm::Upright, None),
        (
            "upright-stribeck",
            Arm::Upright,
            Some((1, Fault::Stribeck([1.6, 0.12]))),
        ),
        (
            "upright-asymmetric",
            Arm::Upright,
            Some((0, Fault::AsymmetricCoulomb(2.0))),
        ),
        (
            "upright-eccentric",
            Arm::Upright,
            Some((1, Fault::GearEccentricity([0.8, 1.0]))),
        ),
        (
            "upright-load",
            Arm::Upright,
            Some((0, Fault::LoadFriction(0.1))),
        ),
        (
            "upright-tilt",
            Arm::Upright,
            Some((0, Fault::GravityTilt([0.0, 0.06]))),
        ),
        (
            "upright-offset",
            Arm::Upright,
            Some((1, Fault::JointOffset(0.05))),
        ),
        ("planar-none", Arm::Planar, None),
        (
            "planar-tilt",
            Arm::Planar,
            Some((0, Fault::GravityTilt([0.04, 0.06]))),
        ),
        (
            "planar-coupling",
            Arm::Planar,
            Some((1, Fault::InertiaCoupling(0.3))),
        ),
        ("six-none", Arm::Six, None),
        (
            "six-stribeck",
            Arm::Six,
            Some((3, Fault::Stribeck([1.6, 0.12]))),
        ),
        (
            "six-asymmetric",
            Arm::Six,
            Some((1, Fault::AsymmetricCoulomb(2.0))),
        ),
        (
            "six-eccentric",
            Arm::Six,
            Some((4, Fault::GearEccentricity([0.8, 1.0]))),
        ),
        ("six-load", Arm::Six, Some((1, Fault::LoadFriction(0.1)))),
        (
            "six-coupling",
            Arm::Six,
            Some((3, Fault::InertiaCoupling(0.4))),
        ),
        (
            "six-tilt",
            Arm::Six,
            Some((0, Fault::GravityTilt([0.04, 0.06]))),
        ),
        (
            "six-payload",
            Arm::Six,
            Some((5, Fault::Payload([1.0, 0.02, 0.0, 0.05]))),
        ),
        ("six-offset", Arm::Six, Some((2, Fault::JointOffset(0.05)))),
    ] {
        if !name.contains(&wanted) {
            continue;
        }
        let start = Instant::now();
        let scenario = ArmScenario::new(arm, fault, 1);
        let recordings = scenario.make().unwrap();
        let joint = &recordings.train[0].blocks[0].joints[0];
        println!(
            "{name}: {} rows recorded in {:.1} s",
            joint.q.len(),
            start.elapsed().as_secs_f64()
        );
        let start = Instant::now();
        told(name, &made(&scenario));
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
    }
}

#[test]
fn two_joints_with_nothing_wrong_are_left_alone() {
    let diagnosis = made(&ArmScenario::new(Arm::Planar, None, 1));
    told("planar", &diagnosis);
    assert!(diagnosis.steps.is_empty());
    for w in &diagnosis.waterfall {
        // What repeats of the residual is little: the floor is the noise that was put in.
        assert!(w.holdout[0] < 1.1 * w.floor, "{w:?}");
    }
}

#[test]
fn a_missing_term_of_the_other_joint_is_named_with_its_inertia() {
    let fault = Some((1, Fault::InertiaCoupling(0.3)));
    let diagnosis = made(&ArmScenario::new(Arm::Planar, fault, 1));
    told("coupling", &diagnosis);
    assert_eq!(named(&diagnosis), [("inertia_coupling", "elbow")]);
    let inertia = &diagnosis.steps[0].parameters["inertia"];
    assert!(
        (inertia.value - 0.3).abs() < 4.0 * inertia.std,
        "{inertia:?}"
    );
    assert!(diagnosis.steps[0].gap_closed > 0.8);
}

#[test]
fn friction_with_another_joint_s_speed_is_not_called_an_inertia() {
    let fault = Some((1, Fault::ViscousCoupling(0.4)));
    let diagnosis = made(&ArmScenario::new(Arm::Planar, fault, 1));
    told("viscous", &diagnosis);
    assert!(
        named(&diagnosis)
            .iter()
            .all(|(name, _)| *name != "inertia_coupling")
    );
    assert!(diagnosis.remainder.is_some());
}

/// A real arm: description, training, hold-out.
struct Real {
    robot: Robot,
    training: Vec<PathBuf>,
    holdout: Vec<PathBuf>,
}

fn folder(name: &str) -> Option<PathBuf> {
    let found = data_dir().map(|d| d.join(name)).filter(|d| d.is_dir());
    if found.is_none() {
        println!("SKIPPED: the recordings {name} are not there; set RIG_DATA to their folder.");
    }
    found
}

fn described(file: &str) -> Robot {
    Robot::load(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("robots")
            .join(file),
    )
    .unwrap()
}

impl Real {
    fn diagnosed(&self) -> Diagnosis {
        let open = |list: &[PathBuf]| -> Vec<Source> {
            (list.iter())
                .map(|p| Source::open(p, &self.robot).unwrap())
                .collect()
        };
        let (training, holdout) = (open(&self.training), open(&self.holdout));
        let training: Vec<&dyn Recording> = training.iter().map(|s| s as &dyn Recording).collect();
        let holdout: Vec<&dyn Recording> = holdout.iter().map(|s| s as &dyn Recording).collect();
        diagnose(
            &self.robot,
            &training,
            &holdout,
            &Options::default(),
            &mut |_| (),
        )
        .unwrap()
        .0
    }

    /// RMS of the hold-out's torque, joint by joint.
    fn torque(&self) -> Vec<f64> {
        let n = self.robot.joints.len();
        let (mut squares, mut rows) = (vec![0.0; n], 0.0);
        for path in &self.holdout {
            let source = Source::open(path, &self.robot).unwrap();
            for block in source.blocks(1 << 20) {
                let block = block.unwrap();
                rows += block.len() as f64;
                for (sum, joint) in squares.iter_mut().zip(&block.joints) {
                    *sum += joint.tau.iter().map(|t| t * t).sum::<f64>();
                }
            }
        }
        squares.iter().map(|s| (s / rows).sqrt()).collect()
    }

    fn told(&self, what: &str) -> Diagnosis {
        let start = Instant::now();
        let diagnosis = self.diagnosed();
        let seconds = start.elapsed().as_secs_f64();
        told(what, &diagnosis);
        let relative = |pick: fn(&[f64]) -> f64| -> Vec<f64> {
            (diagnosis.waterfall.iter().zip(self.torque()))
                .map(|(w, t)| 100.0 * pick(&w.holdout) / t)
                .collect()
        };
        println!(
            "{what}: hold-out {:.1?} -> {:.1?} % in {seconds:.1} s",
            relative(|l| l[0]),
            relative(|l| l[l.len() - 1])
        );
        diagnosis
    }
}

fn emps() -> Option<Real> {
    let data = folder("emps")?;
    Some(Real {
        robot: described("emps.toml"),
        training: vec![data.join("train.csv")],
        holdout: vec![data.join("test_pulses.csv")],
    })
}

fn dfki() -> Option<Real> {
    let data = folder("dfki_double_pendulum")?;
    Some(Real {
        robot: described("double-pendulum.toml"),
        training: vec![data.join("train.csv")],
        holdout: vec![data.join("test.csv")],
    })
}

/// The first 70 % of the recording against the rest, as files in `place`.
fn tx40(place: &Path) -> Option<Real> {
    let data = folder("staubli_tx40")?;
    let text = std::fs::read_to_string(data.join("motor_1kHz.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let rows = lines.len() - 1;
    let part = |name: &str, from: usize, to: usize| {
        let path = place.join(name);
        let part = [&lines[..1], &lines[1 + from..1 + to]].concat();
        std::fs::write(&path, part.join("\n") + "\n").unwrap();
        path
    };
    Some(Real {
        robot: described("tx40.toml"),
        training: vec![part("train.csv", 0, rows * 7 / 10)],
        holdout: vec![part("rest.csv", rows * 7 / 10, rows)],
    })
}

fn kuka() -> Option<Real> {
    let data = folder("kuka_lwr4")?;
    Some(Real {
        robot: Robot::load(&data.join("kuka_lwr4.urdf")).unwrap(),
        training: vec![data.join("run1.csv"), data.join("run2.csv")],
        holdout: vec![data.join("run3.csv")],
    })
}

#[test]
#[ignore = "prints a measurement"]
fn real_arms() {
    let wanted = std::env::var("RIG_ARM").unwrap_or_default();
    let place = tempfile::tempdir().unwrap();
    for (name, real) in [
        ("emps", emps()),
        ("dfki", dfki()),
        ("tx40", tx40(place.path())),
        ("kuka", kuka()),
    ] {
        if let Some(real) = real.filter(|_| name.contains(&wanted)) {
            real.told(name);
        }
    }
}

/// A wave of 3 m along an axis that travels 0.25 m holds any offset, and a motor's angle that nobody has described is none.
#[test]
fn the_real_slide_gets_no_wave_that_it_does_not_travel_and_keeps_its_parameters() {
    let Some(real) = emps() else {
        return;
    };
    let diagnosis = real.told("emps");
    for (effect, _) in named(&diagnosis) {
        let along = Kind::named(effect, None).unwrap();
        assert!(
            !is_of_the_motor(along) && along != Kind::PositionFriction,
            "{effect}"
        );
    }
    for name in ["cogging", "gear_eccentricity", "position_friction"] {
        let lacking = diagnosis.not_testable.iter().find(|n| n.effect == name);
        assert!(lacking.is_some(), "{name}");
    }
    let motion = |pick: fn(&[f64; 2]) -> f64, step: Option<&Step>| {
        step.and_then(|s| s.motion_rms).map(|pair| pick(&pair))
    };
    let steps = &diagnosis.steps;
    if let Some((before, after)) =
        motion(|p| p[0], steps.first()).zip(motion(|p| p[1], steps.last()))
    {
        assert!(after <= before, "{before} {after}");
    }
    // Published: 20.3935 and −3.1648 N.
    let near = |name: &str, value: f64, least: f64| {
        let found = diagnosis.absorbed.iter().find(|a| a.parameter == name);
        let now = found.unwrap().after;
        assert!((now - value).abs() < least, "{name} {now}");
    };
    near("fc1", 20.4, 6.0);
    near("off1", -3.2, 1.0);
}

#[test]
#[ignore = "what is said of the TX40 is not settled: held before a remainder could take names back, not since"]
fn a_real_arm_with_six_joints_has_friction_under_load_in_one() {
    let place = tempfile::tempdir().unwrap();
    let Some(real) = tx40(place.path()) else {
        return;
    };
    let diagnosis = real.told("tx40");
    assert_eq!(named(&diagnosis)[0], ("load_friction", "joint_3"));
    // A third of what the hold-out leaves of that joint, 14.4 -> 9.4 % of its torque.
    let [before, after] = diagnosis.steps[0].holdout_rms.unwrap();
    assert!(after < 0.7 * before, "{before} {after}");
    // No gear so soft that its load winds it up by a turn of the hand.
    for step in &diagnosis.steps {
        if let Some(stiffness) = step.parameters.get("stiffness") {
            assert!(stiffness.value > 20.0, "{step:?}");
        }
    }
}
