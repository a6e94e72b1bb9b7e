//! Which of names that explain alike is taken.

#![allow(clippy::unwrap_used)]

use rig_shared::effects::Kind;

use crate::diagnose::outcome::Verdict;
use crate::diagnose::scenario::{Effect, Scenario};
use crate::diagnose::{Diagnosis, Options};

/// What is found beside gears, which are not what is asked; `again`: the training motion recorded twice.
fn diagnosed(effect: Effect, seed: u64, again: bool) -> (Diagnosis, f64) {
    let mut made = Scenario::short([effect], seed).make().unwrap();
    let options = Options {
        without: vec![Kind::Backlash, Kind::JointElasticity],
        ..Options::default()
    };
    if !again {
        made.repeat = None;
    }
    let (diagnosis, _) = made.diagnosed(&made.robot, &options);
    let drive = made.robot.joints[0].drive.as_ref().unwrap();
    (diagnosis, drive.torque_constant * drive.gear_ratio)
}

fn names(diagnosis: &Diagnosis) -> Vec<String> {
    diagnosis.steps.iter().map(|s| s.effect.clone()).collect()
}

fn found(effect: Effect, seed: u64) -> Vec<String> {
    names(&diagnosed(effect, seed, true).0)
}

#[test]
fn a_constant_is_no_spring_and_a_spring_no_constant() {
    let constants = ["torque_offset", "current_offset", "asymmetric_coulomb"];
    for seed in [101, 103] {
        let names = found(Effect::TorqueOffset { torque: 0.15 }, seed);
        assert!(
            matches!(names.as_slice(), [one] if constants.contains(&one.as_str())),
            "{seed}: {names:?}"
        );
        let spring = Effect::Spring {
            stiffness: 0.5,
            rest: 0.3,
        };
        assert_eq!(found(spring, seed), ["spring"], "{seed}");
    }
}

/// The law is one of what the current says, not of what is left of it: by the latter the coefficient is a quarter too large.
#[test]
fn a_saturation_is_as_large_as_it_is() {
    let loss = 0.12;
    let (diagnosis, constant) = diagnosed(Effect::TorqueSaturation { loss }, 5, true);
    assert_eq!(names(&diagnosis), ["torque_saturation"]);
    let step = &diagnosis.steps[0];
    // The rig's 1/(1 + (i/knee)²) begins as 1 − (i/knee)² and ends above it, by an eighth at the peak current and more beyond.
    let truth = loss / (1.0 - loss) / (Effect::PEAK_CURRENT * constant).powi(2);
    let found = step.parameters["coefficient"].value / truth;
    assert!((0.75..1.03).contains(&found), "{found}");
}

/// Before it is found, presliding looks like a torque recorded early; what is then taken out as that comes back as a delay.
#[test]
fn presliding_is_no_delay_besides() {
    let effect = Effect::Presliding { stroke: 0.007 };
    let (diagnosis, _) = diagnosed(effect, 5, false);
    assert_eq!(names(&diagnosis), ["presliding"]);
}

#[test]
fn a_constant_that_a_description_cannot_state_is_fitted_beside_its_friction() {
    let effect = Effect::TorqueOffset { torque: 0.15 };
    let made = Scenario::short([effect], 101).make().unwrap();
    let options = |no_offsets| Options {
        without: vec![Kind::Backlash, Kind::JointElasticity],
        no_offsets,
        ..Options::default()
    };
    let (stated, _) = made.diagnosed(&made.robot, &options(false));
    assert_eq!(stated.steps.len(), 1);
    let (open, model) = made.diagnosed(&made.robot, &options(true));
    assert!(open.steps.is_empty(), "{:?}", names(&open));
    // No change either: there was nothing to change.
    assert_eq!(open.verdict, stated_without_a_constant());
    let offset = model.joints[0].friction.as_ref().unwrap().offset;
    assert!((offset.abs() - 0.15).abs() < 0.01, "{offset}");
    let said = (open.words.iter()).any(|w| w.contains("no place for a constant torque"));
    assert!(said, "{:?}", open.words);
    for place in open.places.iter().chain(&stated.places) {
        assert!(place.p_value < 0.05, "{place:?}");
    }
}

/// The verdict on the same rig without the constant.
fn stated_without_a_constant() -> Verdict {
    let made = Scenario::short([], 101).make().unwrap();
    let options = Options {
        without: vec![Kind::Backlash, Kind::JointElasticity],
        ..Options::default()
    };
    made.diagnosed(&made.robot, &options).0.verdict
}

/// What a spring pulls everywhere alike is part of a constant that is fitted anyway; its stiffness is not.
#[test]
fn a_spring_is_found_where_the_description_cannot_state_a_constant() {
    let (stiffness, rest) = (1.2, 0.3);
    let made = (Scenario::short([Effect::Spring { stiffness, rest }], 103).make()).unwrap();
    let options = Options {
        without: vec![Kind::Backlash, Kind::JointElasticity],
        no_offsets: true,
        ..Options::default()
    };
    let (diagnosis, model) = made.diagnosed(&made.robot, &options);
    assert_eq!(names(&diagnosis), ["spring"]);
    let found = &diagnosis.steps[0].parameters["stiffness"];
    assert!((found.value / stiffness - 1.0).abs() < 0.1, "{found:?}");
    assert!(diagnosis.steps[0].gap_closed > 0.9);
    // The rest of the law, −stiffness·rest, stands as the joint's offset.
    let offset = model.joints[0].friction.as_ref().unwrap().offset;
    assert!((offset + stiffness * rest).abs() < 0.1, "{offset}");
}
