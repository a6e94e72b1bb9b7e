//! An arm with one joint locked.

use super::arms::{Chance, arm};
use super::*;
use rig_shared::multibody::inverse_dynamics;

/// Sums of sines; joint `locked` stands still and its brake carries an unknown torque.
fn record(robot: &Robot, locked: usize, seed: u64) -> InMemory {
    let mut chance = Chance::new(seed);
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let terms: Vec<Vec<[f64; 3]>> = (0..n)
        .map(|_| {
            (0..4)
                .map(|k| {
                    [
                        0.5 / (1.0 + k as f64),
                        1.1 * (k as f64 + 1.0) + 0.3 * chance.even(),
                        3.0 * chance.even(),
                    ]
                })
                .collect()
        })
        .collect();
    let mut block = Block {
        joints: vec![JointColumns::default(); n],
        first_line: 2,
        ..Default::default()
    };
    let mut tau = vec![0.0; n];
    for k in 0..20_000 {
        let t = k as f64 * 2e-3;
        let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for (j, own) in terms.iter().enumerate() {
            for [a, w, p] in own {
                let (s, c) = (w * t + p).sin_cos();
                state[0][j] += a * s;
                state[1][j] += a * w * c;
                state[2][j] -= a * w * w * s;
            }
        }
        (state[0][locked], state[1][locked], state[2][locked]) = (0.4, 0.0, 0.0);
        inverse_dynamics(
            &chain,
            &robot.standard_parameters(),
            &state[0],
            &state[1],
            &state[2],
            &mut tau,
        )
        .unwrap();
        tau[locked] = 7.0 * (0.3 * t).sin();
        block.t.push(t);
        for j in 0..n {
            let noise = if j == locked {
                0.0
            } else {
                1e-6 * chance.normal()
            };
            block.joints[j].q.push(state[0][j] + noise);
            block.joints[j].tau.push(tau[j] + 0.02 * chance.normal());
        }
    }
    InMemory {
        label: "locked".into(),
        blocks: vec![block],
    }
}

#[test]
fn an_arm_is_identified_beside_a_joint_that_stands_still() {
    let robot = arm(4, 3);
    let mut truth = robot.standard_parameters().concat();
    truth.extend(robot.motor_parameters().concat());
    for locked in [0, 1, 3] {
        let [training, holdout] = [1, 2].map(|seed| record(&robot, locked, seed));
        for estimator in [Estimator::Weighted, Estimator::Ridge, Estimator::Consistent] {
            for model in [ModelKind::Differential, ModelKind::Integral] {
                let options = Options {
                    estimator,
                    model,
                    ..Default::default()
                };
                let found = identify(&robot, &[&training], &[&holdout], &options).unwrap();
                let name = &robot.joints[locked].name;
                assert!(
                    found.warnings.iter().any(|w| w
                        .to_string()
                        .starts_with(&format!("Joint {name} stands still at 0.4"))),
                    "{:?}",
                    found.warnings
                );
                for (j, figures) in found.joints.iter().enumerate() {
                    if j == locked {
                        assert!(
                            figures.train_residual_rms.is_nan()
                                && figures.holdout_residual_rms.is_some_and(f64::is_nan)
                        );
                        continue;
                    }
                    // At the noise level: the low-pass reduces the white noise of 0.02.
                    assert!(
                        figures.holdout_residual_rms.unwrap() < 0.02,
                        "{locked} {estimator:?} {model:?}: {figures:?}"
                    );
                }
                let combination = &found.details.combination;
                let far = (0..combination.nrows()).filter(|&k| {
                    let meant: f64 = combination
                        .row(k)
                        .iter()
                        .zip(&truth)
                        .map(|(k, p)| k * p)
                        .sum();
                    let parameter = &found.base_parameters[k];
                    (parameter.value - meant).abs() > 4.0 * parameter.std
                });
                assert_eq!(far.count(), 0, "{locked} {estimator:?} {model:?}");
                let own = format!("{}", locked + 1);
                for friction in ["fv", "fc", "off", "Ia"] {
                    assert!(
                        found
                            .base_parameters
                            .iter()
                            .all(|p| p.expression != format!("{friction}{own}")),
                        "{friction}{own}"
                    );
                }
                let (described, _) = identified_robot(&robot, &found);
                for (row, joint) in described.standard_parameters().iter().zip(&robot.joints) {
                    assert!(
                        row[10] < 10.0,
                        "drive inertia {} of {}",
                        row[10],
                        joint.name
                    );
                }
            }
        }
    }
}

#[test]
fn a_recording_in_which_nothing_moves_is_refused() {
    let robot = arm(2, 3);
    let mut still = record(&robot, 0, 1);
    still.blocks[0].joints[1].q.fill(0.2);
    let said = identify(&robot, &[&still], &[], &Options::default())
        .unwrap_err()
        .to_string();
    assert!(said.contains("no other joint moves"), "{said}");
}

/// An unused joint has no error, and the mean of errors covers the joints that have one.
#[test]
fn a_joint_that_stands_still_is_no_perfect_prediction() {
    let robot = arm(3, 3);
    let options = Options {
        compare: vec![Estimator::Weighted, Estimator::Consistent],
        ..Default::default()
    };
    let found = identify(&robot, &[&record(&robot, 1, 1)], &[], &options).unwrap();
    let comparison = found.comparison.unwrap();
    for row in &comparison.estimators {
        let errors = row.cross_validated_relative_error.as_ref().unwrap();
        assert!(
            errors[1].is_nan() && errors[0] > 0.0 && errors[2] > 0.0,
            "{errors:?}"
        );
    }
    assert!(
        !comparison.recommendation.contains("0.00 %"),
        "{}",
        comparison.recommendation
    );
}

/// A gear that twists under a brake: the motor encoder moves, the joint does not.
#[test]
fn a_joint_that_only_creeps_is_said_and_nothing_of_it_recommended() {
    let robot = arm(3, 3);
    let mut creeping = record(&robot, 1, 1);
    let block = &mut creeping.blocks[0];
    let torque = block.joints[1].tau.clone();
    for (q, tau) in block.joints[1].q.iter_mut().zip(&torque) {
        *q += tau / 2e4;
    }
    let moving = record(&robot, 0, 2);
    let options = Options {
        compare: vec![Estimator::Weighted],
        ..Default::default()
    };
    let found = identify(&robot, &[&creeping], &[&moving], &options).unwrap();
    let said = format!("Joint {} moves by 0.00", robot.joints[1].name);
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.to_string().starts_with(&said)),
        "{:?}",
        found.warnings
    );
    let recommendation = found.comparison.unwrap().recommendation;
    let nothing = format!("Trust nothing of {}", robot.joints[1].name);
    assert!(recommendation.contains(&nothing), "{recommendation}");
}

#[test]
fn a_joint_that_moves_by_its_encoder_s_noise_alone_is_said_to_stand_still() {
    let robot = arm(4, 3);
    let mut chance = Chance::new(5);
    let mut training = record(&robot, 2, 1);
    for q in &mut training.blocks[0].joints[2].q {
        *q += 2e-6 * chance.normal();
    }
    let found = identify(&robot, &[&training], &[], &Options::default()).unwrap();
    let name = &robot.joints[2].name;
    let own: Vec<String> = (found.warnings.iter())
        .map(ToString::to_string)
        .filter(|w| w.starts_with(&format!("Joint {name}")))
        .collect();
    let words = format!(
        "Joint {name} stands still in the training data but for the noise of its encoder: no row is faster than "
    );
    assert!(
        own.iter()
            .any(|w| w.starts_with(&words) && w.contains(" rad/s")),
        "{own:?}"
    );
    assert!(
        own.iter()
            .all(|w| !w.contains("--min-speed") && !w.contains("0.0000")),
        "{own:?}"
    );
}

#[test]
fn a_finger_without_torque_that_stands_still_may_be_fixed() {
    let robot = arm(2, 3);
    let mut finger = record(&robot, 1, 1);
    finger.blocks[0].joints[1].tau.fill(0.0);
    let said = |recording: &InMemory| {
        let found = identify(&robot, &[recording], &[], &Options::default());
        found.unwrap_err().to_string()
    };
    assert!(
        said(&finger).contains("type=\"fixed\" in a URDF"),
        "{}",
        said(&finger)
    );
    let mut moving = record(&robot, 0, 1);
    moving.blocks[0].joints[1].tau.fill(0.0);
    assert!(!said(&moving).contains("fixed"), "{}", said(&moving));
}
