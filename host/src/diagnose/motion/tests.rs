#![allow(clippy::unwrap_used, clippy::panic)]
use std::path::Path;

use super::*;
use crate::diagnose::runs::JointRun;
use crate::robot::{JointFriction, ONE_LINK_TEMPLATE};

const RATE: f64 = 1000.0;

fn robot(coulomb: f64) -> Robot {
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
    robot.joints[0].friction = Some(JointFriction {
        coulomb,
        viscous: 0.3,
        offset: 0.0,
    });
    robot
}

/// 10 s of the robot under `controller`, as it would be recorded.
fn recorded(robot: &Robot, controller: &Controller) -> Run {
    let t: Vec<f64> = (0..10_000).map(|k| k as f64 / RATE).collect();
    let reference: Vec<f64> = (t.iter())
        .map(|t| 0.4 * (1.0 - (2.0 * t).cos()) + 0.1 * (1.0 - (7.0 * t).cos()))
        .collect();
    let model = Model::from_robot(robot).unwrap();
    let motion = closed_loop(
        robot,
        &model,
        std::slice::from_ref(controller),
        &Inputs {
            period: 1.0 / RATE,
            reference: std::slice::from_ref(&reference),
            added: &[],
            q: &[0.0],
            v: &[0.0],
            substeps: 4,
        },
        |_| (),
    )
    .unwrap();
    Run {
        rate: RATE,
        t,
        joints: vec![JointRun {
            q_raw: motion.q[0].clone(),
            q: motion.q[0].clone(),
            qd: motion.qd[0].clone(),
            // Held over the sample after it: as in the middle between two.
            tau: motion.tau[0].clone(),
            reference: Some(reference),
            ..JointRun::default()
        }],
        ..Run::default()
    }
}

fn own() -> Controller {
    Controller {
        position_gain: 20.0,
        velocity_gain: 5.0,
        torque_gain: 1.0,
    }
}

fn off(robot: &Robot, controller: &Controller, run: &Run) -> f64 {
    let model = Model::from_robot(robot).unwrap();
    let q = replayed(robot, &model, controller, run).unwrap();
    let errors = q.iter().zip(&run.joints[0].q).map(|(a, b)| (a - b).powi(2));
    (errors.sum::<f64>() / q.len() as f64).sqrt()
}

#[test]
fn the_true_model_moves_as_recorded_and_a_wrong_one_does_not() {
    let truth = robot(0.4);
    let run = recorded(&truth, &own());
    let stand_in = stand_in(&truth, std::slice::from_ref(&run)).unwrap();
    for controller in [own(), stand_in] {
        let [right, wrong] = [0.4, 0.6].map(|fc| off(&robot(fc), &controller, &run));
        assert!(right < 0.05 * wrong, "{right} {wrong}");
    }
    // Friction too high by 0.2 N·m is a position error of 0.2 N·m over the stiffness of 100 N·m/rad.
    let wrong = off(&robot(0.6), &own(), &run);
    assert!((1.0e-3..3.0e-3).contains(&wrong), "{wrong}");
}

#[test]
fn a_controller_is_read_off_its_references() {
    let mut run = recorded(&robot(0.4), &own());
    let found = regressed(std::slice::from_ref(&run)).unwrap();
    let damping = found.torque_gain * found.velocity_gain;
    assert!((damping - 5.0).abs() < 0.05, "{damping}");
    assert!((damping * found.position_gain - 100.0).abs() < 1.0);
    // References of another motion explain no torque.
    if let Some(reference) = &mut run.joints[0].reference {
        for (r, t) in reference.iter_mut().zip(&run.t) {
            *r = 0.9 * (5.3 * t).sin();
        }
    }
    assert!(regressed(&[run]).is_none());
}

#[test]
fn worse_is_what_block_after_block_says() {
    let errors = |blocks: &[f64]| Errors(blocks.iter().map(|s| [*s, 100.0]).collect());
    let before = errors(&[1.0, 1.2, 0.9, 1.1, 1.0, 1.0]);
    assert!(errors(&[1.5, 1.8, 1.4, 1.6, 1.5, 1.6]).worse_than(&before));
    assert!(!errors(&[0.5, 0.6, 0.4, 0.5, 0.5, 0.5]).worse_than(&before));
    // One bad block is chance.
    assert!(!errors(&[1.0, 1.2, 0.9, 4.1, 1.0, 1.0]).worse_than(&before));
}
