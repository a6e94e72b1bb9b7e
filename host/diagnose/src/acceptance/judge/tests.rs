//! Alternative names of a step.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::sync::Arc;

use rig_shared::effects::Kind;

use crate::acceptance::judge::rank::{may_stand, rank};
use crate::acceptance::judge::unseen::{left_of_held, taken_by_none};
use crate::acceptance::judge::*;
use crate::columns::candidate::Candidate;
use crate::fit::evidence::Evidence;
use crate::outcome::Step;
use crate::search::fitted_candidate::equal;
use rig_data::runs::{JointRun, Run};

fn profile(kind: Kind, joint: usize, gain: f64) -> FittedCandidate {
    FittedCandidate {
        candidate: Candidate::on(kind, joint),
        shapes: Default::default(),
        columns: Arc::default(),
        evidence: Evidence {
            gain,
            ..Evidence::default()
        },
        at_bound: None,
        followed: None,
        otherwise: None,
        accepted_by_observer: false,
        near_collinear: false,
    }
}

#[test]
fn the_runner_up_is_of_the_same_joint() {
    let own = profile(Kind::Stribeck, 0, 0.5);
    let rivals = [
        profile(Kind::Cogging, 1, 0.4),
        profile(Kind::QuadraticDrag, 0, 0.2),
    ];
    let mut step = Step {
        effect: "stribeck".into(),
        law: None,
        joint: "shoulder".into(),
        set: Vec::new(),
        parameters: BTreeMap::new(),
        p_value: 1e-9,
        name_probability: f64::NAN,
        runner_up: None,
        runner_up_gap_closed: None,
        rms_unit: "N*m".into(),
        train_rms: [0.2, 0.1],
        holdout_rms: None,
        motion_rms: None,
        gap_closed: 0.9,
        why: String::new(),
    };
    rank(&mut step, &own, &rivals, &[], &|_| false);
    assert_eq!(step.runner_up.as_deref(), Some("quadratic_drag"));
    assert!(
        step.runner_up_gap_closed
            .is_some_and(|share| (share - 0.36).abs() < 1e-12)
    );
    let mut alone = Step {
        runner_up: None,
        runner_up_gap_closed: None,
        ..step
    };
    rank(&mut alone, &own, &rivals[..1], &[], &|_| false);
    assert_eq!(alone.runner_up, None);
}

#[test]
fn what_a_law_takes_that_cannot_stand_is_not_nothing() {
    let template = std::path::Path::new("one-link.toml");
    let robot = Robot::from_toml(rig_model::robot::ONE_LINK_TEMPLATE, template).unwrap();
    let mut fallen = profile(Kind::Backlash, 0, 0.5);
    fallen.evidence.joint_gain = 0.4;
    let left = taken_by_none(&robot, std::slice::from_ref(&fallen), &[], &[0.3]).unwrap();
    let kind = Kind::Backlash;
    assert_eq!(left.cause, RemainderCause::TakenByNone { kind, gain: 0.4 });
    assert!((left.ratio - 1.0 / 0.6).abs() < 1e-12 && (left.rms - 0.3 * 0.8).abs() < 1e-12);
    // The residual of an accepted effect is judged separately.
    let named = profile(Kind::JointElasticity, 0, 0.5);
    assert!(taken_by_none(&robot, &[fallen], &[named], &[0.3]).is_none());
}

#[test]
fn a_spring_may_stand_where_it_is_at_rest_not_far_away() {
    let run = Run {
        joints: vec![JointRun {
            q: vec![2.0, 3.0],
            ..JointRun::default()
        }],
        ..Run::default()
    };
    let spring = |stiffness: f64, preload: f64, at_bound| {
        let mut spring = profile(Kind::Spring, 0, 0.5);
        spring.evidence.gains = vec![stiffness, preload];
        spring.evidence.stds = vec![0.1, 0.1];
        spring.at_bound = at_bound;
        may_stand(&spring, std::slice::from_ref(&run))
    };
    // At mid-motion, 2.5 rad, it pulls with 0.3 N·m; with 0.2 N·m/rad more it rests 1.5 rad away …
    assert!(spring(0.0, 0.3, Some("stiffness")));
    // … and with 0.6 N·m 3 rad, three times its motion.
    assert!(!spring(0.0, 0.6, Some("stiffness")));
    assert!(spring(0.0, 0.6, None));
    let mut other = profile(Kind::Stribeck, 0, 0.5);
    other.at_bound = Some("velocity");
    assert!(!may_stand(&other, &[run]));
}

/// A repeated hold-out has its own floor. Effects must reach it, except for filter errors and model mismatch. Other
/// hold-outs use the training floor, and gear contacts are loud.
#[test]
fn what_is_held_back_twice_is_held_to_its_own_floor() {
    let robot = Robot::from_toml(
        rig_model::robot::ONE_LINK_TEMPLATE,
        std::path::Path::new("one-link.toml"),
    )
    .unwrap();
    let left = |held: f64, chosen: &[FittedCandidate], twice: Option<f64>| {
        let floors: [&[f64]; 2] = [&[1.0], &[1.0]];
        left_of_held(&robot, &[held], &[1.02], floors, chosen, &|_| twice)
    };
    let stribeck = [profile(Kind::Stribeck, 0, 0.5)];
    let play = [profile(Kind::Backlash, 0, 0.5)];
    assert!(left(1.1, &stribeck, Some(0.0)).is_none());
    let found = left(1.17, &stribeck, Some(0.0)).unwrap();
    assert!(
        (found.ratio - 1.17).abs() < 1e-9
            && matches!(found.cause, RemainderCause::OnHoldOut { .. })
    );
    assert!(left(1.17, &stribeck, Some(0.2)).is_none());
    assert!(left(1.17, &stribeck, None).is_none());
    assert!(left(1.17, &play, Some(0.0)).is_none());
    assert!(left(1.6, &play, Some(0.0)).is_some());
}

/// Nearly the same gain, but 1.5 times the noise remains.
#[test]
fn a_rival_that_leaves_clearly_more_is_no_equal() {
    let own = profile(Kind::PreslidingDahl, 0, 0.84);
    assert!(!equal(&own, &profile(Kind::Stribeck, 0, 0.76)));
    assert!(equal(&own, &profile(Kind::Stribeck, 0, 0.82)));
    let little = profile(Kind::PreslidingDahl, 0, 0.1);
    assert!(equal(&little, &profile(Kind::Stribeck, 0, 0.091)));
}
