//! Poses at rest for a load.

use nalgebra::{DMatrix, Vector3};
use rand::{RngExt, SeedableRng};
use rig_shared::multibody::point_position;

use super::six_joints::{arm, confined, positions};
use super::*;

fn options(count: usize) -> PoseOptions {
    PoseOptions {
        count,
        start: None,
        margin: 0.1,
        speed_share: 0.9,
        seed: 1,
    }
}

fn at_rest(q: &[f64]) -> LinkMotion {
    let zero = vec![0.0; q.len()];
    LinkMotion {
        q: q.to_vec(),
        qd: zero.clone(),
        qdd: zero,
    }
}

/// Covariance of mass, first moment and six biases for noises of one, by rows from Newton's laws.
fn covariance(robot: &Robot, positions: &[Vec<f64>]) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(6 * positions.len(), 10);
    for (k, q) in positions.iter().enumerate() {
        let own = newton_rows(robot, &at_rest(q));
        rows.view_mut((6 * k, 0), (6, 4))
            .copy_from(&own.columns(0, 4));
        for axis in 0..6 {
            rows[(6 * k + axis, 4 + axis)] = 1.0;
        }
    }
    rows.tr_mul(&rows).try_inverse().unwrap()
}

#[test]
fn printed_deviations_are_those_of_least_squares_with_biases() {
    for (robot, count) in [(arm(), 3), (arm(), 6), (two_links(), 4)] {
        let robot = with_sensor(robot);
        let found = poses(&robot, &options(count)).unwrap();
        assert_eq!(found.positions.len(), count);
        let covariance = covariance(&robot, &found.positions);
        let mass = covariance[(0, 0)].sqrt();
        assert!((found.mass_deviation / mass - 1.0).abs() < 1e-9);
        let moment = covariance.view((1, 1), (3, 3)).into_owned();
        let worst = moment.symmetric_eigenvalues().max().sqrt();
        assert!((found.first_moment_deviation / worst - 1.0).abs() < 1e-9);
    }
}

/// An arm with a spherical wrist turns gravity to every side, so a few poses come close to the bound, and random ones
/// do not.
#[test]
fn poses_spread_gravity_better_than_random_ones() {
    let robot = with_sensor(arm());
    let found = poses(&robot, &options(4)).unwrap();
    println!("{} of {}", found.value, found.best_value);
    assert!(found.value > 0.995 * found.best_value && found.value <= found.best_value);
    let mut random = rand_pcg::Pcg64::seed_from_u64(7);
    let determinant = |list: &[Vec<f64>]| {
        let covariance = covariance(&robot, list);
        covariance.view((0, 0), (4, 4)).determinant()
    };
    let own = determinant(&found.positions);
    for _ in 0..300 {
        let list: Vec<Vec<f64>> = (0..4)
            .map(|_| {
                let joints = robot.joints.iter();
                let within = joints.map(|j| j.limits.as_ref().unwrap().position);
                within
                    .map(|[low, high]| low + (high - low) * random.random::<f64>())
                    .collect()
            })
            .collect();
        assert!(own < determinant(&list));
    }
}

/// The motion rests at each pose, and keeps limits and regions between them.
#[test]
fn motion_rests_at_the_poses_and_keeps_all_limits() {
    let robot = with_sensor(confined());
    let found = poses(&robot, &options(6)).unwrap();
    assert_eq!(poses(&robot, &options(6)).unwrap(), found);
    let other = PoseOptions {
        seed: 2,
        ..options(6)
    };
    assert_ne!(poses(&robot, &other).unwrap().file, found.file);
    for (joint, s) in robot.joints.iter().zip(sampled_reach(&robot, &found.file)) {
        let limits = joint.limits.as_ref().unwrap();
        let free = 0.05 * (limits.position[1] - limits.position[0]);
        assert!(
            limits.position[0] + free <= s[0] + 1e-9 && s[1] <= limits.position[1] - free + 1e-9
        );
        assert!(s[2] <= limits.velocity && s[3] <= limits.acceleration.unwrap());
        assert!(s[4] <= limits.torque.unwrap());
    }
    let model = Model::from_robot(&robot).unwrap();
    let mut rests = 0;
    let (mut before, mut resting) = (positions(&found.file, 0.0), 0);
    for k in 1..=20_000 {
        let q = positions(&found.file, found.file.duration() * f64::from(k) / 20_000.0);
        let at = point_position(&model.chain, &q, 5, [0.0, 0.0, 0.1], &mut [[0.0; 3]; 6]).unwrap();
        assert!(
            at[0] >= -0.7 && at[1].abs() <= 0.7 && at[2] >= 0.15,
            "{at:?}"
        );
        assert!(2.0 * at[0] + at[2] <= 1.5, "{at:?}");
        // A rest begins when the positions stop changing.
        let still = q == before;
        if still && resting == 0 {
            let is_pose = |p: &Vec<f64>| p.iter().zip(&q).all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(found.positions.iter().any(is_pose), "{q:?}");
            rests += 1;
        }
        resting = if still { resting + 1 } else { 0 };
        before = q;
    }
    assert_eq!(rests, 6);
    assert!(found.dwell >= 2.0);
}

/// The base joint turns about gravity, so no pose has to move it.
#[test]
fn joints_that_do_not_turn_gravity_stay() {
    let robot = with_sensor(arm());
    let found = poses(&robot, &options(5)).unwrap();
    for q in &found.positions {
        assert!(q[0].abs() < 1e-12, "{q:?}");
    }
    let start = vec![0.7, 0.1, 0.2, 0.3, 0.4, 0.5];
    let from = PoseOptions {
        start: Some(start.clone()),
        ..options(5)
    };
    let found = poses(&robot, &from).unwrap();
    assert_eq!(found.positions.len(), 5);
    for ((joint, at), own) in found.file.joints.iter().zip(&start).zip(0..) {
        assert_eq!(joint.start, *at);
        assert!(own != 0 || joint.trajectory.extremes().highest.abs() < 1e-12);
    }
}

/// Gravity keeps its direction in a sensor that only turns about it.
#[test]
fn what_poses_cannot_do_is_told() {
    let told =
        |robot: &Robot, options: &PoseOptions| poses(robot, options).unwrap_err().to_string();
    let sensed = with_sensor(arm());
    let few = told(&sensed, &options(2));
    assert!(
        few.contains("between 3 and 16") && few.contains("difference"),
        "{few}"
    );
    assert!(told(&sensed, &options(17)).contains("16"));
    assert!(told(&arm(), &options(4)).contains("[wrist_sensor]"));
    let mut upright = with_sensor(two_links());
    upright.gravity = [0.0, 0.0, -9.81];
    for joint in &mut upright.joints {
        joint.alpha = 0.0;
    }
    assert!(told(&upright, &options(4)).contains("gravity turns too little"));
}

/// Least squares over the rests of a simulated run give the load and the biases back.
#[test]
fn rests_of_a_simulated_run_give_mass_and_centre() {
    let robot = with_sensor(arm());
    let found = poses(&robot, &options(4)).unwrap();
    let reference = found.file.sampled(250.0).unwrap();
    let load = Load::of([0.8, 0.04, -0.02, 0.07, 0.02, 0.0, 0.0, 0.02, 0.0, 0.01]);
    let carried = Carried {
        load: Some(load.clone()),
        bias: [3.0, -2.0, 5.0, 0.1, -0.3, 0.2],
        ..Carried::default()
    };
    let run =
        replay_carrying(&robot, &carried, &reference, Noise::default(), 1, |_, _| ()).unwrap();
    let wrench = run.wrench.unwrap();
    let sensor = robot.wrist_sensor.as_ref().unwrap().pose();
    let (mut rows, mut read) = (Vec::new(), Vec::new());
    // The last half second of each rest.
    let each = run.motion.q[0].len() / 4;
    for pose in 0..4 {
        for k in (pose + 1) * each - 125..(pose + 1) * each - 5 {
            let q: Vec<f64> = run.motion.q.iter().map(|q| q[k]).collect();
            let joints = robot.joints.iter().zip(&q);
            let last = joints.fold(Isometry3::identity(), |at, (j, q)| at * j.pose(*q));
            let g: Vector3<f64> = (last * sensor).rotation.inverse() * Vector3::from(robot.gravity);
            for axis in 0..3 {
                let mut row = vec![0.0; 10];
                (row[0], row[4 + axis]) = (g[axis], 1.0);
                rows.push(row);
                read.push(wrench[axis][k]);
            }
            let lever = -g.cross_matrix();
            for axis in 0..3 {
                let mut row = vec![0.0; 10];
                (0..3).for_each(|c| row[1 + c] = lever[(axis, c)]);
                row[7 + axis] = 1.0;
                rows.push(row);
                read.push(wrench[3 + axis][k]);
            }
        }
    }
    let matrix = DMatrix::from_fn(rows.len(), 10, |r, c| rows[r][c]);
    let solved = rig_numerics::svd::Svd::of(matrix).solve(&DVector::from_vec(read), 1e-12);
    let centre = sensor.inverse() * nalgebra::Point3::from(Vector3::from(load.first_moment) / 0.8);
    println!("{solved}");
    assert!((solved[0] - 0.8).abs() < 2e-3, "{}", solved[0]);
    for k in 0..3 {
        assert!(
            (solved[1 + k] / solved[0] - centre[k]).abs() < 1e-3,
            "{solved}"
        );
        assert!((solved[4 + k] - carried.bias[k]).abs() < 2e-2, "{solved}");
        assert!(
            (solved[7 + k] - carried.bias[3 + k]).abs() < 2e-2,
            "{solved}"
        );
    }
}
