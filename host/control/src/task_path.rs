//! Check that an arm can follow a contact task within its position limits, before the motion.

use nalgebra::{DMatrix, DVector};

use super::contact_task::ContactTask;
use super::error::ControlError;
use super::law_model::LawModel;
use super::mobility::{inverse_inertia, jacobian};
use super::position_limits::PositionLimits;
use rig_model::robot::Robot;

/// Distance between two checked points of the path, m.
const STEP: f64 = 0.005;
/// Iterations at one point that move the free joints towards the posture, and their share of the distance. A full step
/// overshoots where the free directions turn: on the IRp-6 it did not converge 0.115 m from the start (27 November 2026).
const RELAXING: usize = 30;
const SHARE: f64 = 0.2;
/// Iterations that then move the tool alone onto the point, by Newton's method.
const NEWTON: usize = 10;
/// Distance from the path that counts as reached, m.
const REACHED: f64 = 1e-6;

/// Checks the path of a task: into the surface, then along it. The joints that the tool leaves free are in the equilibrium
/// of the laws' posture: A⁻¹-weighted, towards the start pose.
///
/// # Errors
/// [`ControlError::Unreachable`] if a point is out of reach or a joint would leave its limits.
pub(crate) fn check(robot: &Robot, task: &ContactTask) -> Result<(), ControlError> {
    let model = LawModel::of(robot)?;
    let limits = PositionLimits::of(robot);
    if let Some(outside) = limits.outside(|j| task.pose[j]) {
        return Err(ControlError::Unreachable(format!(
            "The start pose is beyond a position limit: {outside}. Give another --pose."
        )));
    }
    let depth = task.surface.gap + task.force / task.surface.stiffness;
    let points = |length: f64| {
        let count = (length / STEP).ceil() as usize;
        (1..=count).map(move |k| length * k as f64 / count as f64)
    };
    let path = (points(depth).map(|x| [x, 0.0])).chain(points(task.slide).map(|x| [depth, x]));
    let mut q = DVector::from_column_slice(&task.pose);
    for [into, along] in path {
        let what = match along > 0.0 {
            true => format!("{along:.3} m along the surface"),
            false => format!("{into:.3} m towards the surface"),
        };
        if !reach(&model, task, &mut q, [into, along])? {
            return Err(ControlError::Unreachable(format!(
                "The tool cannot follow the task: the arm does not reach the point {what}. Give a shorter --slide, a smaller --gap, or another --pose or --normal."
            )));
        }
        if let Some(outside) = limits.outside(|j| q[j]) {
            return Err(ControlError::Unreachable(format!(
                "The tool cannot follow the task within the position limits: {what} it needs {outside}. Give a shorter --slide, a smaller --gap, or another --pose or --normal."
            )));
        }
    }
    Ok(())
}

/// Moves the joints until the tool is at a point of the task. Returns false if they do not get there.
fn reach(
    model: &LawModel,
    task: &ContactTask,
    q: &mut DVector<f64>,
    point: [f64; 2],
) -> Result<bool, ControlError> {
    let (n, count) = (q.len(), task.directions.len());
    let start = DVector::from_column_slice(&task.pose);
    let directions = DMatrix::from_fn(count, 3, |d, axis| task.directions[d][axis]);
    let mut distance = f64::INFINITY;
    for iteration in 0..RELAXING + NEWTON {
        let (position, matrix) = jacobian(model, q.as_slice(), task.tool)?;
        let moved = DVector::from_fn(3, |axis, _| position[axis] - task.origin[axis]);
        let mut off = -(&directions * moved);
        for (own, wanted) in off.iter_mut().zip(point) {
            *own += wanted;
        }
        distance = off.norm();
        let along = &directions * matrix;
        let weighted = inverse_inertia(model, q.as_slice())? * along.transpose();
        let Some(inertia) = (&along * &weighted).try_inverse() else {
            return Ok(false);
        };
        let generalized = weighted * inertia;
        let free = DMatrix::identity(n, n) - &generalized * along;
        let mut step = generalized * off;
        if iteration < RELAXING {
            step += SHARE * free * (&start - &*q);
        } else if distance < REACHED {
            break;
        }
        if !step.iter().all(|v| v.is_finite()) {
            return Ok(false);
        }
        *q += step;
    }
    Ok(distance < REACHED)
}
