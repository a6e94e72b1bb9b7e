//! Words on unexplained residuals.

#![allow(clippy::unwrap_used)]

use rig_shared::effects::Kind;

use crate::result::sentences::remainder::*;
use crate::result::sentences::residual::sizes;

fn said(rms: f64, ratio: f64, cause: RemainderCause) -> String {
    text(&Unexplained {
        joint: "link".into(),
        unit: "N*m".into(),
        rms,
        ratio,
        places: Vec::new(),
        cause,
    })
}

#[test]
fn a_law_that_cannot_stand_is_named_with_its_share() {
    let kind = Kind::Backlash;
    let said = said(
        0.24,
        1.0 / 0.6,
        RemainderCause::TakenByNone { kind, gain: 0.4 },
    );
    assert!(said.contains("40 %") && said.contains("no name"), "{said}");
}

#[test]
fn a_residual_of_the_hold_out_is_given_in_noise_floors() {
    let training_ratio = None;
    let said = said(0.6, 1.17, RemainderCause::OnHoldOut { training_ratio });
    assert!(said.contains("1.17 times"), "{said}");
}

fn left(joint: &str, rms: [f64; 2], floor: f64, torque: f64) -> Left {
    let [before, after] = rms;
    Left {
        joint: joint.into(),
        unit: "N*m".into(),
        on_holdout: true,
        before,
        after,
        floor,
        floor_from: match floor.is_nan() {
            true => FloorFrom::Unknown,
            false => FloorFrom::RepeatedRuns,
        },
        torque,
        percent_of_torque: 100.0 * after / torque,
        explained: false,
    }
}

#[test]
fn an_open_gap_is_given_with_its_ends() {
    let open = |left: Left| said(14.0, 28.0, RemainderCause::GapOpen { left, named: true });
    let all = [
        left("a", [0.2, 0.1], 0.05, 10.0),
        left("b", [20.0, 14.0], 0.5, 20.0),
        left("c", [1.0, 0.05], 0.05, 2.0),
    ];
    let found = open(all[1].clone());
    assert!(found.contains("from 20.0 to 14.0 N·m"), "{found}");
    let found = open(left("d", [0.2, 0.1], f64::NAN, 1.0));
    assert!(found.contains("No noise floor is known"), "{found}");
    let said = sizes(&all).unwrap();
    assert!(
        said.contains("joint b 14.0 N·m RMS (70 % of 20.0 N·m RMS)"),
        "{said}"
    );
}
