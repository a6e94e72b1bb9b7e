//! Limits that no pose can keep: refused before the search, which would look for a motion in vain.
//!
//! A motor's angle is enclosed over the whole range of the joints by interval arithmetic over cells.
//!
//! A joint that moves to and fro starts to move against its Coulomb friction f in both directions, each time at a pose of its
//! range. With the holding torque g(q), its torque there is g + f or more, and g − f or less. So a limit is at least
//! f + max(0, min g, −max g). The pose of the least |g| is searched from random ones.
//!
//! Leaves out that other joints may push a joint by their acceleration, friction of a joint beyond a coupled or varying drive,
//! what two limits exclude together, and a range that is only just too small: the search tells these.

use rand::{RngExt, SeedableRng};
use rig_shared::multibody::column;
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission, motor_column};

use crate::bounds::Bounds;
use crate::drives::{Combined, Drives, into_cranks};
use crate::interval::Interval;
use crate::{ExciteError, LimitedTorque};
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
/// [`ExciteError::MotorAngle`], [`ExciteError::Weak`].
pub(super) fn refuse_unreachable(
    robot: &Robot,
    bounds: &[Bounds],
    combined: &[Combined],
    drives: Option<&Drives>,
    with_torque: bool,
) -> Result<(), ExciteError> {
    if let Some(drives) = drives.filter(|drives| !drives.limits.is_empty()) {
        refuse_angles(robot, bounds, drives)?;
    }
    if with_torque {
        refuse_weak(robot, bounds, combined, drives)?;
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

/// Poses within the limits, and the torques at rest and at the start of a motion there.
struct Poses<'a> {
    model: Model,
    bounds: &'a [Bounds],
    combined: &'a [Combined],
    drives: Option<&'a Drives>,
    /// Of the joints, then of the motors.
    torques: [Vec<f64>; 2],
    still: Vec<f64>,
}

impl Poses<'_> {
    fn transmission(&self, of_motor: bool) -> Option<&Transmission<f64>> {
        let drives = self.drives.filter(|_| of_motor)?;
        Some(&drives.plain)
    }

    /// Moves a pose into the ranges of the cranks; false if it is then outside of a joint's range.
    fn fit(&self, q: &mut [f64]) -> bool {
        into_cranks(self.combined, q, 1.0);
        let mut pairs = q.iter().zip(self.bounds);
        pairs.all(|(q, b)| b.low <= *q && *q <= b.high)
    }

    /// Returns the torque that holds a joint, or its motor; `None` where the motors do not move all joints.
    fn holding(
        &mut self,
        q: &[f64],
        of_motor: bool,
        joint: usize,
    ) -> Result<Option<f64>, ExciteError> {
        let [mut own, mut motors] = core::mem::take(&mut self.torques);
        (self.model).inverse_dynamics(q, &self.still, &self.still, &mut own)?;
        let torque = match self.transmission(of_motor) {
            None => own.get(joint).copied(),
            Some(transmission) => {
                let found = transmission.motor_torque(q, &own, &mut motors);
                found.ok().and_then(|()| motors.get(joint).copied())
            }
        };
        self.torques = [own, motors];
        Ok(torque)
    }

    /// Returns the Coulomb friction of a joint, or of its motor on the motor's side.
    fn coulomb(&self, of_motor: bool, joint: usize) -> Result<f64, ExciteError> {
        let Some((drives, transmission)) = self.drives.zip(self.transmission(of_motor)) else {
            let row = self.model.parameters.get(joint);
            return Ok(row.map_or(0.0, |row| row[column::COULOMB].abs()));
        };
        let n = self.bounds.len();
        let mut q: Vec<f64> = self.bounds.iter().map(Bounds::middle).collect();
        into_cranks(self.combined, &mut q, 0.5);
        let mut directions = vec![0.0; n * n];
        let mut motors = vec![0.0; n];
        let wrong = |e| ExciteError::from(SimulateError::from(e));
        (transmission.motor_directions(&q, &mut directions)).map_err(wrong)?;
        let along = &directions[joint * n..(joint + 1) * n];
        (transmission.motor_torque(&q, along, &mut motors)).map_err(wrong)?;
        let own = drives.parameters[joint * MOTOR_COLUMNS + motor_column::COULOMB];
        Ok((own * motors[joint]).abs())
    }

    /// Returns the least size of a holding torque; 0 if it has both signs.
    fn least_holding(&mut self, of_motor: bool, joint: usize) -> Result<Option<f64>, ExciteError> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        let mut best: Option<(f64, Vec<f64>)> = None;
        for _ in 0..POSES {
            let mut q: Vec<f64> = (self.bounds.iter())
                .map(|b| b.low + random.random::<f64>() * (b.high - b.low))
                .collect();
            if !self.fit(&mut q) {
                continue;
            }
            let Some(torque) = self.holding(&q, of_motor, joint)? else {
                continue;
            };
            match &best {
                Some((least, _)) if least * torque <= 0.0 => return Ok(Some(0.0)),
                Some((least, _)) if least.abs() <= torque.abs() => {}
                _ => best = Some((torque, q)),
            }
        }
        let Some((mut least, mut q)) = best else {
            return Ok(None);
        };
        for halving in 0..HALVINGS {
            let share = 0.25 * 0.5_f64.powi(halving);
            for k in 0..q.len() {
                for sign in [-1.0, 1.0] {
                    let b = &self.bounds[k];
                    let mut near = q.clone();
                    near[k] = (q[k] + sign * share * (b.high - b.low)).clamp(b.low, b.high);
                    if !self.fit(&mut near) {
                        continue;
                    }
                    match self.holding(&near, of_motor, joint)? {
                        Some(torque) if torque * least <= 0.0 => return Ok(Some(0.0)),
                        Some(torque) if torque.abs() < least.abs() => (least, q) = (torque, near),
                        _ => {}
                    }
                }
            }
        }
        Ok(Some(least.abs()))
    }
}

/// Refuses a torque limit below the torque that starts to move the arm, at every pose.
fn refuse_weak(
    robot: &Robot,
    bounds: &[Bounds],
    combined: &[Combined],
    drives: Option<&Drives>,
) -> Result<(), ExciteError> {
    let n = bounds.len();
    let mut poses = Poses {
        model: Model::from_robot(robot)?,
        bounds,
        combined,
        drives,
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
                LimitedTorque::Joint(robot.joints[j].kind == JointKind::Revolute),
            ),
            (motor.filter(|t| t.is_finite()), LimitedTorque::Motor),
        ];
        for (limit, of) in limits {
            let Some(limit) = limit else { continue };
            let of_motor = of == LimitedTorque::Motor;
            let Some(gravity) = poses.least_holding(of_motor, j)? else {
                continue;
            };
            let coulomb = poses.coulomb(of_motor, j)?;
            if gravity + coulomb >= limit {
                return Err(ExciteError::Weak {
                    joint: robot.joints[j].name.clone(),
                    of,
                    limit,
                    gravity,
                    coulomb,
                });
            }
        }
    }
    Ok(())
}
