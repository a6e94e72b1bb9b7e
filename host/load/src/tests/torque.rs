//! The load by joint torques: with and without it, and together with the sensor.

use super::made::{Moving, Points, Sensor, parameters, recorded, tool};
use crate::{By, KnownMass, LoadOptions, identify_load};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rig_data::prepare::InMemory;
use rig_model::robot::{Drive, JointFriction, Robot, TX40};

/// The bare arm: a hand with friction in each joint, all of it points on the last link and friction of the joints.
fn hand() -> Points {
    vec![
        (1.2, [0.03, 0.0, 0.02]),
        (0.8, [-0.02, 0.04, 0.01]),
        (0.9, [0.0, -0.03, 0.06]),
    ]
}

fn arm() -> Robot {
    bare(Robot::from_toml(TX40, "tx40.toml".as_ref()).unwrap())
}

/// An arm with two axes that follow joints, one of them a slide.
fn geared() -> Robot {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/mimic/robot.urdf");
    let mut robot = bare(Robot::load(path.as_ref()).unwrap());
    for joint in &mut robot.joints {
        joint.limits.as_mut().unwrap().velocity = 3.0;
    }
    assert!(!robot.followers.is_empty());
    robot
}

fn bare(mut robot: Robot) -> Robot {
    for own in &mut robot.followers {
        own.inertial = None;
    }
    for joint in &mut robot.joints {
        joint.drive = None;
        joint.inertial = None;
        joint.friction = None;
        if let Some(limits) = &mut joint.limits {
            limits.torque = None;
        }
    }
    robot
}

/// Adds torques by virtual work, with Coulomb and viscous friction and noise.
fn driven(moving: &Moving, points: &Points, rubs: f64, seed: u64) -> InMemory {
    rubbing(moving, points, rubs, &[0.0; 6], seed)
}

/// The same, with friction of each joint that grows with the torque that it carries.
fn rubbing(moving: &Moving, points: &Points, rubs: f64, grows: &[f64; 6], seed: u64) -> InMemory {
    let sensor = Sensor::default();
    let mut recording = recorded(moving, points, &sensor, [30.0, 100.0], seed, &|_, r| r);
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed + 100);
    let block = &mut recording.blocks[0];
    for k in 0..block.t.len() {
        let t = block.t[k];
        let torques = moving.torques(points, t);
        let [before, after] = [-1e-3, 1e-3].map(|by| moving.position(t + by));
        for (j, torque) in torques.iter().enumerate() {
            let velocity = (after[j] - before[j]) / 2e-3;
            let dry = rubs + grows[j] * torque.abs();
            let friction = dry * velocity.signum() + 0.3 * velocity + 0.1;
            let noise: f64 = StandardNormal.sample(&mut random);
            block.joints[j].tau.push(torque + friction + 0.02 * noise);
        }
    }
    recording
}

/// Records a motion with the tool in the hand, and without it. The gears rub more under load.
fn with_and_without_tool(moving: &Moving) -> [InMemory; 2] {
    let both: Points = hand().into_iter().chain(tool()).collect();
    [
        driven(moving, &both, 0.9, 2),
        driven(moving, &hand(), 0.8, 1),
    ]
}

#[test]
fn load_is_what_the_torques_with_it_show_beyond_those_without_it() {
    let moving = Moving::new(arm(), 0.7, 21);
    let part = tool();
    let [with, without] = with_and_without_tool(&moving);
    let options = LoadOptions {
        by: By::Torque,
        ..LoadOptions::default()
    };
    let found = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
    let truth = parameters(&part);
    for (parameter, truth) in found.parameters.iter().zip(truth) {
        let off = (parameter.value.value - truth) / parameter.value.std;
        assert!(off.abs() < 4.0, "{parameter:?}, truth {truth}");
    }
    assert!(
        (found.mass.value / truth[0] - 1.0).abs() < 0.03,
        "{:?}",
        found.mass
    );
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    // With the sensor the torques do not contradict, and the result is at least as exact.
    let options = LoadOptions {
        by: By::Both,
        ..LoadOptions::default()
    };
    let fused = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
    let agreement = fused.agreement.as_ref().unwrap();
    assert!(
        agreement.chance > 1e-3 && agreement.directions >= 4,
        "{agreement:?}"
    );
    assert!(fused.mass.std <= agreement.by_sensor_std[0]);
    assert!(fused.mass.std <= agreement.by_torque_std[0]);
    assert!((fused.mass.value / truth[0] - 1.0).abs() < 0.01);
    // Weighed wrong: both say so.
    let options = LoadOptions {
        known_mass: Some(KnownMass {
            mass: truth[0] / 1.3,
            std: 0.002,
        }),
        ..options
    };
    let found = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
    let [said] = &found.warnings[..] else {
        panic!("{:?}", found.warnings);
    };
    assert!(said.contains("the known mass looks wrong"), "{said}");
}

/// One drive turns several axes: its torque carries the load by all of them.
#[test]
fn a_load_beyond_axes_that_follow_joints_is_found() {
    let moving = Moving::new(geared(), 0.5, 21);
    let part = tool();
    let [with, without] = with_and_without_tool(&moving);
    let options = LoadOptions {
        by: By::Both,
        ..LoadOptions::default()
    };
    let found = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
    let truth = parameters(&part);
    let agreement = found.agreement.as_ref().unwrap();
    assert!(
        agreement.chance > 1e-3 && agreement.directions >= 4,
        "{agreement:?}"
    );
    for (k, truth) in truth.iter().enumerate() {
        for (value, std) in [
            (agreement.by_sensor[k], agreement.by_sensor_std[k]),
            (agreement.by_torque[k], agreement.by_torque_std[k]),
        ] {
            assert!(
                (value - truth).abs() < 4.0 * std,
                "{k}: {value} ± {std}, truth {truth}"
            );
        }
    }
    assert!((found.mass.value / truth[0] - 1.0).abs() < 0.01);
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

/// The description gives the torque of the unloaded arm; the position is noisy, and heavy rotors multiply its noise.
#[test]
fn load_is_found_against_a_description_that_was_identified() {
    let mut robot = arm();
    for joint in &mut robot.joints {
        joint.friction = Some(JointFriction {
            coulomb: 0.8,
            viscous: 0.3,
            offset: 0.1,
        });
        joint.drive = Some(Drive {
            gear_ratio: 100.0,
            rotor_inertia: 2e-4,
            ..Drive::default()
        });
    }
    let hand = rig_model::robot::Load::of(parameters(&hand()));
    let robot = robot.with_load(&hand);
    let moving = Moving::new(robot, 0.7, 23);
    let part = tool();
    let both: Points = super::torque::hand()
        .into_iter()
        .chain(part.iter().copied())
        .collect();
    let mut with = driven(&moving, &both, 0.8, 4);
    let block = &mut with.blocks[0];
    let mut random = rand_pcg::Pcg64::seed_from_u64(9);
    for (k, t) in block.t.iter().enumerate() {
        let [before, here, after] = [-1e-3, 0.0, 1e-3].map(|by| moving.position(t + by));
        for (j, joint) in block.joints.iter_mut().enumerate() {
            // The rotor: ratio² · inertia · acceleration.
            joint.tau[k] += 2.0 * (before[j] - 2.0 * here[j] + after[j]) / 1e-6;
            let noise: f64 = StandardNormal.sample(&mut random);
            joint.q[k] += 1e-4 * noise;
        }
    }
    let options = LoadOptions {
        by: By::Torque,
        ..LoadOptions::default()
    };
    let found = identify_load(&moving.robot, &[&with], &[], &options).unwrap();
    let truth = parameters(&part);
    for (parameter, truth) in found.parameters.iter().zip(truth).filter(|(p, _)| p.shown) {
        let off = (parameter.value.value - truth) / parameter.value.std;
        assert!(off.abs() < 4.0, "{parameter:?}, truth {truth}");
    }
    assert!(
        (found.mass.value / truth[0] - 1.0).abs() < 0.05,
        "{:?}",
        found.mass
    );
}

#[test]
fn a_torque_scale_that_is_wrong_contradicts_the_sensor() {
    let moving = Moving::new(arm(), 0.7, 22);
    let part = tool();
    let both: Points = hand().into_iter().chain(part.iter().copied()).collect();
    let scaled = |mut recording: InMemory| {
        for joint in &mut recording.blocks[0].joints {
            joint.tau.iter_mut().for_each(|tau| *tau *= 1.3);
        }
        recording
    };
    let without = scaled(driven(&moving, &hand(), 0.8, 1));
    let with = scaled(driven(&moving, &both, 0.8, 2));
    let options = LoadOptions {
        by: By::Both,
        ..LoadOptions::default()
    };
    let found = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
    assert!(
        found.warnings.iter().any(|w| w.contains("contradict")),
        "{:?}",
        found.warnings
    );
}

/// Friction that grows with the load is not that of a larger mass: it is estimated where it is, and nowhere else.
#[test]
fn friction_that_grows_with_the_load_is_named_by_its_joint() {
    let moving = Moving::new(arm(), 0.7, 21);
    let part = tool();
    let both: Points = hand().into_iter().chain(part.iter().copied()).collect();
    let truth = parameters(&part);
    let options = LoadOptions {
        by: By::Torque,
        ..LoadOptions::default()
    };
    for grows in [[0.0; 6], [0.1; 6], [0.0, 0.0, 0.12, 0.0, 0.0, 0.0]] {
        let without = rubbing(&moving, &hand(), 0.8, &grows, 1);
        let with = rubbing(&moving, &both, 0.8, &grows, 2);
        let found = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
        let torque = found.torque.as_ref().unwrap();
        let said = found.warnings.join(" ");
        assert_eq!(said.contains("Friction grows"), grows[2] > 0.0, "{said}");
        for own in &torque.load_friction {
            let off = (own.coefficient - grows[own.joint]) / own.std;
            assert!(off.abs() < 4.0 && grows[own.joint] > 0.0, "{own:?}");
        }
        let named = torque.load_friction.iter().any(|own| own.joint == 2);
        assert_eq!(named, grows[2] > 0.0);
        let off = (found.mass.value - truth[0]) / found.mass.std;
        assert!(off.abs() < 4.0, "{:?}, truth {}", found.mass, truth[0]);
    }
}

/// What neither load nor friction explains is told with its joint, because the mass may be wrong by more than its standard
/// deviation then.
#[test]
fn a_residual_of_the_torques_above_their_noise_is_told_with_its_joint() {
    let moving = Moving::new(arm(), 0.7, 21);
    let part = tool();
    let both: Points = hand().into_iter().chain(part.iter().copied()).collect();
    let without = driven(&moving, &hand(), 0.8, 1);
    let mut with = driven(&moving, &both, 0.8, 2);
    // A hose pulls at the third joint.
    let block = &mut with.blocks[0];
    for (k, t) in block.t.iter().enumerate() {
        block.joints[2].tau[k] += 0.3 * (3.0 * moving.position(*t)[2]).sin();
    }
    let options = LoadOptions {
        by: By::Torque,
        ..LoadOptions::default()
    };
    let found = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
    let name = &moving.robot.joints[2].name;
    let said = found.warnings.join(" ");
    assert!(
        said.contains(&format!("RMS of {name}, where noise")),
        "{said}"
    );
    let others = moving
        .robot
        .joints
        .iter()
        .filter(|joint| joint.name != *name);
    for joint in others {
        assert!(!said.contains(&format!("RMS of {},", joint.name)), "{said}");
    }
}

/// Torque constants that are 12 % off make a load that is 12 % too heavy and fits as well: a weighed load tells it.
#[test]
fn a_known_mass_tells_a_torque_scale() {
    let moving = Moving::new(arm(), 0.7, 21);
    let part = tool();
    let both: Points = hand().into_iter().chain(part.iter().copied()).collect();
    let truth = parameters(&part)[0];
    let options = LoadOptions {
        by: By::Torque,
        known_mass: Some(KnownMass {
            mass: truth,
            std: 0.002,
        }),
        ..LoadOptions::default()
    };
    let [without, with] = [(hand(), 1), (both, 2)].map(|(points, seed)| {
        let right = driven(&moving, &points, 0.8, seed);
        let mut wrong = right.clone();
        for joint in &mut wrong.blocks[0].joints {
            joint.tau.iter_mut().for_each(|tau| *tau *= 1.12);
        }
        [right, wrong]
    });
    let found = identify_load(&moving.robot, &[&with[0]], &[&without[0]], &options).unwrap();
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    let found = identify_load(&moving.robot, &[&with[1]], &[&without[1]], &options).unwrap();
    let check = found.mass_checks[0];
    assert!(
        (check.factor - 1.12).abs() < 3.0 * check.std && check.std < 0.03,
        "{check:?}"
    );
    assert!(
        (found.warnings.iter()).any(|w| w.contains("the torque constants of the joints")),
        "{:?}",
        found.warnings
    );
}

/// A drive that saturates: the rows at its limit are left out and counted, and a joint that loses most of them is refused.
#[test]
fn torques_that_saturate_are_left_out_and_counted() {
    let moving = Moving::new(arm(), 0.7, 21);
    let part = tool();
    let truth = parameters(&part)[0];
    let both: Points = hand().into_iter().chain(part).collect();
    let without = driven(&moving, &hand(), 0.8, 1);
    let with = driven(&moving, &both, 0.9, 2);
    let options = LoadOptions {
        by: By::Torque,
        ..LoadOptions::default()
    };
    let mut sorted = with.blocks[0].joints[1].tau.clone();
    sorted.sort_by(f64::total_cmp);
    for share in [0.2, 0.35] {
        let rows = sorted.len();
        let [low, high] = [share, 1.0 - share].map(|own| sorted[(own * rows as f64) as usize]);
        let mut cut = with.clone();
        let torques = cut.blocks[0].joints[1].tau.iter_mut();
        torques.for_each(|tau| *tau = tau.clamp(low, high));
        let found = identify_load(&moving.robot, &[&cut], &[&without], &options);
        let name = &moving.robot.joints[1].name;
        let words = format!("the torque of {name} saturates (");
        match found {
            Ok(found) => {
                let said = found
                    .warnings
                    .iter()
                    .find(|own| own.contains(&words))
                    .unwrap();
                println!("{said} {:?}", found.mass);
                assert!(share < 0.25 && said.contains("were left out"), "{said}");
                let off = (found.mass.value - truth) / found.mass.std;
                assert!(off.abs() < 4.5, "{:?}", found.mass);
            }
            Err(error) => {
                let text = error.to_string();
                assert!(share > 0.25 && text.contains(&words), "{text}");
            }
        }
    }
}

/// A horizontal arm of two upright axes neither lifts its load nor tilts it, whatever its motion is.
#[test]
fn what_no_motion_of_a_planar_arm_shows_is_said() {
    let text = rig_model::robot::EDDA_TEMPLATE.to_owned();
    let mut robot = Robot::from_toml(&text, "edda.toml".as_ref()).unwrap();
    for joint in &mut robot.joints {
        joint.drive = None;
        joint.inertial = None;
        joint.friction = None;
    }
    let moving = Moving::new(robot, 0.7, 31);
    let part = tool();
    let without = driven(&moving, &Points::new(), 0.8, 1);
    let with = driven(&moving, &part, 0.8, 2);
    let options = LoadOptions {
        by: By::Torque,
        ..LoadOptions::default()
    };
    let found = identify_load(&moving.robot, &[&with], &[&without], &options).unwrap();
    let never = found.not_shown.last().unwrap();
    // The weight and what tilting it would take act along the axes' bearings only.
    assert_eq!(never.parameters, ["mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz"]);
    assert!(
        never
            .experiment
            .starts_with("No motion of this robot shows them"),
        "{}",
        never.experiment
    );
    assert_eq!(found.not_shown.len(), 1, "{:?}", found.not_shown);
    let truth = parameters(&part);
    assert!(
        (found.mass.value / truth[0] - 1.0).abs() < 0.03,
        "{:?}",
        found.mass
    );
    assert!(crate::controller_numbers(&found).is_none());
    let text = crate::incomplete_numbers(&found).unwrap();
    assert!(
        text.starts_with("incomplete for a controller: mass 2.")
            && text.contains("centre of mass x 0.0")
            && text
                .ends_with("the data do not show z of the centre of mass, so set it by a drawing"),
        "{text}"
    );
}
