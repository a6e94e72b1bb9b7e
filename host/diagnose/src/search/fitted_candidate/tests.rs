//! Acceptance of candidates.

use crate::search::fitted_candidate::*;

fn profile(kind: Kind, joint_gain: f64, gain_sigmas: f64) -> FittedCandidate {
    FittedCandidate {
        candidate: Candidate::on(kind, 0),
        shapes: Default::default(),
        columns: Arc::default(),
        evidence: Evidence {
            gain: joint_gain,
            joint_gain,
            gain_sigmas,
            p_value: 1e-20,
            ..Evidence::default()
        },
        at_bound: None,
        followed: None,
        otherwise: None,
        accepted_by_observer: false,
        near_collinear: false,
    }
}

/// A saturation shows in few blocks, those with the highest torque, and has its largest gain there.
#[test]
fn what_takes_much_away_may_do_so_in_few_blocks() {
    let saturated = |gain, sigmas| profile(Kind::TorqueSaturation, gain, sigmas).refused(300);
    assert_eq!(saturated(0.6, 1.9), None);
    assert!(saturated(0.6, 0.9).is_some());
    assert!(saturated(0.1, 1.9).is_some());
    // Backlash fits so much that one contact suffices for a false one. A spring rings at its resonance alone.
    assert!(profile(Kind::Backlash, 0.6, 1.9).refused(300).is_some());
    assert_eq!(profile(Kind::JointElasticity, 0.8, 1.9).refused(300), None);
    assert!(
        profile(Kind::JointElasticity, 0.4, 1.9)
            .refused(300)
            .is_some()
    );
}

/// A constant beside loud blocks: it improves nearly all blocks, but their variation hides that.
#[test]
fn many_blocks_that_agree_stand_in_for_a_gain_beyond_what_they_vary_by() {
    let of = |kind, less: usize| {
        let mut agreeing = profile(kind, 0.2, 1.9);
        agreeing.evidence.block_errors = (0..90)
            .map(|k| [1.0, if k < less { 0.9 } else { 1.05 }])
            .collect();
        agreeing.refused(300)
    };
    assert_eq!(of(Kind::AsymmetricCoulomb, 75), None);
    assert!(of(Kind::AsymmetricCoulomb, 50).is_some());
    assert!(of(Kind::Backlash, 75).is_some());
}

/// The link of a wide backlash is seldom where the motor motion puts it.
#[test]
fn a_play_that_takes_little_is_heard_where_that_is_clear() {
    let play = |gain, sigmas| profile(Kind::Backlash, gain, sigmas);
    assert!(play(0.08, 6.0).is_nearly_a_play(300));
    for (gain, sigmas) in [(0.03, 6.0), (0.08, 3.0), (0.2, 6.0)] {
        assert!(!play(gain, sigmas).is_nearly_a_play(300));
    }
    assert!(!profile(Kind::JointElasticity, 0.08, 6.0).is_nearly_a_play(300));
    assert!(play(0.08, 6.0).refused(300).is_some());
    let accepted_by_observer = FittedCandidate {
        accepted_by_observer: true,
        ..play(0.08, 6.0)
    };
    assert_eq!(accepted_by_observer.refused(300), None);
}
