//! Which other names a step may have.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::*;
use crate::diagnose::columns::Candidate;
use crate::diagnose::fit::Evidence;

fn profile(kind: Kind, joint: usize, gain: f64) -> Profile {
    Profile {
        candidate: Candidate {
            kind,
            joint,
            other: None,
        },
        shapes: Default::default(),
        columns: Arc::default(),
        evidence: Evidence {
            gain,
            ..Evidence::default()
        },
        vanished: None,
        followed: None,
        otherwise: None,
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
        runner_up: None,
        runner_up_gap_closed: None,
        rms_unit: "N*m".into(),
        train_rms: [0.2, 0.1],
        holdout_rms: None,
        motion_rms: None,
        gap_closed: 0.9,
        why: String::new(),
    };
    rank(&mut step, &own, &rivals, &[]);
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
    rank(&mut alone, &own, &rivals[..1], &[]);
    assert_eq!(alone.runner_up, None);
}
