//! The EMPS recordings against their published values.

use super::*;

/// Opens the robot and a recording; prints a note and returns None if the recordings are missing.
fn emps(file: &str) -> Option<(Robot, rig_data::Source)> {
    let Some(folder) = rig_output::data_dir() else {
        println!("SKIPPED: the folder of real recordings is not there; set RIG_DATA to it.");
        return None;
    };
    let robot =
        Robot::load(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/emps.toml"))
            .unwrap();
    let source = rig_data::Source::open(&folder.join("emps").join(file), &robot).unwrap();
    Some((robot, source))
}

fn published() -> Options {
    Options {
        prepare: PrepareOptions {
            cutoff: Choice::Fixed(100.0),
            decimation: Choice::Fixed(10),
            speed_threshold: Choice::Fixed(0.0),
            ..Default::default()
        },
        ..Default::default()
    }
}

/// Janot, Gautier & Brunot 2019: kg, N·s/m, N, N.
const PUBLISHED: [f64; 4] = [95.1089, 203.5034, 20.3935, -3.1648];

fn assert_near(found: &Identification, expected: &[f64], percent: f64) {
    assert_eq!(found.base_parameters.len(), expected.len());
    for (b, e) in found.base_parameters.iter().zip(expected) {
        let off = 100.0 * (b.value / e - 1.0).abs();
        assert!(
            off < percent,
            "{}: {} is {off:.2} % off {e}",
            b.expression,
            b.value
        );
    }
}

#[test]
fn emps_with_the_published_processing_gives_the_published_values() {
    let (Some((robot, train)), Some((_, test))) = (emps("train.csv"), emps("test_pulses.csv"))
    else {
        return;
    };
    let found = identify(&robot, &[&train], &[&test], &published()).unwrap();
    show("published processing", &found);
    let names: Vec<_> = found
        .base_parameters
        .iter()
        .map(|b| b.expression.as_str())
        .collect();
    assert_eq!(names, ["m1 + Ia1", "fv1", "fc1", "off1"]);
    assert_near(&found, &PUBLISHED, 0.5);
    // Relative standard deviations and condition number of an independent repetition.
    for (b, percent) in found.base_parameters.iter().zip([0.11, 0.56, 0.49, 1.39]) {
        assert!(
            (b.classical_relative_std_percent - percent).abs() < 0.02,
            "{b:?}"
        );
        assert!(
            b.relative_std_percent > percent,
            "residuals are correlated: {b:?}"
        );
    }
    assert!((found.condition_number - 26.0).abs() < 0.5);
    assert!((found.joints[0].train_relative_error - 0.0404).abs() < 5e-4);
    assert!(found.not_excited.is_empty());
    let refit = identify(&robot, &[&test], &[], &published()).unwrap();
    show("published processing, pulse recording", &refit);
    assert_near(&refit, &[94.06, 210.3, 20.87, -3.21], 0.5);
}

/// If the pulses were a force beside `tau1`, adding them, in the unit of the force or of the controller's output, would
/// reduce the residual. It increases the residual.
#[test]
fn emps_pulses_are_no_force_beside_the_measured_one() {
    let Some((robot, test)) = emps("test_pulses.csv") else {
        return;
    };
    let (blocks, _) = test.read_all().unwrap();
    let rms = |gain: f64| {
        let mut blocks = blocks.clone();
        for block in &mut blocks {
            let pulses = block
                .extra
                .iter()
                .find(|(name, _)| name == "pulses")
                .unwrap()
                .1
                .clone();
            for (tau, pulse) in block.joints[0].tau.iter_mut().zip(pulses) {
                *tau += gain * pulse;
            }
        }
        let recording = InMemory {
            label: "pulses".into(),
            blocks,
        };
        identify(&robot, &[&recording], &[], &published())
            .unwrap()
            .joints[0]
            .train_residual_rms
    };
    let alone = rms(0.0);
    for gain in [1.0, -1.0, 35.1507, -35.1507] {
        println!("gain {gain}: {:.4} against {alone:.4}", rms(gain));
        assert!(rms(gain) > 1.1 * alone);
    }
}

#[test]
fn emps_with_the_defaults_both_models_agree() {
    let (Some((robot, train)), Some((_, test))) = (emps("train.csv"), emps("test_pulses.csv"))
    else {
        return;
    };
    let run = |model, estimator| {
        let options = Options {
            model,
            estimator,
            ..Default::default()
        };
        let found = identify(&robot, &[&train], &[&test], &options).unwrap();
        show(&format!("defaults {model:?} {estimator:?}"), &found);
        for d in &found.details.train[0].dependence {
            println!("   {}", d.text);
        }
        println!(
            "   {} {}",
            found.details.train[0].whiteness, found.details.train[0].normality
        );
        found
    };
    let differential = run(ModelKind::Differential, Estimator::Weighted);
    let integral = run(ModelKind::Integral, Estimator::Weighted);
    assert_near(&differential, &PUBLISHED, 2.0);
    assert_near(&integral, &PUBLISHED, 2.0);
    for k in 0..4 {
        let (a, b) = (
            &differential.base_parameters[k],
            &integral.base_parameters[k],
        );
        assert!(
            differential.details.estimate.covers(k, b.value),
            "{a:?} {b:?}"
        );
        assert!(integral.details.estimate.covers(k, a.value), "{a:?} {b:?}");
    }
    for found in [&differential, &integral] {
        let j = &found.joints[0];
        assert!(j.holdout_relative_error.unwrap() < 0.08, "{j:?}");
    }
    run(ModelKind::Differential, Estimator::Robust);
    run(ModelKind::Integral, Estimator::Robust);
    let json = serde_json::to_value(&differential).unwrap();
    for key in [
        "schema",
        "robot",
        "model",
        "estimator",
        "rank",
        "condition_number",
        "base_parameters",
        "joints",
        "not_excited",
        "warnings",
    ] {
        assert!(json.get(key).is_some(), "{key}");
    }
    assert_eq!(json["schema"], "rig-identification/1");
    assert_eq!(json["model"], "differential");
}

/// Simulated closed loop of the identified model: instrumental variables and output error agree with the published
/// values; output error uses only reference and torque.
#[test]
fn emps_by_instrumental_variables_and_output_error() {
    let (Some((robot, train)), Some((_, test))) = (emps("train.csv"), emps("test_pulses.csv"))
    else {
        return;
    };
    for estimator in [Estimator::Iv, Estimator::OutputError] {
        for recording in [&train, &test] {
            let options = Options {
                estimator,
                ..published()
            };
            let found = identify(&robot, &[recording], &[], &options).unwrap();
            show(&format!("{estimator:?}"), &found);
            println!("   {:?} {:?}", found.procedure, found.warnings);
            assert!(
                found
                    .warnings
                    .iter()
                    .all(|w| !w.to_string().contains("settled"))
            );
            let expected = if std::ptr::eq(recording, &train) {
                PUBLISHED
            } else {
                // Least-squares values of this recording, also given in the file with the data.
                [94.06, 210.3, 20.87, -3.21]
            };
            assert_near(&found, &expected, 3.0);
        }
    }
}
