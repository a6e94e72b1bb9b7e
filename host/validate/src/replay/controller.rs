//! Controllers that hold a simulated motion at the recorded one.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use rig_data::runs::Run;
use rig_model::robot::{Controller, Robot};
use rig_model::simulate::{Model, STAND_IN_BANDWIDTH, SimulateError, controllers};
use rig_output::format_unit;

/// Share of the torque's power that a controller with its feed-forward must explain.
const EXPLAINED: f64 = 0.98;
/// Largest number of rows in the regression.
const ROWS: usize = 20_000;
/// Regressors of the torque: position and velocity error, integral of the position error, velocity and acceleration of
/// the reference, its sine and cosine (gravity feed-forward), a constant.
const COLUMNS: usize = 8;
/// Trial controllers by their columns, the simplest first: if a motion has few frequencies, many columns are collinear.
/// The reference's velocity beside the velocity error also covers pure velocity feedback.
const SETS: [&[usize]; 4] = [
    &[0, 1, 7],
    &[0, 1, 3, 7],
    &[0, 1, 3, 4, 5, 6, 7],
    &[0, 1, 2, 3, 4, 5, 6, 7],
];

/// Returns the controllers of all joints and a sentence on their origin, or on why there are none. `moving` is the
/// robot with the inertia for which substitutes are designed.
pub fn of_joints(robot: &Robot, moving: &Robot, runs: &[Run]) -> (Option<Vec<Controller>>, String) {
    let none = |why: &str| (None, format!("The motion was not simulated: {why}"));
    let joints = || robot.joints.iter().enumerate();
    let torqueless = |j: usize| runs.iter().any(|run| run.joints[j].tau.len() < run.len());
    if let Some((_, joint)) = joints().find(|(j, _)| torqueless(*j)) {
        return none(&format!(
            "the torque of joint {} is not recorded.",
            joint.name
        ));
    }
    let stand_ins = match stand_ins(moving, runs) {
        Ok(list) => list,
        Err(error) => return none(&error.to_string()),
    };
    let loops = |c: &Controller| c.torque_gain * c.velocity_gain * c.position_gain > 0.0;
    let (mut list, mut sources) = (Vec::new(), Vec::<(String, Vec<&str>)>::new());
    for ((j, joint), stand_in) in joints().zip(stand_ins) {
        let own = joint.controller.clone().filter(loops);
        let (controller, from) = if let Some(own) = own {
            (own, "the description's own".to_owned())
        } else if let Some(shown) = regressed(runs, j) {
            let from = "the one that the references in the recordings show";
            (shown, from.to_owned())
        } else {
            let from =
                format!("a stand-in of {STAND_IN_BANDWIDTH} Hz, as the recordings show none");
            (stand_in, from)
        };
        list.push(controller);
        match sources.iter_mut().find(|(known, _)| *known == from) {
            Some((_, names)) => names.push(&joint.name),
            None => sources.push((from, vec![&joint.name])),
        }
    }
    let how = match (robot.joints.as_slice(), list.as_slice()) {
        ([joint], [c]) => {
            let (position, effort) = joint.kind.units();
            let kd = c.torque_gain * c.velocity_gain;
            format!(
                "The recorded torque drives each model, and a controller holds it to the recorded motion: {} ({:.3} {} and {kd:.3} {}).",
                sources[0].0,
                kd * c.position_gain,
                format_unit(&format!("{effort}/{position}")),
                format_unit(&format!("{effort}*s/{position}"))
            )
        }
        _ => {
            let one = sources.len() == 1;
            let told: Vec<String> = (sources.into_iter())
                .map(|(from, names)| match one {
                    true => format!("{from}, at each joint"),
                    false => format!("{from} (joint {})", names.join(", ")),
                })
                .collect();
            format!(
                "The recorded torques drive each model, and a controller at each joint holds it to the recorded motion: {}.",
                told.join("; ")
            )
        }
    };
    (Some(list), how)
}

/// Designs slow controllers for the described inertia, one per joint.
fn stand_ins(robot: &Robot, runs: &[Run]) -> Result<Vec<Controller>, SimulateError> {
    let mut bare = robot.clone();
    bare.joints.iter_mut().for_each(|j| j.controller = None);
    let model = Model::from_robot(&bare)?;
    let start = runs.iter().find(|run| !run.is_empty());
    let q: Vec<f64> = (0..bare.joints.len())
        .map(|j| start.map_or(0.0, |run| run.joints[j].q[0]))
        .collect();
    Ok(controllers(&bare, &model, &q)?.0)
}

/// Fits a joint's controller to the references and torques of the runs; none if there are none or the fit is poor.
pub(super) fn regressed(runs: &[Run], joint: usize) -> Option<Controller> {
    let every = runs
        .iter()
        .map(Run::len)
        .sum::<usize>()
        .div_ceil(ROWS)
        .max(1);
    let mut normal = DMatrix::<f64>::zeros(COLUMNS, COLUMNS);
    let mut right = DVector::<f64>::zeros(COLUMNS);
    let (mut power, mut mean, mut count) = (0.0, 0.0, 0.0);
    for run in runs {
        let joint = &run.joints[joint];
        let r = joint.reference.as_ref()?;
        let torque = joint.recorded();
        let mut integral = 0.0;
        for k in 1..run.len().saturating_sub(1) {
            let e = r[k] - joint.q[k];
            integral += e / run.rate;
            if k % every != 0 {
                continue;
            }
            let speed = 0.5 * (r[k + 1] - r[k - 1]) * run.rate;
            let acceleration = (r[k + 1] - 2.0 * r[k] + r[k - 1]) * run.rate * run.rate;
            let (sin, cos) = r[k].sin_cos();
            let row = [
                e,
                speed - joint.qd[k],
                integral,
                speed,
                acceleration,
                sin,
                cos,
                1.0,
            ];
            for (i, a) in row.iter().enumerate() {
                right[i] += a * torque[k];
                for (j, b) in row.iter().enumerate() {
                    normal[(i, j)] += a * b;
                }
            }
            power += torque[k].powi(2);
            mean += torque[k];
            count += 1.0;
        }
    }
    let constant = mean * mean / f64::max(count, 1.0);
    SETS.iter().find_map(|set| {
        // Columns have very different units, and some may be zero.
        let scale = |i: usize| {
            let size = normal[(i, i)].sqrt();
            if size > 0.0 { 1.0 / size } else { 0.0 }
        };
        let n = set.len();
        let entry = |a: usize, b: usize| {
            let (i, j) = (set[a], set[b]);
            scale(i) * scale(j) * normal[(i, j)]
        };
        let target = DVector::from_fn(n, |a, _| scale(set[a]) * right[set[a]]);
        let x = Svd::of(DMatrix::from_fn(n, n, entry)).solve(&target, 1.0e-10);
        let explained = x.dot(&target) - constant;
        let (kp, kd) = (scale(0) * x[0], scale(1) * x[1]);
        (explained >= EXPLAINED * (power - constant) && kp > 0.0 && kd > 0.0).then_some(
            Controller {
                position_gain: kp / kd,
                velocity_gain: kd,
                torque_gain: 1.0,
            },
        )
    })
}
