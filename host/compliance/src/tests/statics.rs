//! The compliance matrix against a numeric solution of statics.
//!
//! The solution minimises the energy of the springs minus the work of the wrench over the joint positions, by Newton's
//! method with numeric derivatives. Its kinematics are products of the poses of the joints (`Joint::pose`), its springs
//! twist by the motor positions F(q) − F(q₀) themselves: it uses neither a Jacobian nor the crate's matrices.

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Vector3};
use rig_model::robot::{IRP6_TEMPLATE, Joint, JointKind, Robot, TX40};
use rig_shared::transmission::DriveKind;

use crate::{
    ComplianceOptions, DriveStiffness, ToolPoint, described_stiffness, given_stiffness,
    identify_compliance,
};

/// Place of the tool point and its axes.
fn tool(robot: &Robot, q: &[f64], offset: [f64; 3]) -> Isometry3<f64> {
    robot.last_pose(q) * robot.flange_pose() * nalgebra::Translation3::from(Vector3::from(offset))
}

/// Twist of each drive, in the coordinate of its stiffness, from motor positions.
fn twists(robot: &Robot, q: &[f64], start: &[f64]) -> Vec<f64> {
    let drives = robot.transmission().unwrap();
    let n = q.len();
    let (mut here, mut there) = (vec![0.0; n], vec![0.0; n]);
    drives.motor_position(q, &mut here).unwrap();
    drives.motor_position(start, &mut there).unwrap();
    (0..n)
        .map(|k| {
            let ratio = match robot.drive_kinds()[k] {
                DriveKind::Varying => 1.0,
                _ => robot.joints[k].gear_ratio(),
            };
            (here[k] - there[k]) / ratio
        })
        .collect()
}

/// Returns displacement and rotation of the tool point at rest under a force and a moment there, and the springs' energy.
pub(super) fn rest(
    robot: &Robot,
    start: &[f64],
    offset: [f64; 3],
    stiffness: &[f64],
    wrench: [f64; 6],
) -> ([f64; 6], f64) {
    let q = links_at_rest(robot, start, offset, stiffness, wrench, |_| 0.0);
    (
        moved(robot, &q, start, offset),
        springs(robot, &q, start, stiffness),
    )
}

/// Returns displacement and rotation of the tool point.
pub(super) fn moved(robot: &Robot, q: &[f64], start: &[f64], offset: [f64; 3]) -> [f64; 6] {
    let unloaded = tool(robot, start, offset);
    let pose = tool(robot, q, offset);
    let shift = pose * Point3::origin() - unloaded * Point3::origin();
    let turn = (pose.rotation * unloaded.rotation.inverse()).scaled_axis();
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

/// Returns the energy of the springs.
fn springs(robot: &Robot, q: &[f64], start: &[f64], stiffness: &[f64]) -> f64 {
    (twists(robot, q, start).iter().zip(stiffness))
        .map(|(s, c)| 0.5 * c * s * s)
        .sum()
}

/// Returns the potential energy of the described masses.
pub(super) fn weight(robot: &Robot, q: &[f64]) -> f64 {
    let mut pose = Isometry3::identity();
    let mut energy = 0.0;
    for (joint, q) in robot.joints.iter().zip(q) {
        pose *= joint.pose(*q);
        let Some(body) = &joint.inertial else {
            continue;
        };
        let moment =
            pose.rotation * Vector3::from(body.first_moment) + body.mass * pose.translation.vector;
        energy -= moment.dot(&Vector3::from(robot.gravity));
    }
    energy
}

/// Returns the positions of the links at rest behind motors at `start`, under a wrench at the tool point and a potential.
pub(super) fn links_at_rest(
    robot: &Robot,
    start: &[f64],
    offset: [f64; 3],
    stiffness: &[f64],
    wrench: [f64; 6],
    potential: impl Fn(&[f64]) -> f64,
) -> Vec<f64> {
    let [fx, fy, fz, mx, my, mz] = wrench;
    let energy = |q: &[f64]| -> f64 {
        let [x, y, z, a, b, c] = moved(robot, q, start, offset);
        springs(robot, q, start, stiffness) + potential(q)
            - (fx * x + fy * y + fz * z + mx * a + my * b + mz * c)
    };
    let n = start.len();
    let mut q = start.to_vec();
    let h = 1e-4;
    for _ in 0..4 {
        let at = |steps: &[(usize, f64)]| {
            let mut moved = q.clone();
            for (j, step) in steps {
                moved[*j] += step;
            }
            energy(&moved)
        };
        let gradient = DVector::from_fn(n, |j, _| (at(&[(j, h)]) - at(&[(j, -h)])) / (2.0 * h));
        let hessian = DMatrix::from_fn(n, n, |i, j| {
            (at(&[(i, h), (j, h)]) - at(&[(i, h), (j, -h)]) - at(&[(i, -h), (j, h)])
                + at(&[(i, -h), (j, -h)]))
                / (4.0 * h * h)
        });
        let step = hessian.lu().solve(&gradient).unwrap();
        for (q, step) in q.iter_mut().zip(step.iter()) {
            *q -= step;
        }
    }
    q
}

fn given(robot: &Robot, stiffness: &[f64]) -> Vec<DriveStiffness> {
    let mut drives = described_stiffness(robot).unwrap();
    given_stiffness(&mut drives, stiffness, &[]).unwrap();
    drives
}

/// Compares K_p with the solution of statics for unit wrenches, small enough that geometry stays linear.
fn compare(robot: &Robot, pose: &[f64], offset: [f64; 3], stiffness: &[f64], size: f64) {
    let found = ToolPoint::new(robot, offset)
        .unwrap()
        .compliance(pose, &given(robot, stiffness))
        .unwrap();
    let most = |rows: std::ops::Range<usize>, c: usize| {
        rows.map(|r| found.compliance[r][c].abs())
            .fold(0.0, f64::max)
    };
    for c in 0..6 {
        let mut wrench = [0.0; 6];
        wrench[c] = size;
        let (moved, energy) = rest(robot, pose, offset, stiffness, wrench);
        for r in 0..6 {
            let own = if r < 3 { most(0..3, c) } else { most(3..6, c) };
            let off = moved[r] / size - found.compliance[r][c];
            assert!(
                off.abs() < 2e-3 * own.max(1e-12),
                "{}: row {r}, column {c}: {} against {}",
                robot.name,
                moved[r] / size,
                found.compliance[r][c]
            );
        }
        // Work done slowly is stored: half of force times displacement.
        let stored = 0.5 * size * size * found.compliance[c][c];
        assert!(
            (energy - stored).abs() < 5e-3 * stored.max(1e-15),
            "{energy} against {stored}"
        );
    }
    for r in 0..6 {
        for c in 0..6 {
            let off = found.compliance[r][c] - found.compliance[c][r];
            assert!(off.abs() < 1e-18, "not symmetric");
        }
    }
    let matrix = nalgebra::Matrix6::from_fn(|r, c| found.compliance[r][c]);
    let values = matrix.symmetric_eigenvalues();
    assert!(values.min() > -1e-12 * values.max());
    if let Some(stiffness) = found.stiffness {
        let inverse = nalgebra::Matrix6::from_fn(|r, c| stiffness[r][c]);
        assert!(
            (matrix * inverse - nalgebra::Matrix6::identity())
                .abs()
                .max()
                < 1e-6
        );
    }
}

#[test]
fn a_coupled_wrist_bends_as_statics_says() {
    let robot = Robot::from_toml(TX40, "tx40.toml".as_ref()).unwrap();
    let stiffness = [2.0e4, 2.5e4, 1.2e4, 4.0e3, 3.0e3, 1.5e3];
    for pose in [
        [0.3, -0.5, 1.2, 0.4, 0.8, -0.6],
        [-1.2, 0.4, 0.9, -0.7, -1.1, 2.0],
    ] {
        compare(&robot, &pose, [0.02, 0.01, 0.12], &stiffness, 1.0);
    }
}

#[test]
fn a_parallelogram_with_screws_bends_as_statics_says() {
    let robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    // Screws at the motor (N·m per motor radian), the others at their joints.
    let stiffness = [4.0e4, 1.5, 1.2, 5.0e3, 3.0e3];
    for pose in [[0.4, -1.5, 0.1, 0.2, 0.5], [-0.8, -1.2, -0.3, -0.4, -1.0]] {
        compare(&robot, &pose, [0.0, 0.0, 0.15], &stiffness, 1.0);
    }
}

/// A rail with an arm on it: metres and radians in one chain.
#[test]
fn a_prismatic_joint_bends_as_statics_says() {
    let robot = Robot::new(
        "rail",
        vec![
            Joint::new("rail", JointKind::Prismatic, [0.3, 0.0, 0.0, 0.2]),
            Joint::new("arm", JointKind::Revolute, [1.1, 0.1, 0.0, 0.0]),
            Joint::new("lift", JointKind::Prismatic, [-0.4, 0.5, 0.2, 0.1]),
        ],
    );
    compare(
        &robot,
        &[0.4, 0.7, -0.2],
        [0.1, 0.0, 0.05],
        &[8.0e4, 3.0e3, 5.0e4],
        1.0,
    );
}

/// One drive turns two axes, one of them a slide: behind its spring both move.
#[test]
fn axes_that_follow_joints_bend_with_them() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/mimic/robot.urdf");
    let robot = Robot::load(path.as_ref()).unwrap();
    assert!(robot.has_followers());
    let stiffness = [2.0e4, 2.5e4, 1.2e4, 4.0e3];
    for pose in [[0.3, -0.5, 1.2, 0.4], [-1.2, 0.4, 0.9, -0.7]] {
        compare(&robot, &pose, [0.02, 0.01, 0.12], &stiffness, 1.0);
    }
}

/// The lower arm of the IRp-6 holds the upper arm absolutely: a torque about the elbow alone loads the screw of the upper arm,
/// whose reaction on the shoulder another screw bears. A map without the parallelogram gives another matrix.
#[test]
fn the_parallelogram_is_not_a_chain_of_independent_springs() {
    let robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    let stiffness = [4.0e4, 1.5, 1.2, 5.0e3, 3.0e3];
    let pose = [0.4, -1.5, 0.1, 0.2, 0.5];
    let tool = ToolPoint::new(&robot, [0.0, 0.0, 0.15]).unwrap();
    let found = tool.compliance(&pose, &given(&robot, &stiffness)).unwrap();
    let jacobian = tool.jacobian(&pose).unwrap().1;
    let rows = tool.drives().rows(&pose).unwrap();
    let naive: f64 = (0..5)
        .map(|k| jacobian[(2, k)].powi(2) / (stiffness[k] * rows[(k, k)].powi(2)))
        .sum();
    assert!((naive / found.compliance[2][2] - 1.0).abs() > 0.1);
}

/// Monte Carlo over the stiffness gives the standard deviations that are propagated.
#[test]
fn uncertainty_of_the_stiffness_reaches_both_matrices() {
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::rand_core::SeedableRng;
    let robot = Robot::from_toml(TX40, "tx40.toml".as_ref()).unwrap();
    let stiffness = [2.0e4, 2.5e4, 1.2e4, 4.0e3, 3.0e3, 1.5e3];
    let stds = stiffness.map(|c| 0.02 * c);
    let pose = [0.3, -0.5, 1.2, 0.4, 0.8, -0.6];
    let tool = ToolPoint::new(&robot, [0.02, 0.01, 0.12]).unwrap();
    let mut drives = described_stiffness(&robot).unwrap();
    given_stiffness(&mut drives, &stiffness, &stds).unwrap();
    let found = tool.compliance(&pose, &drives).unwrap();
    let mut dice = rand_pcg::Pcg64Mcg::seed_from_u64(4);
    let mut draws: Vec<[f64; 3]> = Vec::new();
    for _ in 0..2000 {
        let drawn: Vec<f64> = (stiffness.iter().zip(&stds))
            .map(|(c, s)| {
                let normal: f64 = StandardNormal.sample(&mut dice);
                c + s * normal
            })
            .collect();
        let other = tool.compliance(&pose, &given(&robot, &drawn)).unwrap();
        draws.push([
            other.compliance[2][2],
            other.stiffness.unwrap()[0][0],
            other.principal[0].compliance.value,
        ]);
    }
    let predicted = [
        found.compliance_std[2][2],
        found.stiffness_std.unwrap()[0][0],
        found.principal[0].compliance.std,
    ];
    for (k, std) in predicted.iter().enumerate() {
        let list: Vec<f64> = draws.iter().map(|d| d[k]).collect();
        let middle = rig_numerics::statistics::mean(&list);
        let spread = (rig_numerics::statistics::squares_about(&list, middle) / 1999.0).sqrt();
        assert!(
            (spread / std - 1.0).abs() < 0.1,
            "{k}: {spread} against {std}"
        );
    }
}

/// A screw of the IRp-6 has a dead centre on the map: without it one cell would take all colours.
#[test]
fn a_dead_centre_is_named_and_left_blank() {
    let robot = Robot::from_toml(IRP6_TEMPLATE, "irp6.toml".as_ref()).unwrap();
    let options = ComplianceOptions {
        stiffness: vec![5e4, 40.0, 40.0, 5e3, 5e3],
        map: Some([1, 2]),
        ..ComplianceOptions::default()
    };
    let found = identify_compliance(&robot, &[], &[], &options).unwrap();
    let map = found.map.unwrap();
    let blank = map.values.iter().flatten().filter(|v| v.is_none()).count();
    println!(
        "dead centres: {:?}, {blank} blank, {:?} m/N",
        map.singular, map.range
    );
    assert!(!map.singular.is_empty() && blank > 0 && blank < 400);
    assert!(map.range[1] < 1.0, "{:?}", map.range);
    assert!(found.warnings.iter().any(|w| w.contains("dead centre")));
    // A rigid screw does not yield there.
    let rigid = f64::INFINITY;
    let options = ComplianceOptions {
        stiffness: vec![5e4, rigid, rigid, 5e3, 5e3],
        map: Some([1, 2]),
        ..ComplianceOptions::default()
    };
    let found = identify_compliance(&robot, &[], &[], &options).unwrap();
    let map = found.map.unwrap();
    assert!(map.singular.is_empty(), "{:?}", map.singular);
    assert!(map.values.iter().flatten().all(Option::is_some));
    assert!(!found.warnings.iter().any(|w| w.contains("dead centre")));
}

#[test]
fn poses_beyond_limits_and_a_tool_point_on_the_axis_are_told() {
    let robot = Robot::from_toml(TX40, "tx40.toml".as_ref()).unwrap();
    let said = |stiffness: Vec<f64>, pose: Vec<f64>| {
        let options = ComplianceOptions {
            stiffness,
            poses: vec![pose],
            ..ComplianceOptions::default()
        };
        identify_compliance(&robot, &[], &[], &options)
            .unwrap()
            .warnings
            .join(" ")
    };
    let rigid = f64::INFINITY;
    // Only the last joint yields, and its axis holds the origin of the flange.
    let last = vec![rigid, rigid, rigid, rigid, rigid, 1e3];
    let text = said(last, vec![0.1; 6]);
    assert!(
        text.contains("--tool") && !text.contains("limits"),
        "{text}"
    );
    let text = said(vec![1e4; 6], vec![0.0, 9.0, 0.5, 0.0, 0.5, 0.0]);
    assert!(
        text.contains("limits") && !text.contains("--tool"),
        "{text}"
    );
}
