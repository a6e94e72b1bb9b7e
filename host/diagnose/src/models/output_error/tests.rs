#![allow(clippy::unwrap_used)]

use crate::tests::made::Diagnosed as _;
use rand::{RngExt, SeedableRng};

use crate::description::described_effects::DescribedEffects;
use crate::fit::refit::Refit;
use crate::models::output_error::*;
use crate::recordings::context::DiagnosisContext;
use crate::{Diagnosis, Options};
use rig_data::prepare::Recording;
use rig_scenario::{Effect, Made, Scenario};

const ASYMMETRIC: Effect = Effect::AsymmetricCoulomb { difference: 0.2 };

fn diagnosed(made: &Made) -> Diagnosis {
    made.diagnosed(&made.robot, &Options::default()).0
}

fn of<'d>(found: &'d Diagnosis, parameter: &str) -> &'d Twice {
    let list = &found.by_motion.as_ref().unwrap().parameters;
    list.iter().find(|p| p.parameter == parameter).unwrap()
}

#[test]
fn torque_and_motion_agree_where_the_model_is_right() {
    let made = Scenario::short([ASYMMETRIC], 61).make().unwrap();
    let found = diagnosed(&made);
    let again = found.by_motion.as_ref().unwrap();
    println!("{again:#?}");
    assert!(!again.adopted);
    assert!(again.motion_rms[1] <= again.motion_rms[0]);
    assert!(again.parameters.iter().all(|p| p.sigmas < APART));
    assert!(
        found
            .words
            .iter()
            .any(|w| w.contains("of their standard deviations"))
    );
    let truth = &made.truth.nominal;
    for (name, truth) in [("fv1", truth["viscous"]), ("fc1", truth["coulomb"])] {
        let p = of(&found, name);
        let off = (p.motion - truth).abs();
        assert!(
            off < 4.0 * p.motion_std + 0.01 * truth,
            "{name}: {p:?}, {truth}"
        );
    }
    // The effect's own value, half the difference between directions.
    let p = of(&found, "asymmetric_coulomb.asymmetry");
    assert!(
        (p.motion.abs() / (0.1 * truth["coulomb"]) - 1.0).abs() < 0.05,
        "{p:?}"
    );
}

/// Position noise is in the torque's regressors and in no simulated motion.
#[test]
fn a_noisy_position_costs_the_motion_less_than_the_torque() {
    let mut made = Scenario::short([ASYMMETRIC], 62).make().unwrap();
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(62);
    let repeat = made.repeat.as_mut().unwrap();
    for recording in [&mut made.train, repeat, &mut made.holdout] {
        for q in recording.blocks.iter_mut().flat_map(|b| &mut b.joints[0].q) {
            let spread: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
            *q += 2e-3 * spread;
        }
    }
    let found = diagnosed(&made);
    println!("{:#?}", found.by_motion);
    // The noise is white, so the position's spectrum shows the motion's frequency, which the cut-off does not change.
    let treated = found.treatment.as_ref().unwrap();
    let why = &treated.position_cutoff_why;
    assert!(
        treated.position_cutoff > 4.9 * treated.motion_frequency,
        "{why}"
    );
    for name in ["Izz1 + Ia1", "fv1", "fc1"] {
        let p = of(&found, name);
        assert!(p.motion_std < 0.7 * p.torque_std, "{p:?}");
    }
    let p = of(&found, "Izz1 + Ia1");
    assert!(
        (p.motion / made.truth.nominal["inertia"] - 1.0).abs() < 0.01,
        "{p:?}"
    );
}

/// Wrong values return to those of the torque and are adopted: the motion improves by far, and the torque too.
#[test]
fn values_that_are_off_are_mended_by_the_motion() {
    let made = Scenario::short([], 63).make().unwrap();
    let stated = DescribedEffects::of(&made.robot);
    let training: [&dyn Recording; 2] = [&made.train, made.repeat.as_ref().unwrap()];
    let context = DiagnosisContext::of(&stated, &training).unwrap();
    let prepared = context.load(&training).unwrap();
    let refit = Refit::of(&context, &prepared.rows).unwrap();
    let values = context.anchor.values(&refit.before.values);
    let source = context.source(&prepared, &values).unwrap();
    let fitting = ModelCache::new(&context, &refit, &prepared.runs, &values);
    let replay = Replay::of(&fitting, &prepared).unwrap();
    let pairs = crate::recordings::noise_floor::repeats(&prepared.runs);
    let right = refit.joint(&source, &[], &pairs, &[Vec::new()]).unwrap();
    let mut off = refit.joint(&source, &[], &pairs, &[Vec::new()]).unwrap();
    for value in &mut off.solution.values {
        *value *= 1.03;
    }
    let again = by_motion(&fitting, &replay, &source, &[], &off, 2)
        .unwrap()
        .unwrap();
    println!("{:#?}", again.told);
    let (standing, _) = again.adopted.unwrap();
    assert!(again.told.adopted);
    assert!(again.told.torque_rms[1] < again.told.torque_rms[0]);
    let mended = standing.coefficients(&context.anchor);
    for (k, (mended, right)) in mended.iter().zip(&right.solution.values).enumerate() {
        assert!(
            (mended / right - 1.0).abs() < 0.01,
            "{k}: {mended}, {right}"
        );
    }
    // Nothing is adopted, as expected.
    let same = by_motion(&fitting, &replay, &source, &[], &right, 2)
        .unwrap()
        .unwrap();
    assert!(same.adopted.is_none());
}

/// A described effect is never refused; a motion that is too short to say refuses nothing.
#[test]
fn the_likeliest_nothing_among_the_found_effects_is_told() {
    let p_values = [Some(0.9), Some(0.3), None, Some(0.7), Some(0.01)];
    assert_eq!(most_likely_zero(&p_values, 0), Some(0));
    assert_eq!(most_likely_zero(&p_values, 1), Some(3));
    assert_eq!(most_likely_zero(&p_values, 4), None);
    assert_eq!(most_likely_zero(&[Some(0.9), None], 1), None);
}
