//! Interpretation of a difference between least squares and instrumental variables, on simulated arms with drives.

use super::arms::Chance;
use super::*;
use rig_model::robot::JointLimits;
use rig_model::simulate::{Inputs, Model, closed_loop, controllers};

/// Duration, s, and rate, Hz.
const LENGTH: (f64, f64) = (25.0, 400.0);

pub(super) fn shipped(file: &str) -> Robot {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    Robot::load(&folder.join(file)).unwrap()
}

/// Four sines per joint within half of its limits.
fn reference(limits: &JointLimits, chance: &mut Chance, pace: f64) -> Vec<f64> {
    let [lower, upper] = limits.position;
    let waves: Vec<[f64; 3]> = (1..5)
        .map(|k| {
            let w = 0.7 * pace * (f64::from(k) + 0.3 * chance.even());
            let mut size = (0.5 * (upper - lower)).min(limits.velocity / w);
            if let Some(acceleration) = limits.acceleration {
                size = size.min(acceleration / (w * w));
            }
            [size / 8.0, w, 3.0 * chance.even()]
        })
        .collect();
    let (seconds, rate) = LENGTH;
    let instants = (0..(seconds / pace * rate) as usize).map(|i| i as f64 / rate);
    instants
        .map(|t| {
            let moved = waves.iter().map(|[a, w, p]| a * (w * t + p).sin());
            0.5 * (lower + upper) + moved.sum::<f64>()
        })
        .collect()
}

/// Conditions of a recording.
pub(super) struct Drive {
    /// Speed, 1 for [`LENGTH`].
    pub pace: f64,
    /// Noise of the position, rad.
    pub position: f64,
    /// Noise of the torque, as a share of each joint's limit.
    pub torque: f64,
    /// True if the controllers hold their torque between samples.
    pub held: bool,
}

/// The robot with its controllers, and a recording of it.
pub(super) fn driven(mut robot: Robot, seed: u64, drive: &Drive) -> (Robot, InMemory) {
    let &Drive {
        pace,
        position,
        torque,
        held,
    } = drive;
    let mut chance = Chance::new(seed);
    let limits: Vec<JointLimits> = (robot.joints.iter())
        .map(|joint| joint.limits.clone().unwrap())
        .collect();
    let reference: Vec<Vec<f64>> = (limits.iter())
        .map(|limits| reference(limits, &mut chance, pace))
        .collect();
    let model = Model::from_robot(&robot).unwrap();
    let q: Vec<f64> = reference.iter().map(|joint| joint[0]).collect();
    let v = vec![0.0; q.len()];
    let (list, _) = controllers(&robot, &model, &q).unwrap();
    for (joint, controller) in robot.joints.iter_mut().zip(&list) {
        joint.controller = Some(controller.clone());
    }
    let inputs = Inputs {
        period: 1.0 / LENGTH.1,
        reference: &reference,
        feed_forward: &[],
        added: &[],
        q: &q,
        v: &v,
        substeps: 2,
        held,
    };
    let mut motion = closed_loop(&robot, &model, &list, &inputs, |_| ()).unwrap();
    let mut disturb = |list: &mut [f64], size: f64| {
        list.iter_mut().for_each(|x| *x += size * chance.normal());
    };
    for (j, limits) in limits.iter().enumerate() {
        disturb(&mut motion.q[j], position);
        disturb(&mut motion.tau[j], torque * limits.torque.unwrap());
    }
    let recording = InMemory {
        label: format!("driven {seed}"),
        blocks: vec![Block::of_motion(motion, inputs.period, &reference)],
    };
    (robot, recording)
}

fn compared(robot: &Robot, recording: &InMemory, prepare: PrepareOptions) -> Comparison {
    let options = Options {
        estimator: Estimator::for_robot(robot),
        prepare,
        compare: vec![Estimator::Weighted, Estimator::Iv, Estimator::Consistent],
        ..Default::default()
    };
    let found = identify(robot, &[recording], &[], &options).unwrap();
    let comparison = found.comparison.unwrap();
    let said = comparison.endogeneity.as_ref().unwrap();
    println!(
        "{}: {:?} p {:.1e} shift {:.3}: {}\n   {}",
        robot.name, said.verdict, said.p_value, said.shift, said.text, comparison.recommendation
    );
    comparison
}

/// Arms with exact positions and torque noise of 0.4 % or almost none. A difference of instrumental variables from
/// least squares is then not position noise, whether the instruments come from the loop or from the reference.
#[test]
fn exact_positions_bias_nothing() {
    for (file, seeds) in [("edda.toml", 6), ("irp6.toml", 3)] {
        for seed in 0..seeds {
            for torque in [4e-3, 1e-5] {
                let (mut robot, recording) = driven(
                    shipped(file),
                    seed,
                    &Drive {
                        pace: 1.0,
                        position: 0.0,
                        torque,
                        held: true,
                    },
                );
                let found = compared(&robot, &recording, PrepareOptions::default());
                let verdict = found.endogeneity.unwrap().verdict;
                assert_ne!(verdict, Verdict::Biased, "{file} {seed} {torque}");
                assert_ne!(found.recommended, Estimator::Iv, "{file} {seed} {torque}");
                if seed > 1 {
                    continue;
                }
                robot.joints.iter_mut().for_each(|j| j.controller = None);
                let found = compared(&robot, &recording, PrepareOptions::default());
                // The loop lags by more than a fiftieth, so its reference is no instrument.
                let verdict = found.endogeneity.unwrap().verdict;
                assert_eq!(verdict, Verdict::Undecided, "{file} {seed} {torque}");
                assert_ne!(found.recommended, Estimator::Iv, "{file} {seed} {torque}");
            }
        }
    }
}
