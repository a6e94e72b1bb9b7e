//! Winding, inverter and current sensor of the emulated rig: a voltage step that fades at low current, ripple, delays
//! and noise that the equation lacks.

#![allow(clippy::unwrap_used)]

use crate::experiment::{Held, next};
use crate::outcome::Verdict;
use crate::tests::made::Diagnosed as _;
use crate::{Options, sensor_zeros};
use rig_excite::{JointTrajectory, TrajectoryFile};
use rig_scenario::{Effect, Hidden, Made, Scenario};
use rig_shared::effects::Kind;
use rig_shared::trajectory::{FrictionSweep, Trajectory};

fn made(hidden: Option<Effect>, seed: u64) -> Made {
    let hidden = hidden.map(|effect| Hidden { joint: 0, effect });
    Scenario {
        seconds: [30.0, 15.0],
        ..Scenario::new(hidden.into_iter().collect(), seed)
    }
    .make()
    .unwrap()
}

#[test]
fn a_dead_zone_shows_in_the_voltage_alone() {
    let made = made(Some(Effect::DriveDeadzone { voltage: 0.6 }), 5);
    let (found, model) = made.diagnosed(&made.robot, &Options::default());
    let names: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
    assert_eq!(names, ["drive_deadzone"], "{:?}", found.words);
    assert_eq!(found.verdict, Verdict::Explained);
    let step = &found.steps[0];
    let volts = &step.parameters["volts"];
    // The rig's step falls linearly below 0.1 A.
    assert!((volts.value - 0.6).abs() < 0.05 * 0.6, "{volts:?}");
    assert!(step.gap_closed > 0.9, "{}", step.gap_closed);
    assert_eq!(found.gap_closed, Some(step.gap_closed));
    assert_eq!(step.rms_unit, "V");
    let map = found.maps.iter().find(|m| m.step == Some(0)).unwrap();
    assert_eq!((map.unit.as_str(), map.residual_unit.as_str()), ("A", "V"));
    let effect = &model.effects[0].effect;
    assert_eq!(
        (effect.kind, effect.gains[0]),
        (Kind::DriveDeadzone, volts.value)
    );
}

/// The voltage is a remainder even if the library lacks its law.
#[test]
fn what_no_law_explains_of_a_voltage_is_a_remainder() {
    let made = made(Some(Effect::DriveDeadzone { voltage: 0.6 }), 5);
    let options = Options {
        without: vec![Kind::DriveDeadzone],
        ..Options::default()
    };
    let (found, _) = made.diagnosed(&made.robot, &options);
    assert!(found.steps.is_empty(), "{:?}", found.words);
    assert_eq!(found.verdict, Verdict::Remainder);
    let left = found.remainder.unwrap();
    println!("{}", left.text);
    assert_eq!(left.unit, "V");
    // Resistance and back-EMF have compensated some of it.
    assert!(
        (0.1..0.6).contains(&left.rms) && left.ratio > 3.0,
        "{left:?}"
    );
    assert_eq!(left.places[0].coordinate, "current of the motor");
}

#[test]
fn without_one_the_voltage_names_nothing_and_says_what_it_would_have_shown() {
    let made = made(None, 6);
    let (found, _) = made.diagnosed(&made.robot, &Options::default());
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.words);
    let size = found
        .detectable
        .iter()
        .find(|d| d.effect == "drive_deadzone");
    let size = size.unwrap();
    assert!(
        size.unit == "V" && size.size > 0.0 && size.size < 0.1,
        "{size:?}"
    );
    assert!(found.tried.iter().any(|t| t.effect == "drive_deadzone"));
}

#[test]
fn a_constant_of_the_sensor_is_told_from_one_of_the_torque() {
    let sensor = made(Some(Effect::CurrentOffset { current: 0.12 }), 7);
    let (found, _) = sensor.diagnosed(&sensor.robot, &Options::default());
    assert_eq!(found.steps.len(), 1, "{:?}", found.words);
    assert_eq!(found.steps[0].set, ["current_offset"]);
    let drive = sensor.robot.joints[0].drive.as_ref().unwrap();
    let truth = 0.12 * drive.gear_ratio * drive.torque_constant;
    let value = &found.steps[0].parameters["offset"];
    assert!(
        (value.value - truth).abs() < 4.0 * value.std + 0.03 * truth,
        "{value:?}, {truth}"
    );

    let torque = made(Some(Effect::TorqueOffset { torque: 0.3 }), 8);
    let (found, _) = torque.diagnosed(&torque.robot, &Options::default());
    let set = &found.steps[0].set;
    assert!(set.iter().any(|n| n == "torque_offset"), "{set:?}");
    assert!(set.iter().all(|n| n != "current_offset"), "{set:?}");
}

/// A clipping amplifier biases the voltage's sensor zero: a torque's constant was once taken for the sensor's.
#[test]
fn a_voltage_that_follows_no_winding_owns_no_constant() {
    let mut made = made(Some(Effect::TorqueOffset { torque: 0.3 }), 8);
    let (whole, _) = made.diagnosed(&made.robot, &Options::default());
    assert!(whole.remainder.is_none(), "{:?}", whole.words);
    for recording in [
        &mut made.train,
        made.repeat.as_mut().unwrap(),
        &mut made.holdout,
    ] {
        for block in &mut recording.blocks {
            for volts in block.joints[0].voltage.as_mut().unwrap() {
                *volts = volts.min(4.0);
            }
        }
    }
    let (clipped, _) = made.diagnosed(&made.robot, &Options::default());
    let left = clipped.remainder.unwrap();
    assert_eq!(left.unit, "V", "{}", left.text);
    let set = &clipped.steps[0].set;
    for name in ["torque_offset", "current_offset"] {
        assert!(set.iter().any(|n| n == name), "{set:?}");
    }
    assert!(!clipped.words.iter().any(|w| w.contains('Ω')));
}

/// Without the voltage, the three constants are collinear until the drive is recorded off.
#[test]
fn with_the_drive_off_a_sensor_s_constant_is_told_from_a_torque() {
    for (hidden, seed, sensor) in [
        (Effect::CurrentOffset { current: 0.12 }, 17, true),
        (Effect::TorqueOffset { torque: 0.3 }, 18, false),
    ] {
        let scenario = Scenario {
            seconds: [30.0, 15.0],
            ..Scenario::new(
                vec![Hidden {
                    joint: 0,
                    effect: hidden,
                }],
                seed,
            )
        };
        let mut made = scenario.make().unwrap();
        for recording in [
            &mut made.train,
            made.repeat.as_mut().unwrap(),
            &mut made.holdout,
        ] {
            for block in &mut recording.blocks {
                block.joints[0].voltage = None;
            }
        }
        let (before, _) = made.diagnosed(&made.robot, &Options::default());
        let set = &before.steps[0].set;
        assert!(set.iter().any(|n| n == "current_offset"), "{set:?}");
        assert!(set.iter().any(|n| n == "torque_offset"), "{set:?}");
        let next = before.next_experiment.unwrap();
        assert_eq!(
            (next.kind.to_string().as_str(), next.hands),
            ("drive-off-log", false)
        );
        let log = scenario.drive_off(&made).unwrap();
        let options = Options {
            sensor_zeros: sensor_zeros(&log).unwrap(),
            ..Options::default()
        };
        let (after, _) = made.diagnosed(&made.robot, &options);
        let set = &after.steps[0].set;
        if sensor {
            assert_eq!(set, &["current_offset"]);
        } else {
            assert!(set.iter().all(|n| n != "current_offset"), "{set:?}");
            assert!(set.iter().any(|n| n == "torque_offset"), "{set:?}");
        }
    }
}

/// The torque column alone would scale with the constant; the back-EMF does not.
#[test]
fn a_wrong_torque_constant_is_contradicted_by_the_back_emf() {
    let made = made(None, 9);
    let mut robot = made.robot.clone();
    let drive = robot.joints[0].drive.as_mut().unwrap();
    drive.pole_pairs = Some(0);
    let (right, _) = made.diagnosed(&robot, &Options::default());
    assert_eq!(right.verdict, Verdict::NothingMissing, "{:?}", right.words);
    let drive = robot.joints[0].drive.as_mut().unwrap();
    drive.torque_constant *= 1.2;
    let (wrong, _) = made.diagnosed(&robot, &Options::default());
    assert_eq!(wrong.verdict, Verdict::ParameterChange, "{:?}", wrong.words);
    let words = wrong.words.join(" ");
    assert!(
        words.contains("torque constant") && words.contains("0.83"),
        "{words}"
    );
}

#[test]
fn a_column_that_is_no_motor_voltage_says_nothing() {
    let mut made = made(None, 10);
    for recording in [
        &mut made.train,
        made.repeat.as_mut().unwrap(),
        &mut made.holdout,
    ] {
        for block in &mut recording.blocks {
            let volts = block.joints[0].voltage.as_mut().unwrap();
            volts.fill(24.0);
        }
    }
    let (found, _) = made.diagnosed(&made.robot, &Options::default());
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.words);
    let said = |w: &String| w.starts_with("Nothing is concluded from the motor voltage");
    assert!(found.words.iter().any(said), "{:?}", found.words);
}

/// With the drive off, the motor's voltage is its back-EMF, not the inverter's, and no current flows. A coasting joint
/// biases no result on the winding, and its friction shows as well.
#[test]
fn a_recording_in_which_the_drive_is_switched_off_is_one_to_learn_from() {
    let dead = Hidden {
        joint: 0,
        effect: Effect::DriveDeadzone { voltage: 0.6 },
    };
    let scenario = Scenario {
        seconds: [30.0, 15.0],
        ..Scenario::new(vec![dead], 5)
    };
    let mut made = scenario.make().unwrap();
    let volts = |made: &Made| {
        let (found, _) = made.diagnosed(&made.robot, &Options::default());
        let names: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
        assert_eq!(names, ["drive_deadzone"], "{:?}", found.words);
        assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.words);
        found.steps[0].parameters["volts"].value
    };
    let before = volts(&made);
    // A pass at constant speed from which it coasts, four times.
    let sweep = FrictionSweep::new(&[2.0], 1.2, 0.2, 0.2, 1.0).unwrap();
    let file = TrajectoryFile {
        robot: "r".into(),
        design: None,
        drive_off: Some(1.4),
        joints: vec![JointTrajectory {
            name: "link".into(),
            start: 0.0,
            trajectory: Trajectory::FrictionSweep(sweep),
        }],
    };
    let coasting = scenario.proposed(&made, &file).unwrap();
    let block = &coasting.blocks[0];
    let mode = &block.extra[0].1;
    let off = mode.iter().position(|m| *m != mode[0]).unwrap();
    let joint = &block.joints[0];
    let speed = (joint.q[off] - joint.q[off - 10]) / (block.t[off] - block.t[off - 10]);
    assert!((speed - 2.0).abs() < 0.3, "{speed}");
    // It moves on without a current.
    assert!(joint.q[off + 50] > joint.q[off] + 0.03);
    let largest = joint.tau[off + 20..]
        .iter()
        .fold(0.0, |m: f64, t| m.max(t.abs()));
    println!("coasts from {speed:.2} rad/s, up to {largest:.3} N*m read");
    assert!(
        largest
            < 0.2
                * joint.tau[..off]
                    .iter()
                    .fold(0.0, |m: f64, t| m.max(t.abs()))
    );
    made.further = vec![coasting];
    let after = volts(&made);
    println!("{before:.4} V, {after:.4} V with it");
    assert!((after / before - 1.0).abs() < 0.01, "{before} {after}");
    // Without its mode, it is a voltage that no winding has.
    made.further[0].blocks[0].extra.clear();
    let (deaf, _) = made.diagnosed(&made.robot, &Options::default());
    let told = deaf
        .steps
        .first()
        .map_or(0.0, |s| s.parameters["volts"].value);
    println!("{told:.4} V where the mode is not said");
}

/// A clamped shaft has no friction and no back-EMF: the torque staircase concerns voltage and current alone.
#[test]
fn a_clamped_shaft_shows_a_dead_zone() {
    let dead = Hidden {
        joint: 0,
        effect: Effect::DriveDeadzone { voltage: 0.3 },
    };
    let scenario = Scenario {
        seconds: [30.0, 15.0],
        ..Scenario::new(vec![dead], 5)
    };
    let made = scenario.make().unwrap();
    let rivals = [Kind::DriveDeadzone, Kind::Stribeck].map(|kind| {
        let nominal = [0.2, 0.0, 1.6, 0.3, 0.4, 0.0];
        (
            rig_shared::effects::Effect::new(kind, &[0.3], &[0.05]),
            nominal,
        )
    });
    let found = next(&made.robot, 0, &rivals, Held::default(), 0.05)
        .unwrap()
        .unwrap();
    assert_eq!(found.experiment.kind.to_string(), "locked-rotor-staircase");
    let sure = |options: &Options| {
        let (found, _) = made.diagnosed(&made.robot, options);
        let names: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
        assert_eq!(names, ["drive_deadzone"], "{:?}", found.data_faults);
        let volts = &found.steps[0].parameters["volts"];
        println!("{:.4} V ± {:.4}", volts.value, volts.std);
        assert!(
            (volts.value - 0.3).abs() < 3.0 * volts.std,
            "{}",
            volts.value
        );
        volts.value
    };
    let mut options = Options::default();
    let before = sure(&options);
    let next_file = found.trajectory.unwrap();
    let clamped = scenario.clamped(&made, &next_file).unwrap();
    let joint = &clamped.blocks[0].joints[0];
    let span = |values: &[f64]| {
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        high - values.iter().copied().fold(f64::INFINITY, f64::min)
    };
    assert_eq!(span(&joint.q), 0.0);
    println!("torques over {:.2} N*m", span(&joint.tau));
    assert!(span(&joint.tau) > 1.0);
    options.clamped = crate::clamped(&clamped).unwrap();
    let after = sure(&options);
    assert_ne!(after, before);
    // It counts: of another drive with four times the dead zone, it adds to the others' result.
    let other = Scenario {
        hidden: vec![Hidden {
            joint: 0,
            effect: Effect::DriveDeadzone { voltage: 1.2 },
        }],
        ..scenario
    };
    let worse = other.clamped(&made, &next_file).unwrap();
    options.clamped = crate::clamped(&worse).unwrap();
    let (mixed, _) = made.diagnosed(&made.robot, &options);
    let volts = (mixed.steps.first()).map_or(0.0, |step| step.parameters["volts"].value);
    println!("{volts:.4} V with that of another drive");
    assert!(volts > 1.1 * before);
}
