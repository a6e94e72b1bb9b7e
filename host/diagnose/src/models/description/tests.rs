//! The written description equals the fit.

#![allow(clippy::unwrap_used)]

use crate::tests::made::Diagnosed as _;
use std::path::Path;

use rig_shared::effects::Kind;

use crate::recordings::context::treatment_of;
use crate::{Diagnosis, Options};
use rig_data::prepare::{Choice, PrepareOptions, Recording};
use rig_model::robot::Robot;
use rig_scenario::{Effect, Hidden, Made, Scenario};
use rig_validate::{Options as Checks, validate};

fn found(effect: Effect, seed: u64) -> (Made, Diagnosis, Robot) {
    let hidden = Hidden { joint: 0, effect };
    let made = Scenario {
        seconds: [40.0, 20.0],
        ..Scenario::new(vec![hidden], seed)
    }
    .make()
    .unwrap();
    let options = Options {
        // A torque check does not include these.
        without: vec![Kind::Backlash, Kind::JointElasticity],
        ..Options::default()
    };
    let (diagnosis, model) = made.diagnosed(&made.robot, &options);
    // As read from the file.
    let text = model.to_toml().unwrap();
    let read = Robot::from_toml(&text, Path::new("model.toml")).unwrap();
    assert_eq!(read, model);
    (made, diagnosis, read)
}

/// RMS of the torque residual over the training recordings, filtered and thinned as the diagnosis does.
fn left(robot: &Robot, made: &Made) -> f64 {
    let recordings: [&dyn Recording; 2] = [&made.train, made.repeat.as_ref().unwrap()];
    let treatment = treatment_of(&recordings, robot).unwrap();
    let checks = Checks {
        most_samples: 100,
        prepare: PrepareOptions {
            decimation: Choice::Fixed(treatment.decimation),
            ..PrepareOptions::default()
        },
        ..Checks::default()
    };
    let result = validate(robot, &recordings, &checks, &mut |_| ()).unwrap();
    let squares: f64 = (result.recordings.iter())
        .map(|r| r.torque[0].residual.rms.powi(2))
        .sum();
    (0.5 * squares).sqrt()
}

/// Returns the RMS residual of a description without a refit, on the diagnosis' rows.
fn frozen(robot: &Robot, made: &Made) -> f64 {
    let (found, _) = made.diagnosed(robot, &Options::default());
    found.waterfall[0].train[0]
}

#[test]
fn the_description_predicts_what_the_fit_does_with_weakening_friction() {
    let effect = Effect::Stribeck {
        ratio: 1.7,
        velocity: 0.1,
    };
    let (made, diagnosis, model) = found(effect, 3);
    let names: Vec<&str> = diagnosis.steps.iter().map(|s| s.effect.as_str()).collect();
    assert_eq!(names, ["stribeck"]);
    assert_eq!(model.effects.len(), 1);
    let [before, after] = diagnosis.steps[0].train_rms;
    let own = left(&model, &made);
    // The description, read again, leaves what the fit left. The torque check also counts samples near standstill.
    let again = frozen(&model, &made);
    assert!((again / after - 1.0).abs() < 1e-3, "{again} {after}");
    assert!(own > after, "{own} {after}");
    assert!(own < 0.7 * before, "{own} {before}");
    assert!(left(&made.robot, &made) > 1.3 * own);
}

#[test]
fn a_tilted_base_is_gravity_turned() {
    let effect = Effect::GravityTilt { angle: 0.08 };
    let (made, diagnosis, model) = found(effect, 5);
    let names: Vec<&str> = diagnosis.steps.iter().map(|s| s.effect.as_str()).collect();
    assert_eq!(names, ["gravity_tilt"]);
    assert!(model.effects.is_empty());
    let turned = |g: [f64; 3], h: [f64; 3]| {
        let dot: f64 = g.iter().zip(&h).map(|(a, b)| a * b).sum();
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        (dot / (length(g) * length(h))).acos()
    };
    let angle = turned(model.gravity, made.robot.gravity);
    assert!((angle - 0.08).abs() < 0.01, "{angle}");
    let pull = (diagnosis.absorbed.iter()).find(|a| a.parameter.starts_with("m*g*l"));
    let pull = pull.unwrap();
    assert_eq!(pull.unit, "N*m");
    let truth = made.truth.nominal["gravity"];
    assert!((pull.after / truth - 1.0).abs() < 0.03, "{pull:?} {truth}");
    let [_, after] = diagnosis.steps[0].train_rms;
    let own = left(&model, &made);
    // The diagnosis leaves out the samples near rests, which this includes: 9 % …
    assert!((own / after - 1.0).abs() < 0.1, "{own} {after}");
    // … unlike the diagnosis of the resulting description.
    let again = frozen(&model, &made);
    assert!((again / after - 1.0).abs() < 1e-3, "{again} {after}");
    assert!(left(&made.robot, &made) > 1.3 * own);
}
