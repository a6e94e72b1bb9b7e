//! Conditions for an explained joint.

#![allow(clippy::unwrap_used)]

use crate::acceptance::model_check::*;

const REPEATED: FloorFrom = FloorFrom::RepeatedRuns;

/// Returns true if a joint with an effect is explained, without an allowance for the treatment.
fn named(rms: [f64; 2], floor: f64, from: FloorFrom) -> bool {
    explained(rms, floor, 0.0, true, from)
}

/// The rig without slow reversals, whose presliding remains: 58 % of the gap closed, residual 1.19 times the floor.
#[test]
fn a_gap_that_is_half_closed_is_not_explained() {
    assert!(!named([0.0440, 0.0362], 0.0304, REPEATED));
    assert!(named([0.0440, 0.0310], 0.0304, REPEATED));
    // A residual at the floor is explained, however small the gap was.
    assert!(named([0.0350, 0.0330], 0.0304, REPEATED));
    // Far above the floor, with nearly all of a large gap closed.
    assert!(named([1.0, 0.05], 0.0304, REPEATED));
    assert!(!named([20.0, 14.0], 0.5, REPEATED));
}

/// Without a floor from data alone, the residual must fall by nearly all of itself.
#[test]
fn without_a_floor_the_residual_itself_has_to_fall() {
    let unknown = |rms| named(rms, f64::NAN, FloorFrom::Unknown);
    assert!(!unknown([0.0440, 0.0310]));
    assert!(unknown([0.44, 0.031]));
    // A residual from filters and differences is no remainder.
    assert!(explained(
        [0.01, 0.01],
        f64::NAN,
        2e-4,
        false,
        FloorFrom::Unknown
    ));
    assert!(!explained(
        [0.1, 0.1],
        f64::NAN,
        2e-4,
        false,
        FloorFrom::Unknown
    ));
}

fn left(joint: &str, rms: [f64; 2], floor: f64, torque: f64) -> Left {
    let [before, after] = rms;
    let floor_from = match floor.is_nan() {
        true => FloorFrom::Unknown,
        false => REPEATED,
    };
    Left {
        joint: joint.into(),
        unit: "N*m".into(),
        on_holdout: true,
        before,
        after,
        floor,
        floor_from,
        torque,
        percent_of_torque: 100.0 * after / torque,
        explained: named(rms, floor, floor_from),
    }
}

/// The joint with the largest share of its torque is reported, with its size and no share of a gap.
#[test]
fn the_remainder_is_that_of_the_joint_that_is_explained_least() {
    let all = [
        left("a", [0.2, 0.1], 0.05, 10.0),
        left("b", [20.0, 14.0], 0.5, 20.0),
        left("c", [1.0, 0.05], 0.05, 2.0),
    ];
    let found = unexplained(&all, &|_| true).unwrap();
    assert_eq!(found.joint, "b");
    assert!((found.rms - (14.0_f64 * 14.0 - 0.25).sqrt()).abs() < 1e-12);
    let cause = |left: &Left| RemainderCause::GapOpen {
        left: left.clone(),
        named: true,
    };
    assert_eq!(found.cause, cause(&all[1]));
    assert!(unexplained(&all[2..], &|_| true).is_none());
    let open = [left("d", [0.2, 0.1], f64::NAN, 1.0)];
    let found = unexplained(&open, &|_| true).unwrap();
    assert!(matches!(&found.cause, RemainderCause::GapOpen { left, .. } if left.joint == "d"));
    assert!(found.rms == 0.1);
}
