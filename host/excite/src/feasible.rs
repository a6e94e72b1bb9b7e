//! Limits that no pose can keep: refused before the search, which would look for a motion in vain.
//!
//! A motor's angle is enclosed over the whole range of the joints by interval arithmetic over cells. A torque that holds the
//! arm is smaller than a limit at some pose, or has both signs, or no periodic motion keeps the limit: the mean torque over a
//! period is that of the weight along it. The pose of the least torque is searched from random ones.
//!
//! Leaves out what two limits exclude together, and a range that is only just too small: the search tells these.

use rand::{RngExt, SeedableRng};
use rig_shared::transmission::Transmission;

use crate::bounds::Bounds;
use crate::drives::Drives;
use crate::interval::Interval;
use crate::{ExciteError, HeldLimit};
use rig_model::robot::{JointKind, Robot};
use rig_model::simulate::{Model, SimulateError};

/// Cells of the joints' ranges over which angles are enclosed. With five joints each range has seven.
const CELLS: f64 = 20_000.0;
/// Most cells of one range.
const MOST_CELLS: usize = 64;
/// Random poses at which the holding torque is computed.
const POSES: usize = 2000;
/// Halvings of the step from the best of them, whose first is a quarter of the ranges.
const HALVINGS: i32 = 12;

/// Refuses limits of motors, and of the torques of joints, that no pose within the bounds keeps. Torques count if all links
/// are described.
///
/// # Errors
/// [`ExciteError::MotorAngle`], [`ExciteError::Holding`].
pub(super) fn refuse_unreachable(
    robot: &Robot,
    bounds: &[Bounds],
    drives: Option<&Drives>,
    with_torque: bool,
) -> Result<(), ExciteError> {
    if let Some(drives) = drives.filter(|drives| !drives.limits.is_empty()) {
        refuse_angles(robot, bounds, drives)?;
    }
    if with_torque {
        refuse_holding(robot, bounds, drives)?;
    }
    Ok(())
}

/// Refuses a range of a motor outside of what the joints' ranges give it.
fn refuse_angles(robot: &Robot, bounds: &[Bounds], drives: &Drives) -> Result<(), ExciteError> {
    let n = bounds.len();
    let each = (CELLS.powf(1.0 / n as f64) as usize).clamp(1, MOST_CELLS);
    let mut turned = vec![[f64::INFINITY, f64::NEG_INFINITY]; n];
    let mut angles = vec![Interval::default(); n];
    for cell in 0..each.pow(n as u32) {
        let mut rest = cell;
        let q: Vec<Interval> = (bounds.iter())
            .map(|b| {
                let step = (b.high - b.low) / each as f64;
                let low = b.low + step * (rest % each) as f64;
                rest /= each;
                Interval::hull(low, low + step)
            })
            .collect();
        (drives.enclosing)
            .motor_position(&q, &mut angles)
            .map_err(SimulateError::from)?;
        for (turned, angle) in turned.iter_mut().zip(&angles) {
            *turned = [turned[0].min(angle.low), turned[1].max(angle.high)];
        }
    }
    for ((joint, limit), turned) in robot.joints.iter().zip(&drives.limits).zip(turned) {
        if turned[1] <= limit.range[0] || turned[0] >= limit.range[1] {
            return Err(ExciteError::MotorAngle {
                joint: joint.name.clone(),
                limit: limit.range,
                turned,
            });
        }
    }
    Ok(())
}

/// The torques at rest.
struct Holding<'a> {
    model: Model,
    transmission: Option<&'a Transmission<f64>>,
    /// Of the joints, then of the motors.
    torques: [Vec<f64>; 2],
    still: Vec<f64>,
}

impl Holding<'_> {
    /// Returns the torque of a joint, or of its motor; `None` where the motors do not move all joints.
    fn at(&mut self, q: &[f64], of_motor: bool, joint: usize) -> Result<Option<f64>, ExciteError> {
        let [own, motors] = &mut self.torques;
        (self.model).inverse_dynamics(q, &self.still, &self.still, own)?;
        let Some(transmission) = self.transmission.filter(|_| of_motor) else {
            return Ok(own.get(joint).copied());
        };
        let found = transmission.motor_torque(q, own, motors);
        Ok(found.ok().and_then(|()| motors.get(joint).copied()))
    }
}

/// Refuses a torque limit below the torque that holds the arm at every pose.
fn refuse_holding(
    robot: &Robot,
    bounds: &[Bounds],
    drives: Option<&Drives>,
) -> Result<(), ExciteError> {
    let n = bounds.len();
    let mut holding = Holding {
        model: Model::from_robot(robot)?,
        transmission: drives.map(|drives| &drives.plain),
        torques: [vec![0.0; n], vec![0.0; n]],
        still: vec![0.0; n],
    };
    for (j, own) in bounds.iter().enumerate() {
        let motor = drives
            .and_then(|drives| drives.limits.get(j))
            .map(|m| m.torque);
        let limits = [
            (
                own.torque,
                HeldLimit::Joint(robot.joints[j].kind == JointKind::Revolute),
            ),
            (motor.filter(|t| t.is_finite()), HeldLimit::Motor),
        ];
        for (limit, of) in limits {
            let Some(limit) = limit else { continue };
            let least = least_torque(&mut holding, bounds, of == HeldLimit::Motor, j)?;
            if let Some(least) = least.filter(|least| *least >= limit) {
                return Err(ExciteError::Holding {
                    joint: robot.joints[j].name.clone(),
                    of,
                    limit,
                    least,
                });
            }
        }
    }
    Ok(())
}

/// Returns the least holding torque within the bounds; `None` if it has both signs, so that it is zero somewhere.
fn least_torque(
    holding: &mut Holding<'_>,
    bounds: &[Bounds],
    of_motor: bool,
    joint: usize,
) -> Result<Option<f64>, ExciteError> {
    let mut random = rand_pcg::Pcg64::seed_from_u64(1);
    let mut best: Option<(f64, Vec<f64>)> = None;
    for _ in 0..POSES {
        let q: Vec<f64> = (bounds.iter())
            .map(|b| b.low + random.random::<f64>() * (b.high - b.low))
            .collect();
        let Some(torque) = holding.at(&q, of_motor, joint)? else {
            continue;
        };
        match &best {
            Some((least, _)) if least * torque <= 0.0 => return Ok(None),
            Some((least, _)) if least.abs() <= torque.abs() => {}
            _ => best = Some((torque, q)),
        }
    }
    let Some((mut least, mut q)) = best else {
        return Ok(None);
    };
    for halving in 0..HALVINGS {
        let share = 0.25 * 0.5_f64.powi(halving);
        for (k, b) in bounds.iter().enumerate() {
            for sign in [-1.0, 1.0] {
                let from = q[k];
                q[k] = (from + sign * share * (b.high - b.low)).clamp(b.low, b.high);
                match holding.at(&q, of_motor, joint)? {
                    Some(torque) if torque * least <= 0.0 => return Ok(None),
                    Some(torque) if torque.abs() < least.abs() => least = torque,
                    _ => q[k] = from,
                }
            }
        }
    }
    Ok(Some(least.abs()))
}
