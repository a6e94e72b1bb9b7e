#![allow(clippy::unwrap_used, clippy::panic)]
use std::path::Path;

use rig_shared::effects::{Effect, Kind};

use super::controller::regressed;
use super::*;
use rig_data::runs::{JointRun, Run};
use rig_data::sessions::join_sessions;
use rig_model::robot::{Controller, JointFriction, ONE_LINK_TEMPLATE, Robot, RobotEffect};
use rig_model::simulate::{Inputs, Model, closed_loop};

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

/// Records 10 s of the robot under `controllers`. Each joint follows two sines; outer joints are faster.
fn recorded(robot: &Robot, controllers: &[Controller]) -> Run {
    let t: Vec<f64> = (0..10_000).map(|k| k as f64 / RATE).collect();
    let sine = |rate: f64| move |t: &f64| 1.0 - (rate * t).cos();
    let references: Vec<Vec<f64>> = (0..robot.joints.len())
        .map(|j| {
            let (slow, fast) = (sine(2.0 + 0.6 * j as f64), sine(7.0 + 0.9 * j as f64));
            t.iter().map(|t| 0.4 * slow(t) + 0.1 * fast(t)).collect()
        })
        .collect();
    let model = Model::from_robot(robot).unwrap();
    let still = vec![0.0; robot.joints.len()];
    let inputs = Inputs {
        period: 1.0 / RATE,
        reference: &references,
        feed_forward: &[],
        added: &[],
        q: &still,
        v: &still,
        substeps: 4,
        held: true,
    };
    let motion = closed_loop(robot, &model, controllers, &inputs, |_| ()).unwrap();
    let of_joint = |(j, reference): (usize, Vec<f64>)| JointRun {
        q_raw: motion.q[j].clone(),
        q: motion.q[j].clone(),
        qd: motion.qd[j].clone(),
        // Held over the following sample: as in the middle between two samples.
        tau: motion.tau[j].clone(),
        reference: Some(reference),
        ..JointRun::default()
    };
    Run {
        rate: RATE,
        t,
        joints: references.into_iter().enumerate().map(of_joint).collect(),
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

/// Returns the RMS deviation of each simulated joint from the run.
fn off(robot: &Robot, controllers: &[Controller], run: &Run) -> Vec<f64> {
    let model = Model::from_robot(robot).unwrap();
    let q = replayed(robot, &model, controllers, run, 1).unwrap().q;
    let rms = |(q, joint): (&Vec<f64>, &JointRun)| {
        let squares = q.iter().zip(&joint.q).map(|(a, b)| (a - b).powi(2));
        (squares.sum::<f64>() / q.len() as f64).sqrt()
    };
    q.iter().zip(&run.joints).map(rms).collect()
}

#[test]
fn the_true_model_moves_as_recorded_and_a_wrong_one_does_not() {
    let truth = robot(0.4);
    let run = recorded(&truth, &[own()]);
    let mut blind = run.clone();
    blind.joints[0].reference = None;
    let of = |robot: &Robot, run: &Run| of_joints(robot, robot, std::slice::from_ref(run));
    let mut described = truth.clone();
    described.joints[0].controller = Some(own());
    for (robot_of, run, how) in [
        (&described, &run, "the description's own"),
        (&truth, &run, "that the references"),
        (&truth, &blind, "stand-in of 5 Hz"),
    ] {
        let (controllers, told) = of(robot_of, run);
        assert!(told.contains(how), "{told}");
        let [right, wrong] =
            [0.4, 0.6].map(|fc| off(&robot(fc), controllers.as_ref().unwrap(), run)[0]);
        assert!(right < 0.05 * wrong, "{right} {wrong}");
    }
    // A friction error of 0.2 N·m is a position error of 0.2 N·m over the stiffness of 100 N·m/rad.
    let wrong = off(&robot(0.6), &[own()], &run)[0];
    assert!((1.0e-3..3.0e-3).contains(&wrong), "{wrong}");
}

#[test]
fn of_two_joints_the_one_with_wrong_friction_moves_wrongly() {
    let edda = |elbow: f64| {
        let text = include_str!("../../../robots/edda.toml");
        let mut robot = Robot::from_toml(text, Path::new("edda.toml")).unwrap();
        robot.joints[1].friction.as_mut().unwrap().coulomb = elbow;
        robot
    };
    let truth = edda(0.8);
    let own = [300.0, 60.0].map(|kd| Controller {
        position_gain: 20.0,
        velocity_gain: kd,
        torque_gain: 1.0,
    });
    let mut run = recorded(&truth, &own);
    let off_by = |run: &Run, elbow: f64| {
        let (controllers, how) = of_joints(&truth, &truth, std::slice::from_ref(run));
        (off(&edda(elbow), &controllers.unwrap(), run), how)
    };
    let check = |run: &Run| {
        let [(right, how), (wrong, _)] = [0.8, 1.6].map(|elbow| off_by(run, elbow));
        assert!(
            right.iter().all(|r| *r < 0.05 * wrong[1]),
            "{right:?} {wrong:?}"
        );
        assert!(wrong[1] > 3.0 * wrong[0], "{wrong:?}");
        how
    };
    let how = check(&run);
    assert!(
        how.contains("that the references in the recordings show, at each joint"),
        "{how}"
    );
    run.joints[1].reference = None;
    let how = check(&run);
    assert!(
        how.contains("(joint shoulder); a stand-in of 5 Hz"),
        "{how}"
    );
    // Without a torque there is no input.
    run.joints[0].tau.clear();
    let (none, how) = of_joints(&truth, &truth, &[run]);
    assert!(
        none.is_none() && how.contains("joint shoulder is not recorded"),
        "{how}"
    );
}

#[test]
fn a_controller_is_read_off_its_references() {
    let mut run = recorded(&robot(0.4), &[own()]);
    let found = regressed(std::slice::from_ref(&run), 0).unwrap();
    let damping = found.torque_gain * found.velocity_gain;
    assert!((damping - 5.0).abs() < 0.05, "{damping}");
    assert!((damping * found.position_gain - 100.0).abs() < 1.0);
    // References of another motion explain no torque.
    if let Some(reference) = &mut run.joints[0].reference {
        for (r, t) in reference.iter_mut().zip(&run.t) {
            *r = 0.9 * (5.3 * t).sin();
        }
    }
    assert!(regressed(&[run], 0).is_none());
}

/// A recording cut in two by a pause of its clock: the second part starts with the temperature of the end of the first.
#[test]
fn what_goes_on_in_a_session_moves_as_warm_as_it_is() {
    let mut truth = robot(0.4);
    truth.effects.push(RobotEffect {
        joint: None,
        other: None,
        effect: Effect::new(Kind::ViscousWarmupHeat, &[0.5], &[5.0]),
    });
    let whole = recorded(&truth, &[own()]);
    let part = |range: std::ops::Range<usize>| Run {
        began: whole.t[range.start],
        t: whole.t[range.clone()].to_vec(),
        joints: (whole.joints.iter())
            .map(|joint| JointRun {
                q: joint.q[range.clone()].to_vec(),
                qd: joint.qd[range.clone()].to_vec(),
                tau: joint.tau[range.clone()].to_vec(),
                ..JointRun::default()
            })
            .collect(),
        ..whole.clone()
    };
    let half = whole.len() / 2;
    let mut runs = vec![part(0..half), part(half..whole.len())];
    let cold = off(&truth, &[own()], &runs[1])[0];
    join_sessions(&mut runs, &[]);
    assert_eq!(runs[1].began, 0.0);
    let warm = off(&truth, &[own()], &runs[1])[0];
    assert!(warm < 0.05 * cold, "{warm} {cold}");
}
