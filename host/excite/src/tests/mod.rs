//! Tests of the design, its files and its runs.
#![allow(clippy::unwrap_used, clippy::panic)]

mod coupled;
mod design;
mod files;
mod followers;
mod load_motion;
mod load_poses;
mod motors;
mod multisine;
mod room;
mod runs;
mod six_joints;
mod wrist;

use std::path::Path;

use nalgebra::{DMatrix, DVector, Isometry3, UnitQuaternion};
use rig_shared::multibody::inverse_dynamics;

use super::*;
use crate::optimise::Objective;
use crate::problem::Problem;
use crate::setup::frame_of;
use rig_model::robot::{Load, ONE_LINK_TEMPLATE, Robot, WristSensor};
use rig_model::simulate::{LinkMotion, LoadWrench, Model};

pub(super) fn one_link() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// Two of these links in series, the second at 0.4 m.
pub(super) fn two_links() -> Robot {
    let mut robot = one_link();
    let mut second = robot.joints[0].clone();
    second.name = "forearm".into();
    (second.alpha, second.a) = (0.0, 0.4);
    robot.joints[0].limits.as_mut().unwrap().torque = Some(30.0);
    robot.joints.push(second);
    robot
}

pub(super) fn quick(criterion: Criterion) -> Options {
    Options {
        criterion,
        starts: 4,
        ..Options::default()
    }
}

pub(super) fn designed(robot: &Robot, options: &Options) -> Design {
    design(robot, options, |_, _| ()).unwrap()
}

/// Returns the extremes of position, velocity, acceleration and torque at many instants of the whole motion.
pub(super) fn sampled_reach(robot: &Robot, file: &TrajectoryFile) -> Vec<[f64; 5]> {
    let n = robot.joints.len();
    let model = Model::from_robot(robot).unwrap();
    let mut most = vec![[f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0, 0.0]; n];
    let count = 300_000;
    let mut tau = vec![0.0; n];
    for k in 0..=count {
        let t = file.duration() * f64::from(k) / f64::from(count);
        let at: Vec<_> = file.joints.iter().map(|j| j.trajectory.at(t)).collect();
        let q: Vec<f64> = at
            .iter()
            .zip(&file.joints)
            .map(|(r, j)| j.start + r.position)
            .collect();
        let qd: Vec<f64> = at.iter().map(|r| r.velocity).collect();
        let qdd: Vec<f64> = at.iter().map(|r| r.acceleration).collect();
        inverse_dynamics(&model.chain, &model.parameters, &q, &qd, &qdd, &mut tau).unwrap();
        for j in 0..n {
            let m = &mut most[j];
            *m = [
                m[0].min(q[j]),
                m[1].max(q[j]),
                m[2].max(qd[j].abs()),
                m[3].max(qdd[j].abs()),
                m[4].max(tau[j].abs()),
            ];
        }
    }
    most
}

/// Compares the problem's gradient at `x` with central differences, `tolerance` relative to its largest entry.
pub(super) fn gradient_is_that_of_differences(
    problem: &mut Problem,
    x: &DVector<f64>,
    tolerance: f64,
) {
    let mut gradient = DVector::zeros(x.len());
    let mut unused = gradient.clone();
    problem.value(x, &mut gradient);
    for k in 0..x.len() {
        let h = 1e-6;
        let mut moved = |by: f64| {
            let mut x = x.clone();
            x[k] += by;
            problem.value(&x, &mut unused)
        };
        let difference = (moved(h) - moved(-h)) / (2.0 * h);
        assert!(
            (difference - gradient[k]).abs() < tolerance * (1.0 + gradient.amax()),
            "{k}: {difference} {}",
            gradient[k]
        );
    }
}

/// The robot with a sensor beside and turned from its flange.
pub(super) fn with_sensor(mut robot: Robot) -> Robot {
    robot.wrist_sensor = Some(WristSensor {
        position: [0.02, -0.03, 0.08],
        rotation: [0.3, -0.2, 1.1],
        ..WristSensor::default()
    });
    robot
}

/// Returns the regressor of a load's ten parameters about the sensor's origin, in the flange's axes, by Newton's laws
/// for bodies with one parameter changed. Six rows, for moments about the sensor's origin in its axes.
pub(super) fn newton_rows(robot: &Robot, links: &LinkMotion) -> DMatrix<f64> {
    let sensor = robot.wrist_sensor.as_ref().unwrap();
    let at = Isometry3::from_parts(sensor.pose().translation, UnitQuaternion::identity());
    let read = |parameters: [f64; 10]| {
        let load = Load::of(parameters).seen_from(&at);
        LoadWrench::new(robot, &load).unwrap().at(links)
    };
    let body = [1.0, 0.1, 0.2, -0.1, 0.4, 0.0, 0.0, 0.5, 0.0, 0.3];
    let before = read(body);
    DMatrix::from_fn(6, 10, |row, k| {
        let mut other = body;
        other[k] += 1.0;
        read(other)[row] - before[row]
    })
}
