//! An observer-based gear: its stiffness is correct, and it explains nothing without a real gear.

#![allow(clippy::unwrap_used)]

use crate::Options;
use crate::columns::candidate::Candidate;
use crate::description::described_effects::DescribedEffects;
use crate::models::observer_models::*;
use crate::outcome::Verdict;
use crate::recordings::context::library;
use crate::tests::made::Diagnosed as _;
use rig_data::prepare::Recording;
use rig_scenario::{Effect, Scenario};

/// The rig's spring hardens, its friction has memory, and its link is pushed at random. Open-loop, the stiffness is 7
/// to 12 % too soft, and 70 to 86 % of the gap is closed.
#[test]
fn a_stiff_gear_is_as_stiff_as_it_is() {
    let effect = Effect::JointElasticity {
        stiffness: 1400.0,
        damping: 0.3,
    };
    let made = Scenario::short([effect], 401).make().unwrap();
    let (diagnosis, model) = made.diagnosed(&made.robot, &Options::default());
    let [step] = diagnosis.steps.as_slice() else {
        unreachable!("{:?}", diagnosis.words)
    };
    assert_eq!(step.effect, "joint_elasticity");
    assert_eq!(
        diagnosis.verdict,
        Verdict::Explained,
        "{:?}",
        diagnosis.words
    );
    // All values use the description's torque constant, which equals the rig's.
    let stiffness = &step.parameters["stiffness"];
    assert!(
        (stiffness.value / 1400.0 - 1.0).abs() < 0.02,
        "{stiffness:?}"
    );
    assert!(
        (stiffness.value - 1400.0).abs() < 3.0 * stiffness.std,
        "{stiffness:?}"
    );
    assert!(!step.parameters.contains_key("share"));
    assert!(
        diagnosis.gap_closed.unwrap() > 0.9,
        "{:?}",
        diagnosis.gap_closed
    );
    assert_eq!(model.effects[0].effect.shapes[0], stiffness.value);
}

/// Contacts come at times that no law predicts, and leave ten times the noise of the rest.
#[test]
fn an_effect_as_large_as_the_noise_is_found_beside_play() {
    let hidden = [
        Effect::Backlash { gap: 0.0144 },
        Effect::Cogging {
            amplitude: 0.15,
            order: 24.0,
            phase: 3.75,
        },
    ];
    let made = Scenario::short(hidden, 811).make().unwrap();
    let (diagnosis, _) = made.diagnosed(&made.robot, &Options::default());
    let [play, cogging] = diagnosis.steps.as_slice() else {
        unreachable!("{:?}", diagnosis.words)
    };
    assert_eq!([&*play.effect, &*cogging.effect], ["backlash", "cogging"]);
    let gap = &play.parameters["gap"];
    assert!((gap.value / 0.0144 - 1.0).abs() < 0.1, "{gap:?}");
    assert!((gap.value - 0.0144).abs() < 3.0 * gap.std, "{gap:?}");
    assert_eq!(cogging.parameters["order"].value, 24.0);
    let [sine, cosine] = ["sine", "cosine"].map(|name| cogging.parameters[name].value);
    let amplitude = sine.hypot(cosine);
    assert!((amplitude / 0.15 - 1.0).abs() < 0.3, "{amplitude}");
}

/// Returns the training residual RMS of a rig with a rigid gear: rigid model, and with a false observer-based gear.
fn made_up(kind: Kind, made_of: &[f64], effect: Option<Effect>, seed: u64) -> [f64; 2] {
    let made = Scenario::short(effect, seed).make().unwrap();
    let stated = DescribedEffects::of(&made.robot);
    let training: [&dyn Recording; 2] = [&made.train, made.repeat.as_ref().unwrap()];
    let context = DiagnosisContext::of(&stated, &training).unwrap();
    let prepared = context.load(&training).unwrap();
    let refit = Refit::of(&context, &prepared.rows).unwrap();
    let source = || {
        context
            .source(&prepared, &context.anchor.values(&refit.before.values))
            .unwrap()
    };
    let search = Search::new(
        source(),
        library(&made.robot, &prepared.runs, &[]),
        Vec::new(),
        2,
    );
    let candidate = Candidate::on(kind, 0);
    let shapes = {
        let mut shapes = [0.0; SHAPES];
        shapes[..made_of.len()].copy_from_slice(made_of);
        shapes
    };
    let made_up = FittedCandidate::unjudged(
        candidate,
        shapes,
        search.source.columns(&candidate, &shapes).unwrap(),
    );
    let rigid = refit.base.rms(0);
    let follower = ObserverModels::new(&context, &prepared, &refit, &search);
    let chosen = follower.followed(&[made_up], &[rigid]).unwrap().unwrap();
    // Where the gear stays open-loop, the observer leaves more.
    let stands = chosen[0].followed.is_some();
    let followed = if stands {
        with(&refit.base, &chosen, None).rms(0)
    } else {
        rigid
    };
    [rigid, followed]
}

/// The torque before a segment, or its initial state, must not pass for a law of the gear within it.
#[test]
fn a_gear_that_is_none_gains_nothing_by_being_followed() {
    let drag = Effect::draw("quadratic_drag", 1.0, 7);
    let soft = (Kind::JointElasticity, &[1000.0, 0.5, 0.25][..]);
    let play = (Kind::Backlash, &[0.006, 2000.0, 8.0, 0.25][..]);
    for (kind, shapes) in [soft, play] {
        for (effect, most) in [(None, 0.02), (drag, 0.05)] {
            let [rigid, followed] = made_up(kind, shapes, effect, 7);
            assert!(
                followed > (1.0 - most) * rigid,
                "{kind:?} {followed} {rigid}"
            );
        }
    }
}
