//! Tests of the counting of answers.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};

use rig_shared::effects::Kind;

use super::answer::{one_holds_both, same_by_voltage};
use super::outcome::one_each;
use super::*;
use rig_scenario::{Effect, Hidden, Made, Noise, Scenario};

/// A method with a fixed answer: names, and whether values of the description have changed.
struct Parrot(Vec<&'static str>, bool);

impl Method for Parrot {
    fn name(&self) -> &'static str {
        "parrot"
    }

    fn answer(&self, _: &Made, _: &[Kind]) -> Result<Answer, BenchError> {
        let named = self.0.iter().map(|name| Named {
            effect: (*name).into(),
            set: vec![(*name).into()],
            parameters: BTreeMap::new(),
        });
        Ok(Answer {
            named: named.collect(),
            changed: self.1,
            ..Answer::default()
        })
    }
}

fn plan() -> Plan {
    Plan {
        effects: vec!["gravity_tilt".into(), "gear_eccentricity".into()],
        seeds: 2,
        first_seed: 1,
        nothing: 3,
        levels: vec![("medium", Noise::MEDIUM)],
        combinations: vec![2],
        combined: 2,
        leave_out: true,
        controls: true,
        follow: false,
        seconds: [20.0, 20.0],
        second_encoder: false,
    }
}

#[test]
fn answers_are_counted_by_what_was_hidden() {
    let cases = plan().cases().unwrap();
    let silent = Parrot(Vec::new(), false);
    let tilt = Parrot(vec!["gravity_tilt"], false);
    let changed = Parrot(Vec::new(), true);
    let lists = run(&cases, &[&silent, &tilt, &changed], 2, &|_, _| {}).unwrap();
    let [silent, tilt, changed] = [&lists[0], &lists[1], &lists[2]].map(|list| Score::of("", list));
    assert_eq!((silent.false_alarm.hits, silent.false_alarm.of), (0, 3));
    assert_eq!((tilt.false_alarm.hits, tilt.false_alarm.of), (3, 3));
    assert_eq!(silent.right_first_any_size.hits, 0);
    assert_eq!(silent.false_discovery, Some(0.0));
    // Right in two of four single cases, and in one of two names of every combination.
    assert_eq!(
        (tilt.right_first_any_size.hits, tilt.right_first_any_size.of),
        (2, 4)
    );
    assert_eq!(tilt.false_discovery, Some(2.0 / 6.0));
    assert_eq!(tilt.exact_combination.hits, 0);
    // Named although it was removed from the library, without a remainder.
    assert!(tilt.invented_silently.of > 0);
    assert_eq!(tilt.invented_silently.hits, tilt.invented_silently.of);
    assert_eq!(tilt.remainder_flagged.hits, 0);
    assert_eq!(tilt.controls[&Group::OneRunOnly].hits, 2);
    // A change of the description is no name, but it is wrong if no such change was hidden.
    assert_eq!((changed.false_alarm.hits, changed.false_alarm.of), (3, 3));
    assert_eq!(changed.false_discovery, Some(0.0));
    assert_eq!(changed.right_first_any_size.hits, 0);
    assert_eq!(changed.invented_silently.hits, changed.invented_silently.of);
    assert_eq!(changed.controls[&Group::OneRunOnly].hits, 2);
    assert_eq!(changed.controls[&Group::WrongDescription].hits, 0);
    assert_eq!(tilt.controls[&Group::WrongDescription].hits, 2);
}

#[test]
fn exact_partners_count_as_one_name() {
    assert!(is_right("current_offset", "torque_offset"));
    assert!(is_right("asymmetric_coulomb", "current_offset"));
    assert!(!is_right("gravity_tilt", "torque_offset"));
    // The voltage separates an offset of the current sensor from a torque.
    let left = |name| same_by_voltage(name).into_iter().collect::<Vec<_>>();
    assert_eq!(left("current_offset"), ["current_offset"]);
    assert_eq!(
        left("torque_offset"),
        ["asymmetric_coulomb", "torque_offset"]
    );
    assert!(!is_right("stribeck", "presliding"));
    // k·(q − rest) + c is a spring with another rest; the voltage shows an error of the current reading.
    assert!(one_holds_both("spring", "asymmetric_coulomb"));
    assert!(one_holds_both("torque_offset", "spring"));
    assert!(!one_holds_both("spring", "current_offset"));
    assert!(!one_holds_both("spring", "gravity_tilt"));
}

#[test]
fn an_open_name_is_right_once_where_its_set_holds_the_hidden_effect() {
    let sets = |sets: &[&[&str]]| -> Vec<BTreeSet<String>> {
        (sets.iter())
            .map(|set| set.iter().map(|name| (*name).to_owned()).collect())
            .collect()
    };
    let hidden = ["spring", "payload"];
    assert!(one_each(
        &hidden,
        &sets(&[&["payload"], &["torque_offset", "spring"]])
    ));
    // The first set fits both effects, but only one assignment gives each effect a separate set.
    assert!(one_each(
        &hidden,
        &sets(&[&["spring", "payload"], &["spring"]])
    ));
    assert!(!one_each(&hidden, &sets(&[&["spring", "payload"]])));
    assert!(!one_each(
        &hidden,
        &sets(&[&["payload"], &["spring"], &["cogging"]])
    ));
    assert!(!one_each(
        &hidden,
        &sets(&[&["payload"], &["torque_offset"]])
    ));
}

#[test]
fn combinations_hold_different_effects_and_repeat_with_the_seed() {
    let plan = Plan {
        effects: Effect::names().map(str::to_owned).collect(),
        combinations: vec![2, 3],
        combined: 60,
        seeds: 0,
        nothing: 0,
        ..plan()
    };
    let cases = plan.cases().unwrap();
    assert_eq!(cases.len(), 120);
    let mut seen = BTreeSet::new();
    for case in &cases {
        let names: Vec<&str> = (case.scenario.hidden.iter())
            .map(|h| h.effect.name())
            .collect();
        for (k, a) in names.iter().enumerate() {
            assert!(
                names[..k].iter().all(|b| !one_holds_both(a, b)),
                "{names:?}"
            );
        }
        seen.insert(names);
    }
    assert!(seen.len() > 80, "{}", seen.len());
    assert_eq!(cases, plan.cases().unwrap());
}

#[test]
fn sparse_regression_names_an_eccentric_gear_first() {
    let effect = Effect::GearEccentricity {
        amplitude: 0.3,
        phase: 1.0,
    };
    let scenario = Scenario {
        seconds: [40.0, 30.0],
        ..Scenario::new(vec![Hidden { joint: 0, effect }], 3)
    };
    let made = scenario.make().unwrap();
    for method in [&peer::Frols as &dyn Method, &peer::Stlsq] {
        let answer = method.answer(&made, &[]).unwrap();
        assert_eq!(
            answer.named.first().map(|n| n.effect.as_str()),
            Some("gear_eccentricity"),
            "{}",
            method.name()
        );
        assert!(answer.gap_closed.unwrap() > 0.5, "{}", method.name());
    }
}

#[test]
fn a_constant_that_the_library_lacks_is_not_passed_off_as_a_tilt() {
    let effect = Effect::TorqueOffset { torque: 0.15 };
    let made = Scenario::short([effect], 5).make().unwrap();
    let known = Diagnose.answer(&made, &[]).unwrap();
    assert!(is_right(&known.named[0].effect, "torque_offset"));
    assert!(!known.remainder, "{known:?}");
    let constants = exact_class("torque_offset");
    let without: Vec<Kind> = (Kind::ALL.iter().copied())
        .filter(|kind| constants.contains(kind.about().name))
        .collect();
    let unknown = Diagnose.answer(&made, &without).unwrap();
    assert!(unknown.remainder, "{unknown:?}");
    // A spring with negative stiffness, or with a preload only, is no spring.
    assert!(unknown.named.iter().all(|named| named.effect != "spring"));
}

/// Effects with the laws of the emulated rig, which differ in form from those of the library.
fn hidden_pair() -> [Effect; 2] {
    let presliding = Effect::Presliding { stroke: 4.0e-3 };
    let cogging = Effect::Cogging {
        amplitude: 0.2,
        order: 12.0,
        phase: 1.0,
    };
    [presliding, cogging]
}

#[test]
fn the_evidence_names_what_is_hidden_and_nothing_else() {
    let nothing = Scenario::short([], 11).make().unwrap();
    let none = Evidence.answer(&nothing, &[]).unwrap();
    assert!(none.named.is_empty() && !none.remainder, "{none:?}");
    let made = Scenario::short(hidden_pair(), 12).make().unwrap();
    let both = Evidence.answer(&made, &[]).unwrap();
    let names: BTreeSet<&str> = both.named.iter().map(|n| n.effect.as_str()).collect();
    assert_eq!(names, BTreeSet::from(["cogging", "presliding"]), "{both:?}");
    assert!(!both.remainder, "{both:?}");
}

#[test]
fn the_evidence_needs_no_repeated_run() {
    let alone = |effects: &[Effect], seed| Made {
        repeat: None,
        ..Scenario::short(effects.iter().copied(), seed)
            .make()
            .unwrap()
    };
    let none = Evidence.answer(&alone(&[], 13), &[]).unwrap();
    assert!(none.named.is_empty() && !none.remainder, "{none:?}");
    let both = Evidence.answer(&alone(&hidden_pair(), 14), &[]).unwrap();
    let names: BTreeSet<&str> = both.named.iter().map(|n| n.effect.as_str()).collect();
    assert_eq!(names, BTreeSet::from(["cogging", "presliding"]), "{both:?}");
}

#[test]
fn the_evidence_says_along_what_an_unknown_torque_acts() {
    let effect = Effect::PositionFriction {
        amplitude: 0.2,
        order: 3.0,
        phase: 1.0,
    };
    let made = Scenario::short([effect], 15).make().unwrap();
    let options = rig_diagnose::Options {
        without: vec![Kind::PositionFriction],
        ..rig_diagnose::Options::default()
    };
    let finding = made
        .with_recordings(|training, _| {
            rig_diagnose::evidence::find(&made.robot, training, &options)
        })
        .unwrap();
    assert!(finding.found.is_empty(), "{finding:?}");
    let along: Vec<&str> = finding.unknown.iter().map(|u| u.along).collect();
    assert_eq!(along, ["position, by direction"], "{finding:?}");
}

/// The motor's motion alone leads a lightly damped gear astray: its share would be a half, beside a delay or presliding
/// that is not there.
#[test]
fn the_evidence_finds_a_gear_by_an_observer_of_its_link() {
    let gears = [
        (
            Effect::JointElasticity {
                stiffness: 900.0,
                damping: 0.35,
            },
            ("joint_elasticity", "stiffness", 900.0, 0.03),
        ),
        (
            Effect::Backlash { gap: 7e-3 },
            ("backlash", "gap", 7e-3, 0.1),
        ),
    ];
    for (effect, (name, parameter, truth, share)) in gears {
        let made = Scenario::short([effect], 16).make().unwrap();
        let options = rig_diagnose::Options::default();
        let finding = made
            .with_recordings(|training, _| {
                rig_diagnose::evidence::find(&made.robot, training, &options)
            })
            .unwrap();
        let names: Vec<&str> = finding.found.iter().map(|found| found.name).collect();
        assert_eq!(names, [name], "{finding:?}");
        let own = finding.found[0].parameters.iter();
        let value = own.copied().find(|(name, _)| *name == parameter).unwrap().1;
        assert!(
            (value / truth - 1.0).abs() < share,
            "{name}: {value} for {truth}"
        );
    }
}
