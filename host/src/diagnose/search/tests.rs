//! Which of names that explain alike is taken.

#![allow(clippy::unwrap_used)]

use rig_shared::effects::Kind;

use crate::diagnose::scenario::{Effect, Hidden, Scenario};
use crate::diagnose::{Options, diagnose};

/// Effects found beside gears, which are not what is asked.
fn found(effect: Effect, seed: u64) -> Vec<String> {
    let made = Scenario {
        seconds: [30.0, 20.0],
        ..Scenario::new(vec![Hidden { joint: 0, effect }], seed)
    }
    .make()
    .unwrap();
    let options = Options {
        without: vec![Kind::Backlash, Kind::JointElasticity],
        ..Options::default()
    };
    let (diagnosis, _) = diagnose(
        &made.robot,
        &[&made.train, made.repeat.as_ref().unwrap()],
        &[&made.holdout],
        &options,
        &mut |_| (),
    )
    .unwrap();
    diagnosis.steps.into_iter().map(|s| s.effect).collect()
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
