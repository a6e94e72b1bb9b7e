//! Ratio errors smaller than those of units, and changes of the robot that are no ratio.

use crate::faults::tests::*;
use rig_scenario::{Effect, Scenario};

/// Returns the training motion of a rig with these hidden effects, over a part of a turn.
fn runs(effects: Vec<Effect>) -> (Robot, Vec<Run>) {
    let made = Scenario::short(effects, 3).make().unwrap();
    let low_pass = LowPass::butterworth(4, 20.0, 1000.0).unwrap();
    let runs = runs_of(&made.train, 0, 1000.0, &low_pass).unwrap();
    (made.robot, runs)
}

#[test]
fn a_ratio_is_told_from_a_payload_and_from_friction() {
    let (robot, sound) = runs(Vec::new());
    assert_eq!(faults(&robot, &sound).unwrap(), []);
    for factor in [0.5, 2.0] {
        only(&robot, &q(&sound, 0, factor), "ratio", 0, "gear ratio");
        only(&robot, &tau(&sound, 0, factor), "ratio", 0, "alike");
        // A wrong described ratio also makes its reflected rotor wrong.
        let mut other = robot.clone();
        other.joints[0].drive.as_mut().unwrap().gear_ratio *= factor;
        let given = tau(&sound, 0, factor);
        only(&other, &given, "ratio", 0, "alike");
    }
    // A payload in a cold rig.
    let mut changed = robot.clone();
    let joint = &mut changed.joints[0];
    let inertial = joint.inertial.as_mut().unwrap();
    inertial.first_moment.iter_mut().for_each(|m| *m /= 1.65);
    inertial.inertia.iter_mut().for_each(|i| *i /= 1.45);
    let friction = joint.friction.as_mut().unwrap();
    friction.coulomb /= 1.65;
    friction.viscous /= 1.65;
    assert_eq!(faults(&changed, &sound).unwrap(), []);
    let mut heavier = robot.clone();
    let inertial = heavier.joints[0].inertial.as_mut().unwrap();
    inertial.first_moment.iter_mut().for_each(|m| *m *= 0.5);
    inertial.inertia.iter_mut().for_each(|i| *i *= 0.5);
    assert_eq!(faults(&heavier, &sound).unwrap(), []);
    let mut rougher = robot.clone();
    let friction = rougher.joints[0].friction.as_mut().unwrap();
    friction.coulomb *= 0.5;
    friction.viscous *= 0.5;
    assert_eq!(faults(&rougher, &sound).unwrap(), []);
    let spring = Effect::Spring {
        stiffness: 1.0,
        rest: 0.3,
    };
    let (robot, pulled) = runs(vec![spring]);
    assert_eq!(faults(&robot, &pulled).unwrap(), []);
}

/// Links and friction need not be described for this.
#[test]
fn a_rotor_that_outweighs_the_joint_is_a_wrong_ratio() {
    let (mut robot, sound) = runs(Vec::new());
    robot.joints[0].friction = None;
    robot.joints[0].inertial = None;
    assert_eq!(faults(&robot, &sound).unwrap(), []);
    robot.joints[0].drive.as_mut().unwrap().gear_ratio *= 10.0;
    let given = tau(&sound, 0, 10.0);
    // The rotor's inertia may be described wrong as well.
    open(&robot, &given, "ratio", 0, "the rotor of joint");
}

#[test]
fn a_start_and_then_rest_is_no_motion_to_learn_from() {
    let (_, sound) = runs(Vec::new());
    assert_eq!(too_short_to_learn(&sound), None);
    let stopped = injured(&sound, |run| {
        let held = run.joints[0].q_raw[3000];
        run.joints[0].q_raw[3000..].fill(held);
    });
    let fault = too_short_to_learn(&stopped).unwrap();
    println!("{}", fault.text);
    assert_eq!(fault.kind.as_str(), "not-moving");
    // Beside long recordings, a short one without external loads does not show their torque.
    let mut both = sound.clone();
    let mut free = sound[0].clone();
    free.t.truncate(2000);
    let joint = &mut free.joints[0];
    for column in [
        &mut joint.q_raw,
        &mut joint.q,
        &mut joint.qd,
        &mut joint.qdd,
    ] {
        column.truncate(2000);
    }
    free.unburdened = true;
    both.push(free);
    let fault = too_short_to_learn(&both).unwrap();
    assert_eq!(fault.kind.as_str(), "too-short");
    assert!(fault.text.contains("taken off"), "{}", fault.text);
}
