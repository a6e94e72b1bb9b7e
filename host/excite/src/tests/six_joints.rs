//! An arm of six joints with every limit.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rig_shared::multibody::{COLUMNS, differential_regressor, point_position};
use rig_shared::trajectory::Trajectory;

use super::*;
use crate::criterion::Smoothing;
use crate::frame::Frame;
use crate::optimise::{Objective, Round};
use crate::problem::Problem;
use crate::schedule::JointMotion;
use crate::search::random_motion;
use rig_model::robot::{Inertial, Joint, JointFriction, JointKind, JointLimits, Region};

/// An elbow arm with a spherical wrist; each link is a slender bar from its joint through its centre of mass, with some
/// thickness.
pub(super) fn arm() -> Robot {
    let quarter = core::f64::consts::FRAC_PI_2;
    let geometry = [
        (0.0, 0.0, 0.4),
        (quarter, 0.0, 0.0),
        (0.0, 0.45, 0.0),
        (quarter, 0.05, 0.42),
        (-quarter, 0.0, 0.0),
        (quarter, 0.0, 0.0),
    ];
    let bodies = [
        (12.0, [0.0, 0.05, -0.1]),
        (9.0, [0.22, 0.0, 0.06]),
        (5.0, [0.02, 0.03, 0.1]),
        (2.5, [0.0, 0.04, -0.12]),
        (1.2, [0.01, 0.05, 0.02]),
        (0.6, [0.01, 0.02, 0.09]),
    ];
    let limits = [
        (2.8, 2.5, 8.0, 120.0),
        (2.0, 2.0, 7.0, 180.0),
        (2.4, 3.0, 9.0, 90.0),
        (2.9, 4.0, 14.0, 25.0),
        (2.0, 4.0, 14.0, 15.0),
        (3.1, 5.0, 18.0, 6.0),
    ];
    let joints = (0..6)
        .map(|j| {
            let (alpha, a, d) = geometry[j];
            let (mass, [x, y, z]) = bodies[j];
            let (range, velocity, acceleration, torque) = limits[j];
            let m = mass * 4.0 / 3.0;
            let thick = mass * 1e-3;
            Joint {
                name: format!("joint{}", j + 1),
                kind: JointKind::Revolute,
                alpha,
                a,
                theta: 0.0,
                d,
                inertial: Some(Inertial {
                    mass,
                    first_moment: [mass * x, mass * y, mass * z],
                    inertia: [
                        m * (y * y + z * z) + thick,
                        -m * x * y,
                        -m * x * z,
                        m * (x * x + z * z) + thick,
                        -m * y * z,
                        m * (x * x + y * y) + thick,
                    ],
                }),
                limits: Some(JointLimits {
                    position: [-range, range],
                    soft_position: None,
                    velocity,
                    acceleration: Some(acceleration),
                    torque: Some(torque),
                }),
                friction: Some(JointFriction {
                    coulomb: 0.04 * torque,
                    viscous: 0.02 * torque,
                    offset: 0.0,
                }),
                drive: None,
                controller: None,
                voltage_controller: None,
            }
        })
        .collect();
    Robot::new("arm", joints)
}

/// The same arm on a table and beside a slanted wall.
pub(super) fn confined() -> Robot {
    let mut robot = arm();
    let table = Region {
        joint: "joint6".into(),
        point: [0.0, 0.0, 0.1],
        min: Some([-0.7, -0.7, 0.15]),
        max: Some([f64::INFINITY, 0.7, f64::INFINITY]),
        normal: None,
        beyond: None,
    };
    let wall = Region {
        min: None,
        max: None,
        normal: Some([-2.0, 0.0, -1.0]),
        beyond: Some(-1.5 / 5.0_f64.sqrt()),
        ..table.clone()
    };
    robot.workspace = vec![table, wall];
    robot
}

fn few_starts() -> Options {
    Options {
        starts: 4,
        ..Options::default()
    }
}

/// Returns instants ten times as dense as the optimiser's finest grid, over the whole motion.
fn instants(file: &TrajectoryFile) -> Vec<f64> {
    let count = 10 * 48 * 5 * 7;
    (0..=count)
        .map(|k| file.duration() * f64::from(k) / f64::from(count))
        .collect()
}

pub(super) fn positions(file: &TrajectoryFile, t: f64) -> Vec<f64> {
    file.joints
        .iter()
        .map(|j| j.start + j.trajectory.at(t).position)
        .collect()
}

#[test]
fn the_gradient_is_that_of_central_differences() {
    let robot = confined();
    for criterion in [Criterion::ConditionNumber, Criterion::Determinant] {
        let options = Options {
            harmonics: 3,
            criterion,
            ..few_starts()
        };
        let (frame, _, _) = frame_of(&robot, &options).unwrap();
        assert_eq!(frame.planes.len(), 5);
        let mut problem = Problem::new(&frame, 12, Smoothing(4));
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let x = random_motion(&mut problem, &frame, &mut random);
        let round = Round {
            weight: 10.0,
            smoothing: Smoothing(4),
            steps: 1,
        };
        problem.update(&x, &round);
        // Every constraint is active.
        problem.press(30.0);
        gradient_is_that_of_differences(&mut problem, &x, 1e-6);
    }
}

#[test]
fn coupled_motors_and_cranks_count_in_the_gradient_too() {
    let path = std::path::Path::new("irp6.toml");
    let robot = Robot::from_toml(rig_model::robot::IRP6_TEMPLATE, path).unwrap();
    let options = Options {
        harmonics: 2,
        criterion: Criterion::Determinant,
        ..few_starts()
    };
    let (frame, names, _) = frame_of(&robot, &options).unwrap();
    for name in ["fcm3", "fvm5"] {
        assert!(names.iter().any(|n| n.contains(name)), "{name}: {names:?}");
    }
    assert_eq!(frame.combined.len(), 2);
    let mut problem = Problem::new(&frame, 12, Smoothing(4));
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let x = random_motion(&mut problem, &frame, &mut random);
    let round = Round {
        weight: 10.0,
        smoothing: Smoothing(4),
        steps: 1,
    };
    problem.update(&x, &round);
    problem.press(30.0);
    gradient_is_that_of_differences(&mut problem, &x, 1e-5);
}

#[test]
fn every_limit_holds_between_the_samples_too_and_is_used() {
    let robot = arm();
    let found = designed(&robot, &few_starts());
    assert!(found.values.condition_number < 10.0, "{:?}", found.values);
    let model = Model::from_robot(&robot).unwrap();
    let mut most = [[0.0_f64; 4]; 6];
    let mut tau = [0.0; 6];
    for t in instants(&found.file) {
        let at: Vec<_> = found
            .file
            .joints
            .iter()
            .map(|j| j.trajectory.at(t))
            .collect();
        let q = positions(&found.file, t);
        let qd: Vec<f64> = at.iter().map(|r| r.velocity).collect();
        let qdd: Vec<f64> = at.iter().map(|r| r.acceleration).collect();
        inverse_dynamics(&model.chain, &model.parameters, &q, &qd, &qdd, &mut tau).unwrap();
        for j in 0..6 {
            let limits = robot.joints[j].limits.as_ref().unwrap();
            let shares = [
                q[j].abs() / limits.position[1],
                qd[j].abs() / limits.velocity,
                qdd[j].abs() / limits.acceleration.unwrap(),
                tau[j].abs() / limits.torque.unwrap(),
            ];
            for (most, share) in most[j].iter_mut().zip(shares) {
                *most = most.max(share);
            }
        }
    }
    for (j, shares) in most.iter().enumerate() {
        let fullest = shares.iter().copied().fold(0.0, f64::max);
        assert!(fullest <= 1.0, "joint {j}: {shares:?}");
        assert!(fullest > 0.9, "joint {j} touches no limit: {shares:?}");
    }
}

#[test]
fn points_stay_within_their_regions_and_staged_motions_say_that_they_may_not() {
    let robot = confined();
    let found = designed(&robot, &few_starts());
    let model = Model::from_robot(&robot).unwrap();
    let mut jacobian = [[0.0; 3]; 6];
    let mut place = |file: &TrajectoryFile, t: f64| {
        let q = positions(file, t);
        point_position(&model.chain, &q, 5, [0.0, 0.0, 0.1], &mut jacobian).unwrap()
    };
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut wall = f64::INFINITY;
    for t in instants(&found.file) {
        let at = place(&found.file, t);
        for axis in 0..3 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
        wall = wall.min((1.5 - 2.0 * at[0] - at[2]) / 5.0_f64.sqrt());
    }
    let sampled = [
        low[0] + 0.7,
        low[1] + 0.7,
        0.7 - high[1],
        low[2] - 0.15,
        wall,
    ];
    // In the order of a box's planes: below and above along each axis.
    assert_eq!(found.clearances.len(), 5);
    for (clearance, sampled) in found.clearances.iter().zip(sampled) {
        assert_eq!(clearance.joint, "joint6");
        assert!(
            sampled >= 0.0 && clearance.distance >= 0.0,
            "{clearance:?} {sampled}"
        );
        // The proved bound is below the samples, but close: it is of second order.
        assert!(
            clearance.distance <= sampled && sampled < clearance.distance + 2e-3,
            "{clearance:?} {sampled}"
        );
    }
    // Without the regions the point leaves them, so they are effective.
    let free = designed(&arm(), &few_starts());
    assert!(
        instants(&free.file)
            .into_iter()
            .any(|t| place(&free.file, t)[2] < 0.15)
    );
    let (_, notes) = staged(&robot, StagedKind::Chirp, &StagedOptions::default()).unwrap();
    assert!(
        notes.iter().any(|n| n.contains("[[workspace]]")),
        "{notes:?}"
    );
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let with = |threads| {
        let options = Options {
            threads: Some(threads),
            harmonics: 2,
            starts: 5,
            seed: 9,
            ..Options::default()
        };
        designed(&arm(), &options)
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn noise_of_the_torque_weighs_the_joints() {
    let robot = arm();
    let with = |noise: &[f64]| Options {
        torque_noise: Some(noise.to_vec()),
        ..few_starts()
    };
    let weights = frame_of(&robot, &with(&[0.5, 1.0, 2.0, 4.0, 1.0, 1.0]))
        .unwrap()
        .0
        .weights;
    assert_eq!(weights[..4], [2.0, 1.0, 0.5, 0.25]);
    let wrong = |noise: &[f64]| {
        design(&robot, &with(noise), |_, _| ())
            .unwrap_err()
            .to_string()
    };
    assert!(wrong(&[1.0; 5]).contains("6 joints"));
    assert!(wrong(&[1.0, 1.0, 0.0, 1.0, 1.0, 1.0]).contains("greater than 0"));
}

#[test]
fn links_alone_are_fewer_and_unscaled_is_what_the_si_number_says() {
    let robot = arm();
    let options = Options {
        parameters: Parameters::Links,
        scaling: Scaling::None,
        starts: 3,
        harmonics: 3,
        ..Options::default()
    };
    let found = designed(&robot, &options);
    // Khalil & Dombre 2002, ch. 9: 36 for six revolute joints whose first is vertical and second perpendicular to it,
    // with a spherical wrist.
    assert_eq!(found.base_parameters.len(), 36);
    let values = found.values;
    assert!((values.condition_number / values.si_condition_number - 1.0).abs() < 1e-9);
}

/// Fits base parameters to noisy torques along one period; returns the root mean square of their errors, each times its
/// column's size (so in shares of torque limits).
fn error_of(frame: &Frame, robot: &Robot, motions: &[JointMotion], noise: u64) -> f64 {
    let model = Model::from_robot(robot).unwrap();
    let mut random = rand_pcg::Pcg64::seed_from_u64(noise);
    let (samples, n, p) = (500, 6, frame.columns.len());
    let mut rows = DMatrix::zeros(samples * n, p);
    let mut right = DVector::zeros(samples * n);
    let mut exact = DVector::zeros(samples * n);
    let mut out = vec![0.0; n * n * COLUMNS];
    let mut tau = [0.0; 6];
    for s in 0..samples {
        let t = 1e-6
            * (f64::from(frame.schedule.ramp_us)
                + f64::from(frame.schedule.period_us) * s as f64 / samples as f64);
        let at: Vec<_> = motions
            .iter()
            .map(|m| frame.schedule.trajectory(&m.coefficients).at(t))
            .collect();
        let q: Vec<f64> = at
            .iter()
            .zip(motions)
            .map(|(r, m)| r.position + m.base)
            .collect();
        let qd: Vec<f64> = at.iter().map(|r| r.velocity).collect();
        let qdd: Vec<f64> = at.iter().map(|r| r.acceleration).collect();
        differential_regressor(&model.chain, &q, &qd, &qdd, &mut out).unwrap();
        inverse_dynamics(&model.chain, &model.parameters, &q, &qd, &qdd, &mut tau).unwrap();
        for j in 0..n {
            let row = s * n + j;
            for (c, source) in frame.columns.iter().enumerate() {
                rows[(row, c)] = out[j * n * COLUMNS + source] * frame.weights[j] / frame.sizes[c];
            }
            // Noise of 1 % of each joint's torque limit.
            let disturbance: f64 = StandardNormal.sample(&mut random);
            exact[row] = tau[j] * frame.weights[j];
            right[row] = exact[row] + 0.01 * disturbance;
        }
    }
    let qr = rows.qr();
    let solve = |b: &DVector<f64>| {
        let right = qr.q().transpose() * b;
        qr.r().solve_upper_triangular(&right).unwrap()
    };
    ((solve(&right) - solve(&exact)).norm_squared() / p as f64).sqrt()
}

#[test]
fn parameters_come_out_better_than_with_random_motions_of_the_same_limits() {
    let robot = arm();
    let (frame, _, _) = frame_of(&robot, &few_starts()).unwrap();
    let found = designed(&robot, &few_starts());
    let motions: Vec<JointMotion> = found
        .file
        .joints
        .iter()
        .map(|j| {
            let Trajectory::Fourier(series) = &j.trajectory else {
                panic!("not a Fourier series");
            };
            JointMotion {
                base: j.start,
                coefficients: series.sine.iter().chain(&series.cosine).copied().collect(),
            }
        })
        .collect();
    let mean = |motions: &[JointMotion]| {
        (0..4)
            .map(|noise| error_of(&frame, &robot, motions, noise))
            .sum::<f64>()
            / 4.0
    };
    let ours = mean(&motions);
    let mut problem = Problem::new(&frame, 48, Smoothing(4));
    let mut random = rand_pcg::Pcg64::seed_from_u64(77);
    let others: Vec<f64> = (0..6)
        .map(|_| {
            // Up to the limits of position, velocity and acceleration, regardless of the torque limits.
            let x = random_motion(&mut problem, &frame, &mut random);
            mean(&problem.decode(&x))
        })
        .collect();
    let best = others.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(ours < 0.8 * best, "{ours} against {others:?}");
}
