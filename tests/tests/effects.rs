//! Effects beyond the standard model, hidden in the plant and told to the rig over the wire.
#![allow(clippy::unwrap_used, clippy::panic)]

use rig_host::link::LinkError;
use rig_host::plant::PlantConfig;
use rig_host::plant::effect::cogging::Cogging;
use rig_host::plant::effect::gear_eccentricity::GearEccentricity;
use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::{SlowReversals, Trajectory};
use rig_shared::wire::message::{Refusal, RequestBody};
use rig_tests::{
    Line, calibrated, cogging_of, connect, driven, excitation, nameplate, periodic, truth_of,
};

/// A rig with this plant, calibrated, told where it hangs and what its model is, friction precompensated.
fn told(plant: &PlantConfig, seed: u64) -> Line {
    let nameplate = nameplate(plant);
    let mut line = connect(&nameplate, plant.clone(), seed);
    calibrated(&mut line);
    line.request(RequestBody::SetPosition(plant.initial_position as f32))
        .unwrap();
    let mut precompensation = nameplate.settings.precompensation;
    precompensation.enabled = true;
    for body in truth_of(plant) {
        line.request(body).unwrap();
    }
    line.request(RequestBody::SetPrecompensation(precompensation))
        .unwrap();
    line
}

fn set(effects: &[Effect<f32>]) -> Vec<RequestBody> {
    vec![RequestBody::SetEffects(effects.iter().copied().collect())]
}

fn reversals() -> Trajectory<f32> {
    Trajectory::SlowReversals(SlowReversals::new(0.05_f32, 0.1, &[0.2, 0.1], 2).unwrap())
}

/// RMS tracking error without and with the effects, mrad.
fn tracking(plant: &PlantConfig, seed: u64, effects: &[Effect<f32>]) -> [f64; 2] {
    let mut line = told(plant, seed);
    [&[], effects].map(|effects| {
        let run = driven(&mut line, set(effects), reversals(), 0.2);
        assert!(run.faults.is_empty(), "{:?}", run.faults);
        1e3 * run.tracking_rms(0.0, f64::MAX)
    })
}

#[test]
fn hidden_cogging_and_eccentricity_are_compensated_once_they_are_named() {
    for seed in 1..=3 {
        let bare = PlantConfig::laboratory(seed);
        let cogging = Cogging {
            amplitude: 0.006,
            order: 12.0,
            phase: 0.7,
        };
        let mut plant = bare.clone();
        plant.motor.cogging = Some(cogging);
        let [before, after] = tracking(&plant, seed, &[cogging_of(&plant)]);
        println!("seed {seed}, cogging: {before:.3} mrad without, {after:.3} with");
        assert!(after < before / 2.0, "{before} to {after} mrad");

        let mut plant = bare;
        plant.mechanism.eccentricity = Some(GearEccentricity {
            amplitude: 0.4,
            order: 2.0,
            phase: -1.1,
        });
        let named = periodic(0.4, 2.0, -1.1);
        let [before, after] = tracking(&plant, seed, &[named]);
        println!("seed {seed}, eccentricity: {before:.3} mrad without, {after:.3} with");
        assert!(after < before / 2.0, "{before} to {after} mrad");
    }
}

#[test]
fn the_on_line_estimator_does_not_see_what_effects_explain() {
    let seed = 5;
    let mut plant = PlantConfig::laboratory(seed);
    plant.mechanism.eccentricity = Some(GearEccentricity {
        amplitude: 0.4,
        order: 2.0,
        phase: -1.1,
    });
    let mut line = told(&plant, seed);
    let mut rms = |effects: &[Effect<f32>]| {
        let run = driven(&mut line, set(effects), excitation(5, 5, 4), 0.3);
        assert!(run.faults.is_empty(), "{:?}", run.faults);
        let estimate = run.estimate();
        assert_eq!(estimate.trusted, [true; 6]);
        f64::from(estimate.residual_rms)
    };
    let (without, with) = (rms(&[]), rms(&[periodic(0.4, 2.0, -1.1)]));
    println!("residual {without:.4} N·m without, {with:.4} with");
    assert!(with < without / 3.0, "{without} to {with} N·m");
}

#[test]
fn what_cannot_be_compensated_is_refused_by_name_and_changes_nothing() {
    let plant = PlantConfig::laboratory(1);
    let mut line = told(&plant, 1);
    let good = periodic(0.1, 2.0, 0.0);
    line.request(set(&[good]).remove(0)).unwrap();
    let before = *line.port().device().state().settings();
    let play = Effect::new(Kind::Backlash, &[], &[0.01, 5e3, 5.0, 0.5]);
    let error = line.request(set(&[good, play]).remove(0)).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("(the effect `backlash`): it acts between motor and link"),
        "{error}"
    );
    assert!(matches!(
        error,
        LinkError::Refused {
            refusal: Refusal::NotCompensable(Kind::Backlash),
            ..
        }
    ));
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut effect = good;
        effect.gains[0] = wrong;
        assert!(matches!(
            line.request(set(&[effect]).remove(0)),
            Err(LinkError::Refused {
                refusal: Refusal::BadValue,
                ..
            })
        ));
    }
    assert_eq!(*line.port().device().state().settings(), before);
}
