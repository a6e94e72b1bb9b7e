//! An arm whose gears have unlike ratios, by another arm than the described one.

use std::f64::consts::TAU;

use crate::faults::tests::transformed::rotated;
use crate::faults::tests::*;
use rig_excite::{SampledReference, StagedKind, StagedOptions, staged};

const DESCRIBED: &str = r#"
name = "geared arm"
gravity = [0.0, 0.0, -9.81]
[[joint]]
name = "waist"
kind = "revolute"
alpha = 0.0
a = 0.0
theta = 0.0
d = 0.3
inertial = { mass = 6.0, first_moment = [0.1, 0.0, 0.2], inertia = [0.2, 0.0, 0.0, 0.2, 0.0, 0.1] }
limits = { position = [-2.8, 2.8], velocity = 3.0, acceleration = 12.0, torque = 120.0 }
drive = { gear_ratio = 120.0, rotor_inertia = 2.0e-5, torque_constant = 0.08 }
[[joint]]
name = "upper"
kind = "revolute"
alpha = 1.5707963267948966
a = 0.1
theta = 0.0
d = 0.0
inertial = { mass = 5.0, first_moment = [1.0, 0.0, 0.1], inertia = [0.02, 0.0, 0.0, 0.3, 0.0, 0.3] }
limits = { position = [-2.0, 2.0], velocity = 3.0, acceleration = 12.0, torque = 120.0 }
drive = { gear_ratio = 100.0, rotor_inertia = 2.0e-5, torque_constant = 0.08 }
[[joint]]
name = "fore"
kind = "revolute"
alpha = 0.0
a = 0.4
theta = 0.0
d = 0.0
inertial = { mass = 2.5, first_moment = [0.35, 0.02, 0.0], inertia = [0.01, 0.0, 0.0, 0.08, 0.0, 0.08] }
limits = { position = [-2.4, 2.4], velocity = 4.0, acceleration = 20.0, torque = 60.0 }
drive = { gear_ratio = 60.0, rotor_inertia = 1.0e-5, torque_constant = 0.05 }
"#;

/// Returns the description, with or without the inertia of its rotors.
fn described(rotors: bool) -> Robot {
    let mut robot = text("geared.toml", DESCRIBED);
    if !rotors {
        for joint in &mut robot.joints {
            joint.drive.as_mut().unwrap().rotor_inertia = 0.0;
        }
    }
    robot
}

/// Returns the arm that moves: masses times `masses`, and friction.
fn real(masses: [f64; 3]) -> Robot {
    let mut robot = described(true);
    for (k, joint) in robot.joints.iter_mut().enumerate() {
        let [coulomb, viscous] = [[4.0, 6.0], [4.3, 7.9], [1.5, 1.0]][k];
        joint.friction = Some(rig_model::robot::JointFriction {
            coulomb,
            viscous,
            offset: 0.0,
        });
        let body = joint.inertial.as_mut().unwrap();
        body.mass *= masses[k];
        times(&mut body.first_moment, masses[k]);
        times(&mut body.inertia, masses[k]);
    }
    robot
}

/// Returns a recording of the real arm as one of `robot`.
fn recorded(robot: &Robot, real: &Robot, reference: &SampledReference, seed: u64) -> Vec<Run> {
    let folder = tempfile::tempdir().unwrap();
    let noise = rig_excite::Noise {
        position: 2e-5,
        velocity: 0.0,
        torque: 0.05,
    };
    let made = rig_excite::replay(real, reference, noise, seed, |_, _| ()).unwrap();
    let path = folder.path().join("arm.csv");
    made.save(&path, robot).unwrap();
    read(robot, &path, 0)
}

fn sines(robot: &Robot, seconds: f64, seed: u64) -> SampledReference {
    SampledReference::eased_sines(robot, [2e-3, seconds], (4, 0.25, 6.3), |j, h| {
        let turns = (seed + 3) as f64 * (7 * j + 3 * h as usize) as f64 * 0.137;
        TAU * turns.fract()
    })
}

/// Returns the staircase that `rig excite` designs for a joint.
fn staircase(robot: &Robot, joint: &str, rate: f64) -> SampledReference {
    let options = StagedOptions {
        joint: Some(joint.to_owned()),
        ..StagedOptions::default()
    };
    let (file, _) = staged(robot, StagedKind::Staircase, &options).unwrap();
    file.sampled(rate).unwrap()
}

/// Returns the texts of the certain faults.
fn certain(robot: &Robot, runs: &[Run]) -> Vec<String> {
    let found = faults(robot, runs).unwrap();
    for fault in &found {
        println!("{} {}", fault.certain, fault.text);
    }
    let certain = found.into_iter().filter(|fault| fault.certain);
    certain.map(|fault| fault.text).collect()
}

/// Asserts that the only certain fault has these words.
fn told(robot: &Robot, runs: &[Run], words: &str) {
    let texts = certain(robot, runs);
    assert!(
        texts.len() == 1 && texts[0].contains(words),
        "{words}: {texts:?}"
    );
}

#[test]
fn gears_forgotten_or_counted_twice_at_all_joints_are_one_fault() {
    let (robot, real) = (described(true), real([1.0, 1.0, 0.92]));
    let runs = recorded(&robot, &real, &sines(&robot, 20.0, 1), 1);
    assert_eq!(certain(&robot, &runs), [""; 0]);
    let scaled = |torque: bool, power: i32| {
        injured(&runs, |run| {
            for (joint, described) in run.joints.iter_mut().zip(&robot.joints) {
                let factor = described.gear_ratio().powi(power);
                times(
                    if torque {
                        &mut joint.tau
                    } else {
                        &mut joint.q_raw
                    },
                    factor,
                );
                joint.reference = None;
            }
        })
    };
    let ratios = "(120, 100 and 60";
    told(
        &robot,
        &scaled(true, -1),
        &format!("those of the motors, before their gears {ratios} to 1)"),
    );
    told(
        &robot,
        &scaled(true, 1),
        &format!("The gear ratios {ratios}) have been applied twice"),
    );
    told(
        &robot,
        &scaled(false, 1),
        &format!("The positions are those of the motors {ratios}"),
    );
}

#[test]
fn columns_in_cyclic_order_are_put_in_order_whatever_the_ratios() {
    let (robot, real) = (described(true), real([1.0, 1.0, 0.92]));
    let runs = recorded(&robot, &real, &sines(&robot, 20.0, 2), 2);
    for (positions, torques, words) in [
        (true, false, "stands in q3, q1 and q2"),
        (false, true, "stands in tau3, tau1 and tau2"),
        (true, true, "stands in the columns of joints 3, 1 and 2"),
    ] {
        told(&robot, &rotated(&runs, positions, torques), words);
    }
}

/// A free inertia of the drive explains most of a factor of the position at its own joint, but not at the others.
#[test]
fn a_position_s_factor_is_found_beside_a_rotor_that_is_not_described() {
    let (robot, real) = (described(false), real([1.0, 1.0, 0.92]));
    let runs = recorded(&robot, &real, &sines(&robot, 20.0, 3), 3);
    assert_eq!(certain(&robot, &runs), [""; 0]);
    for (j, factor, words) in [
        (0, 0.5, "q1 fits its torque 2 times"),
        (0, 1.0 / TAU, "q1 fits its torque 6.283 times"),
        (1, 0.5, "q2 fits its torque 2 times"),
        (1, 1.0 / TAU, "q2 fits its torque 6.283 times"),
        (1, 2.0, "q2 fits its torque 0.5 times"),
        (2, 1.0 / TAU, "q3 fits its torque 6.283 times"),
    ] {
        told(&robot, &q(&runs, j, factor), words);
    }
    // The rotor explains half the position of the last joint nearly as well.
    assert_eq!(certain(&robot, &q(&runs, 2, 0.5)), [""; 0]);
}

/// At rest friction lies anywhere between its limits, which a delay of the torque seems to explain.
#[test]
fn a_sound_staircase_raises_nothing_and_a_late_torque_on_it_is_named() {
    let real = real([1.0, 1.0, 0.92]);
    let robot = real.clone();
    for (joint, rate, seed) in [("fore", 500.0, 1), ("fore", 200.0, 2), ("fore", 500.0, 3)] {
        let runs = recorded(&robot, &real, &staircase(&robot, joint, rate), seed);
        assert_eq!(faults(&robot, &runs).unwrap(), [], "{joint}");
        let late = injured(&runs, |run| {
            let by = (0.2 * run.rate) as usize;
            for joint in &mut run.joints {
                joint.tau.rotate_right(by);
            }
        });
        let found = faults(&robot, &late).unwrap();
        let words = "is 0.20 s behind";
        assert!(found.iter().any(|f| f.text.contains(words)), "{found:?}");
    }
}

/// Masses within the uncertainty of a description, with and without rotors.
#[test]
fn a_rough_description_is_no_fault() {
    for seed in 0..12_u64 {
        let turn = |k: u64| ((7 * seed + 3 * k + 1) as f64 * 0.618_034).fract();
        let masses = [0, 1, 2].map(|k| 0.7 + 0.7 * turn(k));
        let robot = described(seed % 2 == 0);
        let runs = recorded(&robot, &real(masses), &sines(&robot, 15.0, seed), seed);
        assert_eq!(certain(&robot, &runs), [""; 0], "{masses:?}");
    }
}

/// A delay that lies between two rows of the search is named too.
#[test]
fn a_late_column_is_named_whatever_its_delay() {
    let (robot, real) = (described(true), real([1.0, 1.0, 0.92]));
    let mut unnamed = Vec::new();
    for seed in [4, 5] {
        let runs = recorded(&robot, &real, &sines(&robot, 20.0, seed), seed);
        for (torque, j) in [(true, 1), (true, 2), (false, 0), (false, 1), (false, 2)] {
            for delay in [0.15, 0.3] {
                let late = injured(&runs, |run| {
                    let by = (delay * run.rate).round() as usize;
                    let joint = &mut run.joints[j];
                    let column = if torque {
                        &mut joint.tau
                    } else {
                        &mut joint.q_raw
                    };
                    column.rotate_right(by);
                    let first = column[by];
                    column[..by].fill(first);
                    joint.reference = None;
                    joint.measured_velocity = None;
                });
                let found = faults(&robot, &late).unwrap();
                let words = format!("tau{} is", j + 1);
                let named = |f: &DataFault| f.kind == FaultKind::Clock && f.text.contains(&words);
                if !found.iter().any(named) {
                    unnamed.push((seed, torque, j + 1, delay));
                }
            }
        }
    }
    assert_eq!(unnamed, []);
}

/// In a wrist whose drives are coupled a factor of one position, one of its neighbour and a delay explain nearly the
/// same. The true factor is named first or as equal, and the delay is not.
#[test]
fn a_factor_in_a_coupled_wrist_is_compared_with_what_looks_like_it() {
    let mut robot = text("tx40.toml", TX40);
    let mut real = robot.clone();
    for (k, joint) in real.joints.iter_mut().enumerate() {
        let factor = [1.1, 0.8, 1.25, 0.9, 1.2, 0.85][k];
        let body = joint.inertial.as_mut().unwrap();
        body.mass *= factor;
        times(&mut body.first_moment, factor);
        times(&mut body.inertia, factor);
    }
    for joint in &mut robot.joints {
        joint.friction = None;
    }
    for (seed, j, factor) in [
        (2, 4, 2.0),
        (2, 4, 0.5),
        (2, 5, 2.0),
        (3, 5, 2.0),
        (3, 5, 0.5),
    ] {
        let runs = recorded(&robot, &real, &sines(&robot, 20.0, seed), seed);
        assert_eq!(certain(&robot, &runs), [""; 0], "{seed}");
        let texts = certain(&robot, &q(&runs, j, factor));
        let words = format!("q{} fits its torque {} times", j + 1, 1.0 / factor);
        assert!(
            texts.iter().any(|text| text.contains(&words)),
            "{seed} {words}: {texts:?}"
        );
        assert!(
            !texts.iter().any(|text| text.starts_with("tau")),
            "{seed} {words}: {texts:?}"
        );
    }
}

/// Gravity and inertia of a joint that agree show a factor of its torque, however small they are beside friction.
#[test]
fn a_factor_of_one_torque_is_told_with_its_name() {
    let (robot, real) = (described(true), real([1.0, 1.0, 0.92]));
    let runs = recorded(&robot, &real, &sines(&robot, 20.0, 6), 6);
    assert_eq!(certain(&robot, &runs), [""; 0]);
    for (j, factor, words) in [
        (0, 1.0 / 120.0, "before its gear (120 to 1)"),
        (1, 1.0 / 100.0, "before its gear (100 to 1)"),
        (2, 1.0 / 60.0, "before its gear (60 to 1)"),
        (
            0,
            120.0,
            "as if the gear ratio (120) had been applied twice",
        ),
        (2, 60.0, "as if the gear ratio (60) had been applied twice"),
        (2, 30.0 / TAU / 60.0, "tau3 is 0.0"),
        (2, 9.55, "as a motor constant per rpm"),
    ] {
        let scaled = injured(&runs, |run| times(&mut run.joints[j].tau, factor));
        told(&robot, &scaled, words);
    }
}
