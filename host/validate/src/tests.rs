#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use rand::{RngExt, SeedableRng};

use super::*;
use rig_data::Block;
use rig_data::prepare::{Choice, InMemory, PrepareOptions};
use rig_excite::{Noise, SampledReference, replay};
use rig_model::robot::{Controller, JointFriction, Robot};
use rig_model::simulate::{Inputs, Model, closed_loop};

/// EMPS with the published values (Janot, Gautier & Brunot 2019).
fn emps() -> Robot {
    let mut robot = Robot::from_toml(rig_model::robot::EMPS, Path::new("emps.toml")).unwrap();
    robot.joints[0].inertial = Some(rig_model::robot::Inertial {
        mass: 95.1089,
        first_moment: [0.0; 3],
        inertia: [0.0; 6],
    });
    robot.joints[0].friction = Some(JointFriction {
        coulomb: 20.3935,
        viscous: 203.5034,
        offset: -3.1648,
    });
    robot
}

/// A pendulum on a gear with a cascade controller.
fn pendulum() -> Robot {
    let mut robot = Robot::from_toml(
        rig_model::robot::ONE_LINK_TEMPLATE,
        Path::new("one-link.toml"),
    )
    .unwrap();
    robot.joints[0].controller = Some(Controller {
        position_gain: 16.0,
        velocity_gain: 60.0,
        torque_gain: 0.17,
    });
    robot
}

/// Records twenty seconds at 1 kHz of the robot's own closed loop, plus a test signal if `added` is not zero.
fn simulated(robot: &Robot, added: f64) -> Block {
    let period = 1e-3;
    let t: Vec<f64> = (0..20_000).map(|k| f64::from(k) * period).collect();
    let reference: Vec<f64> = t
        .iter()
        .map(|t| 0.8 * (1.0 - (1.3 * t).cos()) + 0.3 * (3.7 * t).sin().powi(2))
        .collect();
    let pulses: Vec<f64> = t
        .iter()
        .map(|t| if (0.7 * t).fract() < 0.3 { added } else { 0.0 })
        .collect();
    let model = Model::from_robot(robot).unwrap();
    let controllers = [robot.joints[0].controller.clone().unwrap()];
    let motion = closed_loop(
        robot,
        &model,
        &controllers,
        &Inputs {
            period,
            reference: std::slice::from_ref(&reference),
            feed_forward: &[],
            added: std::slice::from_ref(&pulses),
            q: &[0.0],
            v: &[0.0],
            substeps: 16,
            held: true,
        },
        |_| (),
    )
    .unwrap();
    let speed = motion.qd[0].clone();
    let mut block = Block::of_motion(motion, period, &[reference]);
    for (tau, added) in block.joints[0].tau.iter_mut().zip(&pulses) {
        *tau += added;
    }
    block.joints[0].qd = Some(speed);
    block.extra = vec![("added1".into(), pulses)];
    block
}

/// Returns the rows with the indices `at`.
fn picked(block: &Block, at: impl Fn(usize) -> usize) -> Block {
    let rows: Vec<usize> = (0..).map(at).take_while(|k| *k < block.len()).collect();
    let of = |column: &Vec<f64>| rows.iter().map(|k| column[*k]).collect::<Vec<f64>>();
    let mut few = block.clone();
    few.t = of(&block.t);
    for (to, from) in few.joints.iter_mut().zip(&block.joints) {
        to.q = of(&from.q);
        to.tau = of(&from.tau);
        to.qd = from.qd.as_ref().map(of);
        to.reference = from.reference.as_ref().map(of);
    }
    for ((_, to), (_, from)) in few.extra.iter_mut().zip(&block.extra) {
        *to = of(from);
    }
    few
}

fn run(robot: &Robot, block: Block) -> Validation {
    let recording = InMemory {
        label: "made".into(),
        blocks: vec![block],
    };
    validate(robot, &[&recording], &Options::default(), &mut |_| ()).unwrap()
}

fn motion_of(found: &Validation) -> &MotionCheck {
    match &found.recordings[0].motion {
        Motion::Simulated { joints, .. } => &joints[0],
        Motion::NotSimulated { why } => panic!("{why}"),
    }
}

#[test]
fn a_recording_of_the_description_itself_leaves_nothing() {
    let robot = pendulum();
    for added in [0.0, 1.5] {
        let found = run(&robot, simulated(&robot, added));
        let torque = &found.recordings[0].torque[0].residual;
        // Errors of filters and differences at reversals of dry friction, and at the edges of pulses.
        assert!(torque.relative_error < 0.05, "{}", torque.relative_error);
        let motion = motion_of(&found);
        assert!(motion.tracking_rms > 0.05);
        assert!(
            motion.position_rms_error < 1e-4 * motion.tracking_rms,
            "{motion:?}"
        );
        assert!(motion.torque_relative_error < 1e-3, "{motion:?}");
    }
}

/// Rows 8 to 16 ms apart, as a loaded PC writes them: the same errors as for even rows, with the added torque.
#[test]
fn uneven_rows_are_judged_as_even_ones_are() {
    let robot = pendulum();
    let mut block = simulated(&robot, 0.4);
    let even = run(&robot, picked(&block, |k| 12 * k));
    let mut lots = rand_pcg::Pcg64::seed_from_u64(5);
    let (mut at, mut k) = (Vec::new(), 0);
    while k < block.len() {
        at.push(k);
        k += lots.random_range(8..=16);
    }
    let rows = at.len();
    block = picked(&block, |k| at.get(k).copied().unwrap_or(usize::MAX));
    assert_eq!(block.len(), rows);
    let uneven = run(&robot, block);
    assert!(
        uneven.warnings.iter().any(|w| w.contains("uneven steps")),
        "{:?}",
        uneven.warnings
    );
    let error = |found: &Validation| found.recordings[0].torque[0].residual.rms;
    let motion = |found: &Validation| motion_of(found).position_rms_error;
    println!(
        "{:e} {:e} N·m, {:e} {:e} rad",
        error(&even),
        error(&uneven),
        motion(&even),
        motion(&uneven)
    );
    assert!(error(&uneven) < 1.5 * error(&even) + 1e-3);
    assert!(motion(&uneven) < 1.5 * motion(&even) + 1e-4);
}

#[test]
fn a_wrong_friction_shows_in_torque_and_motion() {
    let robot = pendulum();
    let block = simulated(&robot, 0.0);
    let right = run(&robot, block.clone());
    let mut wrong = robot.clone();
    wrong.joints[0].friction.as_mut().unwrap().coulomb += 0.3;
    let found = run(&wrong, block);
    let rms = found.recordings[0].torque[0].residual.rms;
    // 0.3 N·m too much, always against the motion.
    assert!((rms / 0.3 - 1.0).abs() < 0.1, "{rms}");
    let (a, b) = (motion_of(&right), motion_of(&found));
    assert!(
        b.position_rms_error > 100.0 * a.position_rms_error,
        "{a:?} {b:?}"
    );
    // The position error of 0.3 N·m at the controller's stiffness.
    let stiff = 0.17 * 60.0 * 16.0;
    assert!(
        (b.position_rms_error * stiff / 0.3 - 1.0).abs() < 0.3,
        "{b:?}"
    );
}

#[test]
fn a_torque_that_was_added_and_not_recorded_shows() {
    let robot = pendulum();
    let mut block = simulated(&robot, 1.5);
    block.extra.clear();
    let found = run(&robot, block);
    // The torque still explains the motion, but the controller alone does not produce it.
    assert!(found.recordings[0].torque[0].residual.relative_error < 0.05);
    assert!(motion_of(&found).tracking_relative_error > 0.05);
}

#[test]
fn what_is_missing_is_said() {
    let robot = pendulum();
    let mut block = simulated(&robot, 0.0);
    block.joints[0].reference = None;
    let found = run(&robot, block.clone());
    let Motion::NotSimulated { why } = &found.recordings[0].motion else {
        panic!("simulated without a reference");
    };
    assert!(why.contains("ref1"), "{why}");
    assert!(found.warnings.iter().any(|w| w.contains("ref1")));
    let json = serde_json::to_value(&found).unwrap();
    assert_eq!(json["schema"], "rig-validation/1");
    assert_eq!(json["recordings"][0]["motion"]["status"], "not_simulated");
    assert!(json["recordings"][0]["torque"][0]["relative_error"].is_number());
}

/// Two joints of an arm and its recording by `rig simulate`, without a controller in the description.
#[test]
fn what_the_stand_in_made_it_makes_again() {
    let mut robot = Robot::from_toml(
        rig_model::robot::template("edda").unwrap(),
        Path::new("edda.toml"),
    )
    .unwrap();
    for joint in &mut robot.joints {
        joint.controller = None;
    }
    let n = robot.joints.len();
    let reference = SampledReference::about_middle(&robot, 1e-3, 6.0, |j, t| {
        0.3 * (t * (2.0 + j as f64)).sin()
    });
    let noise = Noise {
        position: 0.0,
        velocity: 0.0,
        torque: 0.0,
    };
    let made = replay(&robot, &reference, noise, 1, |_, _| ()).unwrap();
    assert_eq!(made.notes.len(), 1, "{:?}", made.notes);
    assert!(
        made.notes[0].contains("shoulder, elbow;"),
        "{:?}",
        made.notes
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.csv");
    made.save(&path, &robot).unwrap();
    let source = rig_data::Source::open(&path, &robot).unwrap();
    let judged = |robot: &Robot| {
        let found = validate(robot, &[&source], &Options::default(), &mut |_| ()).unwrap();
        let Motion::Simulated {
            joints,
            uncontrolled,
            ..
        } = found.recordings[0].motion.clone()
        else {
            panic!("{:?}", found.warnings);
        };
        assert_eq!(uncontrolled.len(), n);
        let said = |w: &String| {
            w.contains("no [joint.controller]") && w.contains("recorded torques drive")
        };
        assert!(found.warnings.iter().any(said), "{:?}", found.warnings);
        joints
    };
    for joint in judged(&robot) {
        println!(
            "{} {} {}",
            joint.joint, joint.position_relative_error, joint.torque_relative_error
        );
        // The substitute is very close to its reference, so the error is relative to the joint's travel.
        assert!(joint.position_relative_error < 1e-4, "{joint:?}");
    }
    let mut other = robot.clone();
    for joint in &mut other.joints {
        if let Some(friction) = &mut joint.friction {
            friction.coulomb += 5.0;
        }
    }
    for joint in judged(&other) {
        assert!(joint.position_relative_error > 2.5e-3, "{joint:?}");
    }
}

/// The recorded torque moves the joint, so the controller need not be known.
#[test]
fn without_a_controller_the_recorded_torque_drives_the_model() {
    let robot = pendulum();
    let block = simulated(&robot, 1.5);
    let mut open = robot.clone();
    open.joints[0].controller = None;
    let mut wrong = open.clone();
    wrong.joints[0].friction.as_mut().unwrap().coulomb += 0.1;
    let [right, wrong] = [open, wrong].map(|robot| {
        let found = run(&robot, block.clone());
        assert!(matches!(&found.recordings[0].motion, Motion::Simulated { uncontrolled, .. } if uncontrolled == &["link"]));
        let said = |w: &String| w.contains("no closed loop") && w.contains("recorded torque drives");
        assert!(found.warnings.iter().any(said), "{:?}", found.warnings);
        let motion = motion_of(&found).clone();
        println!("{} {}", motion.tracking_relative_error, motion.torque_relative_error);
        motion
    });
    assert!(right.tracking_relative_error < 0.03, "{right:?}");
    assert!(right.torque_relative_error < 0.05, "{right:?}");
    assert!(wrong.position_rms_error > 4.0 * right.position_rms_error);
}

/// A substitute controller cannot follow references in another unit.
#[test]
fn a_stand_in_does_not_follow_references_of_another_unit() {
    let robot = pendulum();
    let mut block = simulated(&robot, 0.0);
    let reference = block.joints[0].reference.as_mut().unwrap();
    reference.iter_mut().for_each(|r| *r /= 57.296);
    let mut open = robot.clone();
    open.joints[0].controller = None;
    let found = run(&open, block);
    let Motion::NotSimulated { why } = &found.recordings[0].motion else {
        panic!("simulated");
    };
    assert!(
        why.contains("stand-in cannot follow") && why.contains("ref1"),
        "{why}"
    );
}

#[test]
fn a_description_without_dynamics_is_refused() {
    let robot = Robot::from_toml(rig_model::robot::EMPS, Path::new("emps.toml")).unwrap();
    let recording = InMemory {
        label: "made".into(),
        blocks: vec![simulated(&pendulum(), 0.0)],
    };
    let error = validate(&robot, &[&recording], &Options::default(), &mut |_| ());
    assert!(matches!(error, Err(ValidateError::NothingKnown { .. })));
    let none = validate(&emps(), &[], &Options::default(), &mut |_| ());
    assert!(matches!(none, Err(ValidateError::NoRecording)));
}

#[test]
fn a_long_recording_is_cut_and_says_so() {
    let robot = pendulum();
    let recording = InMemory {
        label: "made".into(),
        blocks: vec![simulated(&robot, 0.0)],
    };
    let options = Options {
        most_samples: 5000,
        ..Options::default()
    };
    let found = validate(&robot, &[&recording], &options, &mut |_| ()).unwrap();
    let Motion::Simulated {
        samples,
        of,
        remarks,
        ..
    } = &found.recordings[0].motion
    else {
        panic!("not simulated");
    };
    assert_eq!((*samples, *of), (5000, 20_000));
    assert!(remarks.iter().any(|r| r.contains("first 5000 of 20000")));
}

/// The published description on the published recordings, processed as in the literature.
#[test]
fn emps_moves_as_published() {
    let Some(folder) = rig_output::data_dir() else {
        println!("SKIPPED: the folder of real recordings is not there; set RIG_DATA to it.");
        return;
    };
    let robot = emps();
    let open = |file| rig_data::Source::open(&folder.join("emps").join(file), &robot).unwrap();
    let (train, test) = (open("train.csv"), open("test_pulses.csv"));
    let options = Options {
        prepare: PrepareOptions {
            cutoff: Choice::Fixed(100.0),
            decimation: Choice::Fixed(10),
            speed_threshold: Choice::Fixed(0.0),
            ..PrepareOptions::default()
        },
        ..Options::default()
    };
    let found = validate(&robot, &[&train, &test], &options, &mut |_| ()).unwrap();
    for recording in &found.recordings {
        let torque = &recording.torque[0].residual;
        println!(
            "{}: torque rms {:.4}, relative {:.5}",
            recording.recording, torque.rms, torque.relative_error
        );
        let Motion::Simulated {
            joints,
            remarks,
            substeps,
            ..
        } = &recording.motion
        else {
            panic!("not simulated");
        };
        let mut shown = joints[0].clone();
        shown.series = MotionSeries::default();
        println!("   {substeps} {shown:?} {remarks:?}");
        let m = &joints[0];
        assert!(
            m.position_step_change < 0.02 * m.position_rms_error,
            "{m:?}"
        );
        assert!(m.torque_relative_error < 0.1, "{m:?}");
        // Pulses of 5 N instead of 5 controller units (176 N) would leave a fifth of the tracking error.
        assert!(m.tracking_relative_error < 0.01, "{m:?}");
        assert_eq!(m.saturated, 0);
    }
    // The value of an independent refit of the same data.
    assert!((found.recordings[0].torque[0].residual.relative_error - 0.0404).abs() < 5e-4);
}
