//! Optimal motions for a load.

use nalgebra::DMatrix;
use rand::SeedableRng;
use rig_shared::multibody::differential_regressor;

use super::six_joints::arm;
use super::*;
use crate::criterion::Smoothing;
use crate::optimise::Round;
use crate::search::random_motion;
use rig_model::robot::IRP6_TEMPLATE;

fn irp6() -> Robot {
    Robot::from_toml(IRP6_TEMPLATE, Path::new("irp6.toml")).unwrap()
}

fn for_a_load() -> Options {
    Options {
        parameters: Parameters::Load,
        starts: 3,
        harmonics: 3,
        ..Options::default()
    }
}

#[test]
fn gradient_for_a_load_is_that_of_central_differences() {
    for (robot, criterion) in [
        (with_sensor(arm()), Criterion::ConditionNumber),
        (with_sensor(irp6()), Criterion::Determinant),
        (with_sensor(two_links()), Criterion::SmallestSingularValue),
        (arm(), Criterion::Determinant),
    ] {
        let options = Options {
            criterion,
            harmonics: 2,
            sensor_noise: robot.wrist_sensor.as_ref().map(|_| [0.3, 0.02]),
            ..for_a_load()
        };
        let (frame, _, _) = frame_of(&robot, &options).unwrap();
        let mut problem = Problem::new(&frame, 12, Smoothing(4));
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let x = random_motion(&mut problem, &frame, &mut random);
        let round = Round {
            weight: 10.0,
            smoothing: Smoothing(4),
            steps: 1,
        };
        problem.update(&x, &round);
        problem.press(3.0);
        gradient_is_that_of_differences(&mut problem, &x, 1e-5);
    }
}

/// Position, velocity and acceleration at `count` instants of one period at full amplitude.
fn states(file: &TrajectoryFile, count: usize) -> Vec<LinkMotion> {
    let rig_shared::trajectory::Trajectory::Fourier(f) = &file.joints[0].trajectory else {
        panic!("no Fourier series");
    };
    let [ramp, period] = [f.ramp_us, f.period_us].map(|us| f64::from(us) * 1e-6);
    (0..count)
        .map(|k| {
            let t = ramp + period * k as f64 / count as f64;
            let at: Vec<_> = file.joints.iter().map(|j| j.trajectory.at(t)).collect();
            LinkMotion {
                q: (at.iter().zip(&file.joints))
                    .map(|(r, j)| j.start + r.position)
                    .collect(),
                qd: at.iter().map(|r| r.velocity).collect(),
                qdd: at.iter().map(|r| r.acceleration).collect(),
            }
        })
        .collect()
}

/// The covariance of the load's ten parameters for noises of 1 N and 0.05 N·m, from least squares with six biases as
/// further unknowns, by rows from Newton's laws.
fn covariance(robot: &Robot, file: &TrajectoryFile) -> DMatrix<f64> {
    let list = states(file, 400);
    let mut rows = DMatrix::zeros(6 * list.len(), 16);
    for (k, links) in list.iter().enumerate() {
        rows.view_mut((6 * k, 0), (6, 10))
            .copy_from(&newton_rows(robot, links));
        for axis in 0..6 {
            rows[(6 * k + axis, 10 + axis)] = 1.0;
            if axis >= 3 {
                rows.row_mut(6 * k + axis).scale_mut(20.0);
            }
        }
    }
    let inverse = rows.tr_mul(&rows).try_inverse().unwrap();
    inverse.view((0, 0), (10, 10)).into_owned()
}

/// With biases eliminated the design's determinant is that of the covariance from all sixteen unknowns; and the motion
/// for the load beats the motion for the robot.
#[test]
fn criterion_is_that_of_least_squares_with_biases() {
    let robot = with_sensor(arm());
    let options = Options {
        criterion: Criterion::Determinant,
        ..for_a_load()
    };
    let found = designed(&robot, &options);
    assert_eq!(found.base_parameters.len(), 10);
    let (frame, _, _) = frame_of(&robot, &options).unwrap();
    // det(covariance)^(-1/20) of scaled columns, per sample.
    let mean = |file: &TrajectoryFile| {
        let scaled = covariance(&robot, file);
        let sizes: f64 = frame.sizes.iter().map(|size| size.ln()).sum();
        (-(scaled.determinant().ln() + 400.0_f64.ln() * 10.0) / 20.0 - sizes / 10.0).exp()
    };
    let own = mean(&found.file);
    let printed = found.values.mean_singular_value;
    assert!((own / printed - 1.0).abs() < 1e-6, "{own} {printed}");
    let for_the_robot = Options {
        parameters: Parameters::All,
        ..options
    };
    let other = mean(&designed(&robot, &for_the_robot).file);
    println!("{own} for the load, {other} for the robot");
    assert!(own > 1.05 * other, "{own} {other}");
}

#[test]
fn motion_for_a_load_keeps_the_limits_and_does_not_depend_on_the_sensors_turn() {
    let robot = with_sensor(arm());
    let found = designed(&robot, &for_a_load());
    for (joint, s) in robot.joints.iter().zip(sampled_reach(&robot, &found.file)) {
        let limits = joint.limits.as_ref().unwrap();
        assert!(limits.position[0] <= s[0] && s[1] <= limits.position[1]);
        assert!(s[2] <= limits.velocity && s[3] <= limits.acceleration.unwrap());
        assert!(s[4] <= limits.torque.unwrap());
    }
    assert!(
        found.notes.iter().any(|n| n.contains("without the load")),
        "{:?}",
        found.notes
    );
    let mut turned = robot.clone();
    turned.wrist_sensor.as_mut().unwrap().rotation = [1.0, 0.2, -2.0];
    assert_eq!(designed(&turned, &for_a_load()).file, found.file);
}

/// Without a sensor the load is identified as a part of the last link: the condition number is that of its ten columns
/// in the torques.
#[test]
fn load_by_torques_is_a_part_of_the_last_link() {
    let robot = arm();
    let options = Options {
        scaling: Scaling::None,
        ..for_a_load()
    };
    let found = designed(&robot, &options);
    assert_eq!(found.base_parameters.len(), 10);
    let model = Model::from_robot(&robot).unwrap();
    let list = states(&found.file, 600);
    let mut rows = DMatrix::zeros(6 * list.len(), 10);
    let mut out = vec![0.0; 6 * 84];
    for (k, s) in list.iter().enumerate() {
        differential_regressor(&model.chain, &s.q, &s.qd, &s.qdd, &mut out).unwrap();
        for j in 0..6 {
            for c in 0..10 {
                rows[(6 * k + j, c)] = out[j * 84 + 70 + c];
            }
        }
    }
    let singular = rig_numerics::svd::Svd::of(rows.clone()).singular_values;
    let condition = singular.max() / singular.min();
    let printed = found.values.condition_number;
    assert!(
        (condition / printed - 1.0).abs() < 1e-3,
        "{condition} {printed}"
    );
}

/// A link that turns about one horizontal axis shows one moment of inertia; gravity along the axis hides mass and
/// centre on it behind the biases.
#[test]
fn parameters_that_no_motion_identifies_are_named() {
    let robot = with_sensor(one_link());
    let found = designed(&robot, &for_a_load());
    let names = &found.base_parameters;
    assert!(
        names.iter().any(|n| n == "m") && names.iter().any(|n| n == "Izz"),
        "{names:?}"
    );
    for lost in ["Ixx", "Ixy", "Iyy"] {
        assert!(!names.iter().any(|n| n == lost), "{names:?}");
        assert!(
            found.notes.iter().any(|n| n.contains(lost)),
            "{:?}",
            found.notes
        );
    }
}
