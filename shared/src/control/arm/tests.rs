//! Laws against formulas of another form.
#![allow(clippy::unwrap_used)]

use std::vec;
use std::vec::Vec;

use super::computed_torque;
use super::input::{Inputs, Law};
use super::model::ArmModel;
use super::regressor::PassiveRegressor;
use super::task::Task;
use crate::control::{ControlKind, Gains, law};
use crate::link::LinkParameters;
use crate::multibody::samples::Sample;
use crate::multibody::{
    COLUMNS, Chain, Follower, JointGeometry, JointKind, column, coriolis_matrix, gravity_vector,
    inertia_matrix,
};
use crate::precompensation::PrecompensationSettings;
use crate::trajectory::Reference;

/// Compares the regressor of passivity-based laws with the matrices of the motion.
fn compare_with_matrices(chain: &Chain<f64>, parameters: &[[f64; COLUMNS]], states: [&[f64]; 4]) {
    let [q, qd, v, vd] = states;
    let n = q.len();
    let view = PassiveRegressor {
        chain,
        transmission: None,
        velocity_threshold: 1e-3,
    };
    let mut out = vec![f64::NAN; n * view.width()];
    let mut workspace = vec![f64::NAN; view.workspace_length()];
    view.evaluate(q, qd, [v, vd], &mut workspace, &mut out)
        .unwrap();
    let (mut mass, mut coriolis) = (vec![0.0; n * n], vec![0.0; n * n]);
    let mut weight = vec![0.0; n];
    inertia_matrix(chain, parameters, q, &mut mass).unwrap();
    coriolis_matrix(chain, parameters, q, qd, &mut coriolis).unwrap();
    gravity_vector(chain, parameters, q, &mut weight).unwrap();
    let values = parameters.as_flattened();
    for j in 0..n {
        let own = &parameters[j];
        let mut expected = weight[j] + own[column::OFFSET] + own[column::VISCOUS] * v[j];
        expected += own[column::COULOMB] * libm::tanh(v[j] / 2e-5);
        for k in 0..n {
            expected += mass[j * n + k] * vd[k] + coriolis[j * n + k] * v[k];
        }
        let found: f64 = (values.iter().enumerate())
            .map(|(c, value)| view.entry(&out, j, c) * value)
            .sum();
        let off = (found - expected).abs();
        assert!(
            off < 1e-9 * (1.0 + expected.abs()),
            "{j}: {found} {expected}"
        );
    }
}

#[test]
fn passive_regressor_gives_the_christoffel_matrix_times_the_reference_velocity() {
    for seed in 0..40 {
        let n = 1 + seed as usize % 7;
        let s = Sample::random(n, seed);
        let other = Sample::random(n, seed + 100);
        let states = [&s.q[..], &s.qd, &other.qd, &other.qdd];
        compare_with_matrices(&s.chain(), &s.parameters, states);
    }
}

#[test]
fn passive_regressor_has_the_columns_of_axes_that_follow() {
    for seed in 0..20 {
        let s = Sample::random(5, seed);
        let other = Sample::random(3, seed + 100);
        let follower = |axis: usize, before: usize, master: usize, ratio: f64| Follower {
            geometry: s.geometry[axis],
            before,
            master,
            ratio,
            offset: 0.2,
        };
        let followers = [follower(3, 1, 0, -1.0), follower(4, 3, 1, 0.5)];
        let chain = Chain::with_followers(&s.geometry[..3], &followers, s.gravity).unwrap();
        let states = [&s.q[..3], &s.qd[..3], &other.qd, &other.qdd];
        compare_with_matrices(&chain, &s.parameters, states);
    }
}

#[test]
fn convective_acceleration_is_the_rate_of_the_jacobian_along_the_motion() {
    for seed in 0..40 {
        let n = 1 + seed as usize % 7;
        let s = Sample::random(n, seed);
        let directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let task = Task {
            tool: [0.1, -0.2, 0.3],
            origin: [0.0; 3],
            directions: &directions,
        };
        let chain = s.chain();
        let h = 1e-5;
        let speed = |step: f64| {
            let q: Vec<f64> = s.q.iter().zip(&s.qd).map(|(q, v)| q + step * v).collect();
            task.motion(&chain, &q, &s.qd).unwrap().velocity
        };
        let (before, after) = (speed(-h), speed(h));
        let found = task.motion(&chain, &s.q, &s.qd).unwrap().convective;
        for d in 0..3 {
            let expected = (after[d] - before[d]) / (2.0 * h);
            let off = (found[d] - expected).abs();
            assert!(
                off < 1e-5 * (1.0 + expected.abs()),
                "{seed}: {found:?} {expected}"
            );
        }
    }
}

#[test]
fn computed_torque_of_one_joint_is_the_law_of_the_board() {
    let geometry = JointGeometry {
        kind: JointKind::Revolute,
        alpha: core::f64::consts::FRAC_PI_2,
        a: 0.0,
        theta: 0.0,
        d: 0.0,
    };
    let chain = Chain::<f64>::new(&[geometry], [0.0, 0.0, -9.81]).unwrap();
    let mut row = [0.0; COLUMNS];
    (row[column::MASS], row[column::FIRST_MOMENT]) = (1.0, 0.3);
    row[column::INERTIA + 5] = 0.12;
    row[column::DRIVE_INERTIA] = 0.05;
    (row[column::VISCOUS], row[column::COULOMB]) = (0.3, 0.4);
    row[column::OFFSET] = 0.05;
    let friction = PrecompensationSettings {
        enabled: true,
        gain: 0.95,
        gain_at_rest: 0.8,
        velocity_threshold: 0.01,
    };
    let gains = Gains::design(0.17, 5.0, 1.0);
    let link = LinkParameters {
        inertia: 0.17,
        gravity_cos: 0.3 * 9.81,
        gravity_sin: 0.0,
        viscous: 0.3,
        coulomb: 0.4,
        offset: 0.05,
    };
    let board = law::Config {
        kind: ControlKind::ComputedTorque,
        gains,
        design_inertia: 0.17,
        model: link,
        friction: crate::friction::Friction {
            coulomb: 0.4,
            viscous: 0.3,
            ..Default::default()
        },
        precompensation: friction,
        torque_limit: 4.0,
        period: 1e-3,
        ..law::Config::default()
    };
    let arm = computed_torque::Config {
        model: ArmModel {
            chain: &chain,
            parameters: &[row],
            motors: None,
        },
        proportional: &[gains.proportional / 0.17],
        derivative: &[gains.derivative / 0.17],
        friction,
        torque_limit: &[4.0],
    };
    let mut limits = 0;
    for k in 0..200 {
        let at = f64::from(k);
        let reference = Reference {
            position: libm::sin(0.3 * at),
            velocity: libm::cos(0.7 * at),
            acceleration: 4.0 * libm::sin(1.1 * at),
        };
        let input = Inputs {
            position: &[libm::sin(0.3 * at) + 0.02 * libm::cos(at)],
            velocity: &[libm::cos(0.7 * at) + 0.01 * libm::sin(at)],
            reference: &[reference],
            task: [Reference::default(); 3],
            force: [0.0; 3],
            feedforward: &[0.1],
        };
        let (mut one, mut other) = ([0.0], [0.0]);
        let a = board.step(&mut law::State::default(), &input, &mut one);
        let b = arm.step(&mut (), &input, &mut other);
        assert!((one[0] - other[0]).abs() < 1e-12, "{k}: {one:?} {other:?}");
        assert_eq!(a, b);
        limits += usize::from(a.unwrap().any());
    }
    assert!(limits > 0 && limits < 200);
}
