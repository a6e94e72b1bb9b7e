//! Gears of the emulated rig with a noisy link encoder with counts: impacts, friction of the link and a finer step than
//! the laws have.

#![allow(clippy::unwrap_used)]

use crate::tests::made::Diagnosed as _;
use rig_shared::effects::{Effect as Law, Kind};

use crate::Options;
use crate::outcome::{Diagnosis, Fate, Step, Verdict};
use rig_model::robot::{Robot, RobotEffect};
use rig_scenario::{Effect, Hidden, Made, Scenario};

const SOFT: Effect = Effect::JointElasticity {
    stiffness: 600.0,
    damping: 0.3,
};

fn made(hidden: &[Effect], seed: u64) -> Made {
    let hidden = (hidden.iter()).map(|effect| Hidden {
        joint: 0,
        effect: *effect,
    });
    Scenario {
        seconds: [30.0, 15.0],
        substeps: Some(10),
        second_encoder: true,
        ..Scenario::new(hidden.collect(), seed)
    }
    .make()
    .unwrap()
}

fn names(found: &Diagnosis) -> Vec<&str> {
    found.steps.iter().map(|s| s.effect.as_str()).collect()
}

/// Returns a parameter's relative error, and true if its 95 % interval contains the truth.
fn off(step: &Step, parameter: &str, truth: f64) -> (f64, bool) {
    let value = &step.parameters[parameter];
    println!("{parameter}: {} ± {}, {truth}", value.value, value.std);
    let off = (value.value - truth).abs();
    (off / truth, off <= 1.96 * value.std)
}

#[test]
fn a_gear_that_gives_is_measured() {
    let (stiffness, seed) = (400.0, 21);
    let soft = Effect::JointElasticity {
        stiffness,
        damping: 0.3,
    };
    let made = made(&[soft], seed);
    let (found, model) = made.diagnosed(&made.robot, &Options::default());
    println!("{:#?}", found.words);
    assert_eq!(names(&found), ["joint_elasticity"], "{:?}", found.words);
    let step = &found.steps[0];
    assert_eq!(step.set, ["joint_elasticity"]);
    let (error, _) = off(step, "stiffness", stiffness);
    assert!(error < 0.03, "{stiffness}: {error}");
    assert!(step.gap_closed > 0.7, "{}", step.gap_closed);
    let map = found
        .maps
        .iter()
        .find(|m| m.step == Some(0) && m.residual_unit == "rad");
    assert_eq!(map.unwrap().coordinate, "torque on the gear");
    let effect = &model.effects[0].effect;
    assert_eq!(effect.kind, Kind::JointElasticity);
    assert_eq!(effect.shapes[0], step.parameters["stiffness"].value);
    assert!(model.effects.len() == 1);
}

#[test]
fn play_is_measured_and_is_no_presliding() {
    let (degrees, seed) = (0.2f64, 23);
    let gap = degrees.to_radians();
    let made = made(&[Effect::Backlash { gap }], seed);
    let (found, _) = made.diagnosed(&made.robot, &Options::default());
    println!("{:#?}", found.words);
    assert_eq!(names(&found), ["backlash"], "{:?}", found.words);
    let step = &found.steps[0];
    assert_eq!(step.set, ["backlash"]);
    let (error, _) = off(step, "gap", gap);
    assert!(error < 0.05, "{degrees}: {error}");
    assert!(step.gap_closed > 0.6, "{}", step.gap_closed);
}

#[test]
fn friction_before_the_gear_leaves_the_encoders_together() {
    let made = made(&[Effect::Presliding { stroke: 0.015 }], 25);
    let (found, _) = made.diagnosed(&made.robot, &Options::default());
    println!("{:#?}", found.words);
    assert_eq!(names(&found), ["presliding"], "{:?}", found.words);
    assert_eq!(found.steps[0].set, ["presliding"]);
    let gear = |name: &str| ["backlash", "joint_elasticity"].contains(&name);
    assert!(found.not_testable.iter().all(|n| !gear(&n.effect)));
    assert!(!found.steps[0].runner_up.as_deref().is_some_and(gear));
}

#[test]
fn with_nothing_hidden_it_says_what_it_would_have_shown() {
    let made = made(&[], 26);
    let (found, model) = made.diagnosed(&made.robot, &Options::default());
    println!("{:#?}", found.words);
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.words);
    assert!(found.steps.is_empty() && model.effects.is_empty());
    let size = |name: &str| {
        let of = found.detectable.iter().find(|d| d.effect == name);
        of.map(|d| d.size).unwrap()
    };
    // About one count, 0.05 mrad; 3 N·m on the gear.
    assert!(size("backlash") < 2e-4, "{}", size("backlash"));
    assert!(
        size("joint_elasticity") > 2e4,
        "{}",
        size("joint_elasticity")
    );
}

/// A recording without a link encoder is used for all else; its gear moves by the law.
#[test]
fn a_recording_without_it_stands_beside_one_with_it() {
    let mut made = made(&[SOFT], 28);
    for recording in [made.repeat.as_mut().unwrap(), &mut made.holdout] {
        for block in &mut recording.blocks {
            block.joints[0].link = None;
        }
    }
    let (found, _) = made.diagnosed(&made.robot, &Options::default());
    println!("{:#?}", found.words);
    assert_eq!(names(&found), ["joint_elasticity"], "{:?}", found.words);
    let (error, holds) = off(&found.steps[0], "stiffness", 600.0);
    assert!(error < 0.03 && holds, "{error}");
}

/// A described gear is refitted or contradicted.
#[test]
fn a_described_gear_is_fitted_again_or_goes() {
    let described = |made: &Made| Robot {
        effects: vec![RobotEffect {
            joint: None,
            other: None,
            effect: Law::new(Kind::JointElasticity, &[], &[900.0, 0.5, 0.2]),
        }],
        ..made.robot.clone()
    };
    let softer = made(&[SOFT], 29);
    let (found, model) = softer.diagnosed(&described(&softer), &Options::default());
    assert!(found.steps.is_empty(), "{:?}", names(&found));
    assert_eq!(found.described[0].fate, Fate::FittedAgain);
    let value = &found.described[0].parameters["stiffness"];
    assert!((value.value - 600.0).abs() < 0.03 * 600.0, "{value:?}");
    assert_eq!(model.effects.len(), 1);
    assert_eq!(model.effects[0].effect.shapes[0], value.value);

    let rigid = made(&[], 30);
    let (found, model) = rigid.diagnosed(&described(&rigid), &Options::default());
    assert_eq!(found.described[0].fate, Fate::Dropped, "{:?}", found.words);
    assert!(model.effects.is_empty());
}
