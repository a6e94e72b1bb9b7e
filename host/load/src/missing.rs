//! What the data do not show of the load, and the pose or motion that would.

use nalgebra::SMatrix;
use rand::{RngExt, SeedableRng};
use rig_model::robot::Robot;
use rig_shared::multibody::{COLUMN_NAMES, Chain, INERTIAL_PARAMETERS, wrench_regressor};

use crate::estimate::{Estimate, Square};
use crate::options::By;
use crate::reach::{Movement, shown_by};
use crate::result::NotShown;
use crate::wrench_row::{ENTRIES, about};

/// Poses that are compared.
const CANDIDATES: usize = 400;
/// Share of the range of a joint that a pose uses, so that it can be reached.
const USED_RANGE: f64 = 0.9;
/// Share of the weight of the known load that a reading of a further pose is uncertain by.
const READING: f64 = 0.01;

/// Returns what the data do not show. For mass and centre of mass it names the pose, of a seeded sample within the
/// limits, that reduces their uncertainty most.
pub(crate) fn missing(
    robot: &Robot,
    chain: &Chain<f64>,
    to_joint: &SMatrix<f64, INERTIAL_PARAMETERS, INERTIAL_PARAMETERS>,
    found: &Estimate,
    by: By,
) -> Vec<NotShown> {
    let shown = found.shown();
    let can = |movement: Movement| shown_by(robot, chain, to_joint, (by, movement));
    let (Ok(by_motion), Ok(by_poses)) = (can(Movement::Any), can(Movement::Rest)) else {
        return Vec::new();
    };
    let of = |range: std::ops::Range<usize>, is_shown_by: &dyn Fn(usize) -> bool| {
        let own = range.filter(|k| !shown[*k] && is_shown_by(*k));
        own.map(|k| COLUMN_NAMES[k]).collect::<Vec<_>>()
    };
    let is_still = |k: usize| by != By::Torque && by_poses[k];
    let all = [
        NotShown {
            parameters: of(0..4, &|k| is_still(k)),
            experiment: "Add a pose in which gravity has another direction in the sensor; `rig excite --load --poses 6` designs a set.".to_owned(),
            pose: further_pose(robot, chain, to_joint, found),
        },
        NotShown {
            parameters: of(0..4, &|k| by_motion[k] && !is_still(k)),
            experiment: "Record a motion that turns the load about other axes, so that gravity and acceleration act on it in other directions; `rig excite --load` designs one.".to_owned(),
            pose: None,
        },
        NotShown {
            parameters: of(4..INERTIAL_PARAMETERS, &|k| by_motion[k]),
            experiment: "Inertia shows only while the load turns and accelerates about its axes: record a livelier motion of the wrist; `rig excite --load` designs one.".to_owned(),
            pose: None,
        },
        NotShown {
            parameters: of(0..INERTIAL_PARAMETERS, &|k| !by_motion[k]),
            experiment: no_motion(by),
            pose: None,
        },
    ];
    all.into_iter()
        .filter(|own| !own.parameters.is_empty())
        .collect()
}

/// Says that no motion of the robot shows a parameter.
fn no_motion(by: By) -> String {
    let [what, beside] = match by {
        By::Torque => ["the joint torques", ""],
        By::Sensor => ["the readings", " or the biases"],
        By::Both => ["the readings and the joint torques", " or the biases"],
    };
    format!(
        "No motion of this robot shows them: they have no effect on {what}, or only one that other parameters{beside} have too. Take them from a drawing of the load, or identify it on a robot that turns it about other axes."
    )
}

/// Returns the pose that leaves the least uncertainty of mass and centre of mass.
fn further_pose(
    robot: &Robot,
    chain: &Chain<f64>,
    to_joint: &SMatrix<f64, INERTIAL_PARAMETERS, INERTIAL_PARAMETERS>,
    found: &Estimate,
) -> Option<Vec<f64>> {
    let ranges: Vec<[f64; 2]> = robot
        .joints
        .iter()
        .map(|joint| {
            let [low, high] = joint.limits.as_ref().map_or([-3.1, 3.1], |l| l.position);
            let [low, high] = [low.max(-3.1), high.min(3.1)];
            let (middle, half) = (0.5 * (low + high), 0.5 * USED_RANGE * (high - low));
            [middle - half, middle + half]
        })
        .collect();
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let still = vec![0.0; ranges.len()];
    let sensor = robot.flange_pose() * robot.wrist_sensor.clone().unwrap_or_default().pose();
    let prior = found.covariance + found.beyond;
    let mut best: Option<(f64, Vec<f64>)> = None;
    for _ in 0..CANDIDATES {
        let q: Vec<f64> = ranges
            .iter()
            .map(|[low, high]| low + (high - low) * random.random::<f64>())
            .collect();
        let mut regressor = [0.0; ENTRIES];
        wrench_regressor(chain, &q, &still, &still, &mut regressor).ok()?;
        about(&sensor.translation.vector, &mut regressor);
        let rows = SMatrix::<f64, 6, INERTIAL_PARAMETERS>::from_row_slice(&regressor) * to_joint;
        let left = spread_after(&prior, &rows, found)?;
        if best.as_ref().is_none_or(|(least, _)| left < *least) {
            best = Some((left, q));
        }
    }
    best.map(|(_, q)| q)
}

/// Returns the sum of the variances of mass and first moments, in plausible sizes, after one more reading.
fn spread_after(
    prior: &Square,
    rows: &SMatrix<f64, 6, INERTIAL_PARAMETERS>,
    found: &Estimate,
) -> Option<f64> {
    let weight = 9.81 * found.sizes[0] * READING;
    let lever = weight * crate::estimate::PLAUSIBLE_DISTANCE;
    let mut noise = SMatrix::<f64, 6, 6>::zeros();
    for k in 0..6 {
        noise[(k, k)] = if k < 3 {
            weight * weight
        } else {
            lever * lever
        };
    }
    // One step of a Kalman filter.
    let innovation = rows * prior * rows.transpose() + noise;
    let gain = innovation.cholesky()?.solve(&(rows * prior));
    let after = prior - prior * rows.transpose() * gain;
    Some((0..4).map(|k| after[(k, k)] / found.sizes[k].powi(2)).sum())
}
