//! A description with effects is where the next diagnosis begins.

#![allow(clippy::unwrap_used)]

use crate::tests::made::Diagnosed as _;
use std::path::Path;

use crate::description::described_effects::*;
use crate::outcome::Verdict;
use crate::{Diagnosis, Options};
use rig_scenario::{self, Hidden, Made, Scenario};

/// Gears take most of a search and are not what is asked here.
fn without_gears() -> Vec<Kind> {
    vec![Kind::Backlash, Kind::JointElasticity]
}

/// The rig of a seed; another length is another motion with other noise.
fn recorded(hidden: &[rig_scenario::Effect], seed: u64, seconds: f64) -> Made {
    let hidden = hidden.iter().map(|&effect| Hidden { joint: 0, effect });
    Scenario {
        seconds: [seconds, 20.0],
        ..Scenario::new(hidden.collect(), seed)
    }
    .make()
    .unwrap()
}

fn diagnosed(robot: &Robot, made: &Made, without: Vec<Kind>) -> (Diagnosis, Robot) {
    let options = Options {
        without,
        ..Options::default()
    };
    let (diagnosis, model) = made.diagnosed(robot, &options);
    // As it is read from the file.
    let read = Robot::from_toml(&model.to_toml().unwrap(), Path::new("model.toml")).unwrap();
    assert_eq!(read, model);
    (diagnosis, read)
}

const WAVE: rig_scenario::Effect = rig_scenario::Effect::GearEccentricity {
    amplitude: 0.25,
    phase: 1.0,
};

fn wave(cosine: f64) -> RobotEffect {
    RobotEffect {
        joint: Some("link".into()),
        other: None,
        effect: Effect::new(Kind::Cogging, &[cosine, 0.0], &[9.0]),
    }
}

fn described(robot: &Robot, effect: RobotEffect) -> Robot {
    let effect = RobotEffect {
        joint: Some(robot.joints[0].name.clone()),
        ..effect
    };
    Robot {
        effects: vec![effect],
        ..robot.clone()
    }
}

#[test]
fn what_changed_of_an_effect_is_told_with_both_values() {
    let value = |value: f64, std: f64, unit: &str| Value {
        value,
        std,
        unit: unit.into(),
    };
    let now = |order: f64, cosine: f64| Now {
        kind: Kind::Cogging,
        parameters: [
            ("order", value(order, 0.0, "1")),
            ("cosine", value(cosine, 0.01, "N*m")),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into(),
    };
    let told = |now: &Now| changed_values(&wave(0.2), now, JointKind::Revolute);
    assert_eq!(told(&now(9.0, 0.21)), []);
    let parameter = |name, stated, unit: &str| StatedParameter {
        name,
        stated,
        unit: unit.into(),
    };
    assert_eq!(
        told(&now(12.0, 0.3)),
        [
            (parameter("cosine", 0.2, "N*m"), 0.3),
            (parameter("order", 9.0, "1"), 12.0)
        ]
    );
}

#[test]
fn an_effect_that_was_found_is_begun_with_and_written_once() {
    let first = recorded(&[WAVE], 3, 40.0);
    let (before, model) = diagnosed(&first.robot, &first, without_gears());
    let names: Vec<&str> = before.steps.iter().map(|s| s.effect.as_str()).collect();
    assert_eq!(names, ["gear_eccentricity"]);
    assert!(before.described.is_empty());
    let again = recorded(&[WAVE], 3, 34.0);
    let (after, next) = diagnosed(&model, &again, without_gears());
    assert_eq!(after.verdict, Verdict::NothingMissing, "{:?}", after.words);
    assert!(after.steps.is_empty());
    assert_eq!(after.described.len(), 1);
    assert_eq!(after.described[0].fate, Fate::FittedAgain);
    assert!(after.words.contains(&after.described[0].text));
    assert_eq!(next.effects.len(), 1);
    let kinds = [&model, &next].map(|robot| robot.effects[0].effect.kind);
    assert_eq!(kinds, [Kind::GearEccentricity; 2]);
    let size = |robot: &Robot| {
        let [cosine, sine, ..] = robot.effects[0].effect.gains;
        cosine.hypot(sine)
    };
    assert!((size(&next) / size(&model) - 1.0).abs() < 0.1);
    // The description as it stands is as good on data that it has not seen as one fitted to them.
    let [frozen, refitted] = after.waterfall[0].train[..] else {
        unreachable!("{:?}", after.waterfall)
    };
    assert!(frozen < 1.1 * refitted, "{frozen} {refitted}");
    assert!(refitted < 1.1 * after.noise_floor_rms[0]);
}

#[test]
fn an_effect_that_the_recordings_contradict_goes_and_is_told() {
    let made = recorded(&[], 5, 30.0);
    let robot = described(&made.robot, wave(0.3));
    let (found, model) = diagnosed(&robot, &made, without_gears());
    assert_eq!(found.verdict, Verdict::ParameterChange, "{:?}", found.words);
    assert!(model.effects.is_empty());
    assert_eq!(found.described[0].fate, Fate::Dropped);
    let told = "cogging of joint link (cosine 0.300 N*m, sine 0 N*m, order 9.00 1)";
    assert!(
        found.described[0].text.contains(told),
        "{}",
        found.described[0].text
    );
    assert!(found.words.contains(&found.described[0].text));
    // As described it was far off.
    let w = &found.waterfall[0];
    assert!(w.train[0] > 1.5 * w.train[1], "{w:?}");
}

/// Across gravity, whose torque on the emulated rig goes with sin q.
fn tilt(cosine: f64) -> RobotEffect {
    RobotEffect {
        joint: Some("link".into()),
        other: None,
        effect: Effect::new(Kind::GravityTilt, &[cosine, 0.0], &[]),
    }
}

#[test]
fn a_tilt_that_is_not_there_goes_and_none_is_found_to_make_up_for_it() {
    let made = recorded(&[], 5, 30.0);
    let robot = described(&made.robot, tilt(0.3));
    let (found, model) = diagnosed(&robot, &made, without_gears());
    assert_eq!(found.verdict, Verdict::ParameterChange, "{:?}", found.words);
    assert!(found.steps.is_empty(), "{:?}", found.words);
    assert_eq!(found.described[0].fate, Fate::Dropped);
    assert!(model.effects.is_empty());
    assert_eq!(model.gravity, made.robot.gravity);
    let w = &found.waterfall[0];
    assert!(w.train[0] > 1.5 * w.train[1], "{w:?}");
    assert!(w.train[1] < 1.1 * found.noise_floor_rms[0], "{w:?}");
}

#[test]
fn a_tilt_that_is_another_gives_way_to_the_one_that_is_there() {
    let made = recorded(
        &[rig_scenario::Effect::GravityTilt { angle: 0.08 }],
        5,
        30.0,
    );
    let named = |robot: &Robot| {
        let (found, model) = diagnosed(robot, &made, without_gears());
        let names: Vec<&str> = found.steps.iter().map(|s| s.effect.as_str()).collect();
        assert_eq!(names, ["gravity_tilt"], "{:?}", found.words);
        let angle = found.steps[0].parameters["angle"].value;
        (found, model.gravity, angle)
    };
    let (_, alone, angle) = named(&made.robot);
    let (found, gravity, beside) = named(&described(&made.robot, tilt(0.5)));
    assert_eq!(found.described[0].fate, Fate::Dropped);
    assert!(found.words.contains(&found.described[0].text));
    assert!((beside / angle - 1.0).abs() < 0.01, "{beside} {angle}");
    let apart = (0..3).map(|k| f64::abs(gravity[k] - alone[k]));
    assert!(apart.fold(0.0, f64::max) < 0.02, "{gravity:?} {alone:?}");
}

#[test]
fn an_effect_too_small_to_show_is_held() {
    let made = recorded(&[], 5, 30.0);
    let robot = described(&made.robot, wave(1e-4));
    let (found, model) = diagnosed(&robot, &made, without_gears());
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.words);
    assert_eq!(found.described[0].fate, Fate::Held);
    assert_eq!(model.effects, robot.effects);
}

#[test]
fn what_the_search_leaves_out_is_held_and_taken_off() {
    let made = recorded(&[WAVE], 3, 30.0);
    let (_, model) = diagnosed(&made.robot, &made, without_gears());
    let mut without = without_gears();
    without.extend([Kind::GearEccentricity, Kind::Cogging]);
    let (found, next) = diagnosed(&model, &made, without);
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.words);
    assert_eq!(found.described[0].fate, Fate::Held);
    assert!(
        found.described[0]
            .text
            .ends_with("was taken off the recordings: it was left out of the search.")
    );
    assert_eq!(next.effects, model.effects);
    assert!(found.waterfall[0].train[1] < 1.1 * found.noise_floor_rms[0]);
}

#[test]
fn a_payload_is_a_mass_of_its_link() {
    let robot =
        Robot::from_toml(rig_model::robot::ONE_LINK_TEMPLATE, Path::new("one.toml")).unwrap();
    let payload = Effect::new(Kind::Payload, &[0.5], &[0.4]);
    let prepared = described(
        &robot,
        RobotEffect {
            joint: None,
            other: None,
            effect: payload,
        },
    );
    let stated = DescribedEffects::of(&prepared);
    assert!(stated.robot.effects.is_empty() && stated.free().is_empty());
    let [link, own] =
        [&stated.robot, &robot].map(|robot| robot.joints[0].inertial.clone().unwrap());
    assert!((link.mass - own.mass - 0.5).abs() < 1e-12);
    assert!((link.first_moment[0] - own.first_moment[0] - 0.2).abs() < 1e-12);
    assert!((link.inertia[5] - own.inertia[5] - 0.08).abs() < 1e-12);
    assert_eq!(stated.told(vec![None])[0].fate, Fate::InTheLink);
}
