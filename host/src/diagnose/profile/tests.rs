//! What is taken.

use super::*;

fn profile(kind: Kind, joint_gain: f64, gain_sigmas: f64) -> Profile {
    Profile {
        candidate: Candidate {
            kind,
            joint: 0,
            other: None,
        },
        shapes: Default::default(),
        columns: Arc::default(),
        evidence: Evidence {
            gain: joint_gain,
            joint_gain,
            gain_sigmas,
            p_value: 1e-20,
            ..Evidence::default()
        },
        vanished: None,
        followed: None,
        otherwise: None,
    }
}

/// A saturation shows where the torque is highest: in few blocks, and there it takes most away.
#[test]
fn what_takes_much_away_may_do_so_in_few_blocks() {
    let saturated = |gain, sigmas| profile(Kind::TorqueSaturation, gain, sigmas).refused(300);
    assert_eq!(saturated(0.6, 1.9), None);
    assert!(saturated(0.6, 0.9).is_some());
    assert!(saturated(0.1, 1.9).is_some());
    // A gear bends to so much that one touch is enough for a false one.
    assert!(profile(Kind::Backlash, 0.6, 1.9).refused(300).is_some());
}
