//! Poses within the limits, and gravity in the sensor's frame.

use nalgebra::{Isometry3, Vector3};
use rand::RngExt;
use rand_pcg::Pcg64;
use rig_shared::multibody::{column, inverse_dynamics, point_position};
use rig_shared::transmission::Transmission;

use crate::ExciteError;
use crate::bounds::{Bounds, prior};
use crate::drives::{Combined, Drives, into_cranks};
use crate::feasible::refuse_unreachable;
use crate::motor_limits::MotorBounds;
use crate::workspace::{Plane, planes_of};
use rig_model::robot::{Robot, WristSensor};
use rig_model::simulate::{Model, SimulateError};

/// Share of a torque limit that holding a pose may take; the rest is for moving and for friction.
const HOLDING: f64 = 0.8;
/// Share of each range that stays free at both ends besides the margin, so that a pose rounded to single precision is
/// within it.
const ROUNDING: f64 = 1e-6;
/// Number of random positions drawn for each wanted pose before the limits count as too tight.
const DRAWS: usize = 50;
/// Change of gravity relative to its size that is rounding.
const SAME: f64 = 1e-9;

/// A pose.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pose {
    /// Positions of the joints, rad or m.
    pub q: Vec<f64>,
    /// Gravity in the sensor's axes, m/s².
    pub gravity: Vector3<f64>,
}

/// The poses that a robot can hold.
pub(super) struct Space<'a> {
    pub robot: &'a Robot,
    sensor: Isometry3<f64>,
    pub model: Model,
    pub bounds: Vec<Bounds>,
    combined: Vec<Combined>,
    transmission: Transmission<f64>,
    /// Limits of the motors; empty if there are none.
    motors: Vec<MotorBounds>,
    pub planes: Vec<Plane>,
    /// True if the torque is known and limited.
    pub knows_torque: bool,
    /// True if every link is described.
    pub has_bodies: bool,
}

impl<'a> Space<'a> {
    pub(super) fn new(
        robot: &'a Robot,
        sensor: &WristSensor,
        bounds: Vec<Bounds>,
    ) -> Result<Self, ExciteError> {
        let model = Model::from_robot(robot)?;
        let limited = bounds.iter().any(|b| b.torque.is_some());
        let has_bodies = prior(robot, &model).is_ok();
        let combined = Combined::of(robot);
        let drives = Drives::of(robot, model.motors.clone(), &bounds, 1.0)?;
        refuse_unreachable(robot, &bounds, &combined, drives.as_ref(), has_bodies)?;
        Ok(Self {
            robot,
            sensor: robot.flange_pose() * sensor.pose(),
            knows_torque: limited && has_bodies,
            has_bodies,
            transmission: robot.transmission().map_err(SimulateError::from)?,
            motors: MotorBounds::all(robot, 1.0),
            model,
            bounds,
            combined,
            planes: planes_of(robot),
        })
    }

    /// Returns the middle of all ranges.
    pub(super) fn middle(&self) -> Vec<f64> {
        let mut middle: Vec<f64> = self.bounds.iter().map(Bounds::middle).collect();
        into_cranks(&self.combined, &mut middle, 0.5);
        middle
    }

    /// Returns the pose at joint positions.
    pub(super) fn pose(&self, q: Vec<f64>) -> Pose {
        let last = self.robot.last_pose(&q);
        let gravity = (last * self.sensor).rotation.inverse() * Vector3::from(self.robot.gravity);
        Pose { q, gravity }
    }

    /// Returns the joint and the limit that a position violates.
    pub(super) fn violated(&self, q: &[f64]) -> Result<Option<(usize, &'static str)>, ExciteError> {
        for (j, (b, q)) in self.bounds.iter().zip(q).enumerate() {
            let free = ROUNDING * (b.high - b.low);
            if !(b.low + free <= *q && *q <= b.high - free) {
                return Ok(Some((j, "position")));
            }
        }
        for limit in &self.combined {
            if !(limit.low..=limit.high).contains(&limit.at(q.iter().copied())) {
                return Ok(Some((limit.joint, "crank")));
            }
        }
        if !self.motors.is_empty() {
            let mut angles = vec![0.0; q.len()];
            (self.transmission)
                .motor_position(q, &mut angles)
                .map_err(SimulateError::from)?;
            let mut pairs = self.motors.iter().zip(&angles);
            if let Some(j) = pairs.position(|(own, angle)| !own.has(*angle)) {
                return Ok(Some((j, "motor angle")));
            }
        }
        for plane in &self.planes {
            if self.height(plane, q)? < plane.least {
                return Ok(Some((plane.link, "workspace")));
            }
        }
        Ok(self.overloaded(q)?.map(|joint| (joint, "torque")))
    }

    /// Returns the distance of a plane's point along its normal.
    pub(super) fn height(&self, plane: &Plane, q: &[f64]) -> Result<f64, ExciteError> {
        let mut jacobian = vec![[0.0; 3]; q.len()];
        let at = point_position(&self.model.chain, q, plane.link, plane.point, &mut jacobian)?;
        Ok(plane.height(at))
    }

    /// Returns a joint that holding a position loads too much. Friction counts in the whole motion only.
    fn overloaded(&self, q: &[f64]) -> Result<Option<usize>, ExciteError> {
        if !self.knows_torque {
            return Ok(None);
        }
        let rest = vec![0.0; q.len()];
        let mut rows = self.model.parameters.clone();
        for row in &mut rows {
            row[column::COULOMB] = 0.0;
        }
        let mut tau = vec![0.0; q.len()];
        inverse_dynamics(&self.model.chain, &rows, q, &rest, &rest, &mut tau)?;
        Ok((self.bounds.iter().zip(&tau))
            .position(|(b, tau)| b.torque.is_some_and(|limit| tau.abs() > HOLDING * limit)))
    }

    /// Draws `count` poses within the limits.
    ///
    /// # Errors
    /// [`ExciteError::Infeasible`] if fewer are found.
    pub(super) fn draw(
        &self,
        count: usize,
        seed: u64,
        stream: u64,
    ) -> Result<Vec<Pose>, ExciteError> {
        let mut random = Pcg64::new(u128::from(seed), u128::from(stream));
        let mut found = Vec::with_capacity(count);
        let mut blame = (0, "position");
        for _ in 0..DRAWS * count {
            let q: Vec<f64> = (self.bounds.iter())
                .map(|b| b.middle() + b.half() * (2.0 * random.random::<f64>() - 1.0))
                .collect();
            match self.violated(&q)? {
                Some(at) => blame = at,
                None => found.push(self.pose(q)),
            }
            if found.len() == count {
                return Ok(found);
            }
        }
        Err(self.infeasible(blame))
    }

    /// Returns the error of a limit that leaves no room.
    pub(super) fn infeasible(&self, (joint, limit): (usize, &'static str)) -> ExciteError {
        ExciteError::Infeasible {
            joint: self.robot.joints[joint].name.clone(),
            limit,
        }
    }

    /// Moves each joint that does not turn gravity in the sensor's frame to `home`, where the limits allow it.
    pub(super) fn settled(&self, mut pose: Pose, home: &[f64]) -> Result<Pose, ExciteError> {
        for (j, at) in home.iter().enumerate() {
            let mut q = pose.q.clone();
            q[j] = *at;
            let moved = self.pose(q);
            let change = (moved.gravity - pose.gravity).norm();
            if change <= SAME * pose.gravity.norm() && self.violated(&moved.q)?.is_none() {
                pose = moved;
            }
        }
        Ok(pose)
    }
}
