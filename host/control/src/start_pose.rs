//! Where an arm starts to press: a given pose, or the one of a grid from which the tool moves most evenly and that lets it do
//! the task.

use nalgebra::{Matrix3, SymmetricEigen};

use super::contact_task::{ContactOptions, ContactTask, MOBILE};
use super::error::{ControlError, within};
use super::law_model::LawModel;
use super::mobility::jacobian;
use super::position_limits::PositionLimits;
use super::settings::Settings;
use super::task_path;
use rig_model::robot::Robot;
use rig_shared::multibody::column;

/// Poses that are tried of each joint, as shares of its range.
const SHARES: [f64; 3] = [0.25, 0.5, 0.75];
/// Joints of which several poses are tried.
const TRIED: usize = 6;

/// Singular values of the tool's Jacobian, squared, from the largest.
fn reach(model: &LawModel, q: &[f64], tool: [f64; 3]) -> Result<[f64; 3], ControlError> {
    let (_, matrix) = jacobian(model, q, tool)?;
    let square = &matrix * matrix.transpose();
    let square = Matrix3::from_fn(|a, b| square[(a, b)]);
    let mut values: [f64; 3] = SymmetricEigen::new(square).eigenvalues.into();
    values.sort_by(|a, b| b.total_cmp(a));
    Ok(values)
}

fn rank(values: &[f64; 3]) -> usize {
    values
        .iter()
        .filter(|v| **v > MOBILE * values[0] && **v > 0.0)
        .count()
}

/// All poses of a grid that respect the combined limits of coupled drives; the middle first.
fn grid(robot: &Robot) -> Vec<Vec<f64>> {
    let middle = robot.middle_position();
    let mut poses = vec![middle.clone()];
    for (j, joint) in robot.joints.iter().enumerate().take(TRIED) {
        let range = joint.limits.as_ref().map(|l| l.for_motions());
        let [low, high] = match range {
            Some([low, high]) if low.is_finite() && high.is_finite() => [low, high],
            _ => [middle[j] - 1.5, middle[j] + 1.5],
        };
        poses = (poses.iter())
            .flat_map(|pose| {
                SHARES.map(|share| {
                    let mut pose = pose.clone();
                    pose[j] = low + share * (high - low);
                    pose
                })
            })
            .collect();
    }
    let combined = robot.combined_limits();
    let fits = |q: &Vec<f64>| {
        combined.iter().all(|(weights, [low, high])| {
            let sum: f64 = weights.iter().zip(q).map(|(w, q)| w * q).sum();
            let edge = 0.1 * (high - low);
            (low + edge..=high - edge).contains(&sum)
        })
    };
    poses.retain(fits);
    poses.insert(0, middle);
    poses
}

/// A pose of the grid.
struct Candidate {
    pose: Vec<f64>,
    /// Number of directions that the tool moves along.
    rank: usize,
    /// Smallest squared singular value of the tool's Jacobian among them: how evenly it moves.
    least: f64,
}

/// Returns the poses of the grid, those first from which the tool moves along most directions and most evenly.
fn candidates(model: &LawModel, tool: [f64; 3]) -> Result<Vec<Candidate>, ControlError> {
    let mut found = (grid(&model.robot).into_iter())
        .map(|pose| {
            let values = reach(model, &pose, tool)?;
            let rank = rank(&values);
            let least = if rank == 0 { 0.0 } else { values[rank - 1] };
            Ok(Candidate { pose, rank, least })
        })
        .collect::<Result<Vec<_>, ControlError>>()?;
    found.sort_by(|a, b| (b.rank.cmp(&a.rank)).then(b.least.total_cmp(&a.least)));
    Ok(found)
}

/// Returns the number of directions that the tool moves along in the best pose of the grid.
fn best_rank(model: &LawModel, tool: [f64; 3]) -> Result<usize, ControlError> {
    Ok(candidates(model, tool)?.first().map_or(0, |best| best.rank))
}

/// Chooses the tool point in the frame of the last joint, m: the origin, or twice the last link's centre of mass if the arm
/// moves that in more directions. Adds a sentence about it.
///
/// # Errors
/// [`ControlError`] if the model is no valid chain.
pub fn tool_point(model: &LawModel, notes: &mut Vec<String>) -> Result<[f64; 3], ControlError> {
    let last = model.parameters.get(model.chain.last_link());
    let own = last.map_or([0.0; 4], |row| [0, 1, 2, 3].map(|k| row[column::MASS + k]));
    let [mass, x, y, z] = own;
    let at_origin = best_rank(model, [0.0; 3])?;
    if mass > 0.0 && at_origin < model.chain.joint_count().min(3) {
        let end = [x, y, z].map(|moment| 2.0 * moment / mass);
        if best_rank(model, end)? > at_origin {
            notes.push(format!(
                "No tool is given: its point is {:.3}, {:.3}, {:.3} m in the frame of the last joint, twice the centre of mass of the last link.",
                end[0], end[1], end[2]
            ));
            return Ok(end);
        }
    }
    notes.push("No tool is given: its point is the origin of the last joint's frame.".to_owned());
    Ok([0.0; 3])
}

/// Checks a given start pose.
fn check_pose(model: &LawModel, pose: &[f64]) -> Result<(), ControlError> {
    let n = model.chain.joint_count();
    if pose.len() != n {
        return Err(ControlError::Unreachable(format!(
            "--pose has {} numbers; give one for each of the {n} joints.",
            pose.len()
        )));
    }
    if let Some(wrong) = pose.iter().find(|q| !q.is_finite()) {
        return Err(ControlError::Unreachable(format!(
            "--pose contains {wrong}; give a finite number, rad or m, for each joint."
        )));
    }
    let limits = PositionLimits::of(&model.robot);
    let Some(outside) = limits.outside(|j| pose[j]) else {
        return Ok(());
    };
    let turns = pose.iter().any(|q| q.abs() > std::f64::consts::TAU);
    let hint = match turns && limits.outside(|j| pose[j].to_radians()).is_none() {
        true => "It looks like degrees; give it in rad.",
        false => "Give another --pose.",
    };
    Err(ControlError::Unreachable(format!(
        "The start pose is beyond a position limit: {outside}. {hint}"
    )))
}

impl ContactTask {
    /// Chooses a task for the model of a law, with defaults where the options leave them open.
    ///
    /// # Errors
    /// [`ControlError`] if a value is out of range or the tool cannot press there.
    pub fn choose(
        model: &LawModel,
        options: &ContactOptions,
        settings: &Settings,
    ) -> Result<Self, ControlError> {
        options.surface.check()?;
        within(
            "slide",
            options.slide,
            0.0..=1.0,
            "it must be between 0 and 1 m",
        )?;
        if let Some(stiffness) = options.stiffness {
            within(
                "impedance",
                stiffness,
                1.0..=1e6,
                "it must be between 1 and 1000000 N/m",
            )?;
        }
        let mut notes = Vec::new();
        let tool = match options.tool {
            Some(tool) => tool,
            None => tool_point(model, &mut notes)?,
        };
        if let Some(pose) = &options.pose {
            check_pose(model, pose)?;
            return Self::at(model, options, settings, (pose.clone(), tool), notes);
        }
        let mut refused = None;
        for (k, Candidate { pose, .. }) in candidates(model, tool)?.into_iter().enumerate() {
            let list: Vec<String> = pose.iter().map(|q| format!("{q:.3}")).collect();
            let why = match k {
                0 => "where the tool moves most evenly",
                _ => {
                    "the pose where the tool moves most evenly of those from which it can do the task"
                }
            };
            let mut own = notes.clone();
            own.push(format!(
                "No pose is given: the arm starts at {} (rad or m), {why}.",
                list.join(", ")
            ));
            let task = Self::at(model, options, settings, (pose, tool), own);
            match task.and_then(|task| task_path::check(&model.robot, &task).map(|()| task)) {
                Ok(task) => return Ok(task),
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        Err(refused.unwrap_or_else(|| {
            ControlError::Unreachable(
                "No pose of this arm keeps the limits; give one with --pose.".to_owned(),
            )
        }))
    }
}
