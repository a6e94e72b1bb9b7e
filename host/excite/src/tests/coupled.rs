//! Enclosures of the torques of coupled motors beside their largest samples, on the IRp-6.

use rand::{RngExt, SeedableRng};
use rig_model::robot::{IRP6_TEMPLATE, MotorLimits};
use rig_shared::multibody::Chain;

use super::*;
use crate::certificate::reach;
use crate::criterion::Smoothing;
use crate::interval::Interval;
use crate::problem::Problem;
use crate::schedule::JointMotion;
use crate::search::random_motion;

/// The IRp-6; that its motors have limits makes the proof cover them.
fn irp6() -> Robot {
    let mut robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    for joint in &mut robot.joints {
        joint.drive.as_mut().unwrap().limits = Some(MotorLimits {
            torque: Some(10.0),
            ..MotorLimits::default()
        });
    }
    robot
}
/// Returns the largest torque of each joint and of each motor at samples of a motion, with those of the joints first.
fn sampled(robot: &Robot, frame: &crate::frame::Frame, motions: &[JointMotion]) -> [Vec<f64>; 2] {
    let n = motions.len();
    let model = Model::from_robot(robot).unwrap();
    let transmission = robot.transmission().unwrap();
    let trajectories: Vec<_> = motions
        .iter()
        .map(|m| frame.schedule.trajectory(&m.coefficients))
        .collect();
    let duration = trajectories[0].duration();
    let mut most = [vec![0.0_f64; n], vec![0.0_f64; n]];
    let count = 20_000;
    for k in 0..=count {
        let t = duration * f64::from(k) / f64::from(count);
        let at: Vec<_> = trajectories.iter().map(|j| j.at(t)).collect();
        let q: Vec<f64> = at
            .iter()
            .zip(motions)
            .map(|(r, m)| m.base + r.position)
            .collect();
        let qd: Vec<f64> = at.iter().map(|r| r.velocity).collect();
        let qdd: Vec<f64> = at.iter().map(|r| r.acceleration).collect();
        let [mut tau, mut torque] = [(); 2].map(|()| vec![0.0; n]);
        model.inverse_dynamics(&q, &qd, &qdd, &mut tau).unwrap();
        transmission.motor_torque(&q, &tau, &mut torque).unwrap();
        for j in 0..n {
            most[0][j] = most[0][j].max(tau[j].abs());
            most[1][j] = most[1][j].max(torque[j].abs());
        }
    }
    most
}

/// The enclosures contain the largest sample of every motion, and exceed it by little: what a motor takes itself is not
/// added at the joints and taken off again, which would count its friction twice where it may have both signs.
#[test]
fn torques_of_coupled_motors_are_enclosed_closely() {
    let robot = irp6();
    let options = Options {
        harmonics: 3,
        ..Options::default()
    };
    let (frame, _, _) = frame_of(&robot, &options).unwrap();
    let enclosing = Chain::<Interval>::new(&robot.geometry(), robot.gravity).unwrap();
    let mut problem = Problem::new(&frame, 12, Smoothing(4));
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let mut excess = [0.0_f64; 5];
    for _ in 0..20 {
        let x = random_motion(&mut problem, &frame, &mut random);
        let motions = problem.decode(&x);
        let reached = reach(&frame, &motions, &enclosing).unwrap();
        let [joints, motors] = sampled(&robot, &frame, &motions);
        for (reach, sampled) in reached.joints.iter().zip(&joints) {
            assert!(*sampled <= reach.torque.unwrap());
        }
        for (k, (reach, sampled)) in reached.motors.iter().zip(&motors).enumerate() {
            let enclosed = reach.torque.unwrap();
            assert!(*sampled <= enclosed, "motor {k}: {sampled} {enclosed}");
            excess[k] = excess[k].max(enclosed / sampled - 1.0);
        }
    }
    println!("largest excess by motor: {excess:?}");
    // Column, wrist tilt and wrist turn; the ratio of a screw changes within a cell.
    for k in [0, 3, 4] {
        assert!(excess[k] < 0.01, "motor {k}: {}", excess[k]);
    }
    assert!(excess[1].max(excess[2]) < 0.03, "{excess:?}");
}

/// Over wide ranges of the positions the torques are enclosed motor by motor, whatever the size of the others'. Where the
/// ratios vary too much to tell, nothing is claimed.
#[test]
fn motor_torques_are_enclosed_over_ranges_of_positions() {
    let robot = irp6();
    let (frame, _, _) = frame_of(&robot, &Options::default()).unwrap();
    let drives = frame.drives.as_ref().unwrap();
    let mut random = rand_pcg::Pcg64::seed_from_u64(3);
    let middle = robot.middle_position();
    let tau = [30.0, -150.0, 120.0, 12.0, -3.0];
    let enclosed = |half: f64| {
        let ranges: Vec<Interval> = (middle.iter())
            .map(|q| Interval::hull(q - half, q + half))
            .collect();
        let tau = tau.map(|t| Interval::hull(0.9 * t, t));
        drives.enclosed_torques(&ranges, &tau).unwrap()
    };
    for half in [0.0, 0.01, 0.05, 0.1] {
        let found = enclosed(half);
        let mut reached = [[f64::INFINITY, f64::NEG_INFINITY]; 5];
        for _ in 0..2000 {
            let mut draw = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
            let q: Vec<f64> = middle.iter().map(|q| q + half * draw(-1.0, 1.0)).collect();
            let tau = tau.map(|t| t * draw(0.9, 1.0));
            let mut torque = vec![0.0; 5];
            drives.plain.motor_torque(&q, &tau, &mut torque).unwrap();
            for ((range, found), x) in reached.iter_mut().zip(&found).zip(torque) {
                assert!(found.low <= x && x <= found.high, "{half}: {x} {found:?}");
                *range = [range[0].min(x), range[1].max(x)];
            }
        }
        // The ratios of column and wrist are constant: their width is that of the torques alone.
        for k in [0, 3, 4] {
            let width = reached[k][1] - reached[k][0];
            assert!(
                found[k].high - found[k].low < 1.25 * width,
                "{half}, motor {k}"
            );
        }
    }
    assert!(enclosed(1.5).iter().all(|x| x.magnitude() == f64::INFINITY));
}
