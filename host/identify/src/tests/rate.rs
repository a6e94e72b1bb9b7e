//! A hold-out with another sample rate than the training data.

use super::arms::arm;
use super::*;
use rig_shared::multibody::inverse_dynamics;

/// Torque outside the model, N·m and rad/s: inside every band here, and outside every band.
const MISSING: [[f64; 2]; 2] = [[0.3, 2.9], [2.0, 70.0]];

/// The same motion for every sample rate, Hz.
fn record(robot: &Robot, rate: f64, phase: f64) -> InMemory {
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let mut block = Block {
        joints: vec![JointColumns::default(); n],
        first_line: 2,
        ..Default::default()
    };
    let mut tau = vec![0.0; n];
    for k in 0..(30.0 * rate) as usize {
        let t = k as f64 / rate;
        let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for j in 0..n {
            for (a, w, p) in [(0.8, 1.1, 0.3), (0.4, 2.7, 1.0), (0.2, 5.1, 2.0)] {
                let w = w + 0.13 * j as f64;
                let (s, c) = (w * t + phase + (j as f64 + 1.0) * p).sin_cos();
                state[0][j] += a * s;
                state[1][j] += a * w * c;
                state[2][j] -= a * w * w * s;
            }
        }
        let [q, qd, qdd] = &state;
        inverse_dynamics(&chain, &robot.standard_parameters(), q, qd, qdd, &mut tau).unwrap();
        block.t.push(t);
        for j in 0..n {
            let missing: f64 = MISSING
                .iter()
                .map(|[a, f]| a * (2.0 * std::f64::consts::PI * f * t + j as f64).sin())
                .sum();
            block.joints[j].q.push(state[0][j]);
            block.joints[j].tau.push(tau[j] + missing);
        }
    }
    InMemory {
        label: format!("at {rate} Hz"),
        blocks: vec![block],
    }
}

/// The same motion has the same error at every sample rate: the band is that of the fit.
#[test]
fn a_holdout_of_another_rate_is_judged_in_the_band_of_the_fit() {
    let robot = arm(2, 3);
    let training = record(&robot, 1000.0, 0.0);
    for model in [ModelKind::Differential, ModelKind::Integral] {
        let found = |rate: f64| {
            let options = Options {
                model,
                estimator: Estimator::Consistent,
                compare: vec![Estimator::Weighted],
                prepare: PrepareOptions {
                    cutoff: Choice::Fixed(60.0),
                    decimation: Choice::Fixed(20),
                    ..Default::default()
                },
                ..Default::default()
            };
            let holdout = record(&robot, rate, 0.7);
            identify(&robot, &[&training], &[&holdout], &options).unwrap()
        };
        let same = found(1000.0);
        let speaks = |found: &Identification| {
            found
                .warnings
                .iter()
                .any(|w| w.to_string().contains("at 1000 Hz"))
        };
        assert!(!speaks(&same), "{:?}", same.warnings);
        for rate in [400.0, 2500.0] {
            let other = found(rate);
            assert!(speaks(&other), "{:?}", other.warnings);
            let errors = |found: &Identification| -> Vec<f64> {
                let comparison = found.comparison.as_ref().unwrap();
                let standard = found.standard_parameters.as_ref().unwrap();
                let fitted = found
                    .joints
                    .iter()
                    .map(|j| j.holdout_relative_error.unwrap());
                fitted
                    .chain(standard.holdout_relative_error.clone().unwrap())
                    .chain(
                        comparison.estimators[0]
                            .holdout_relative_error
                            .clone()
                            .unwrap(),
                    )
                    .collect()
            };
            println!(
                "{model:?} {rate} Hz: {:.4?} {:.4?}",
                errors(&other),
                errors(&same)
            );
            for (a, b) in errors(&other).into_iter().zip(errors(&same)) {
                assert!((a / b - 1.0).abs() < 0.02, "{rate} Hz: {a} for {b}");
            }
        }
    }
}
