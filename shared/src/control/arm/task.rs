//! The task frame: directions along which a tool moves and presses.

use super::fault::{ControlFault, check};
use crate::multibody::{Chain, MAX_JOINTS, Pose, convective, convective_acceleration, frame_pose};
use crate::scalar::Real;

/// Most directions of a task: those of a point.
pub const AXES: usize = 3;

/// A point of the last link as the tool, and up to three orthogonal directions in the base frame.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a, T> {
    /// The tool point in the frame of the last joint, m.
    pub tool: [T; 3],
    /// Origin of the task frame in the base frame, m.
    pub origin: [T; 3],
    /// Orthogonal unit vectors, one to three.
    pub directions: &'a [[T; 3]],
}

/// Motion of the tool along the directions of a task.
#[derive(Clone, Copy, Debug)]
pub struct TaskMotion<T> {
    /// Distance from the origin along each direction, m.
    pub position: [T; AXES],
    /// m/s
    pub velocity: [T; AXES],
    /// Acceleration of the tool at q̈ = 0, J̇·q̇, m/s².
    pub convective: [T; AXES],
    /// Jacobian, one row a direction: m per rad or m of each joint.
    pub rows: [[T; MAX_JOINTS]; AXES],
}

impl<T: Real> Task<'_, T> {
    /// Returns the force of the tool on the environment along each direction, N, from that of the environment on the
    /// tool in the base frame.
    pub(super) fn pressed(&self, force: &[T; 3]) -> [T; AXES] {
        let mut out = [T::ZERO; AXES];
        for (own, direction) in out.iter_mut().zip(self.directions) {
            for (&along, &value) in direction.iter().zip(force) {
                *own -= along * value;
            }
        }
        out
    }

    /// Computes the motion of the tool at joint positions `q` and velocities `qd`.
    ///
    /// # Errors
    /// [`ControlFault`] on wrong lengths, also if there are no or more than three directions.
    pub fn motion(
        &self,
        chain: &Chain<T>,
        q: &[T],
        qd: &[T],
    ) -> Result<TaskMotion<T>, ControlFault> {
        let n = chain.joint_count();
        check("qd", n, qd.len())?;
        let count = self.directions.len();
        check("directions", count.clamp(1, AXES), count)?;
        let one = |k: usize| core::array::from_fn(|i| if i == k { T::ONE } else { T::ZERO });
        let fixed = Pose {
            position: self.tool,
            rotation: [one(0), one(1), one(2)],
        };
        let mut jacobian = [[T::ZERO; 6]; MAX_JOINTS];
        let jacobian = &mut jacobian[..n];
        let last = chain.last_link();
        let pose = frame_pose(chain, q, last, &fixed, jacobian)?;
        let bend = match chain.has_followers() {
            false => convective(jacobian, qd),
            true => convective_acceleration(chain, [q, qd], last, &fixed)?,
        };
        let mut motion = TaskMotion {
            position: [T::ZERO; AXES],
            velocity: [T::ZERO; AXES],
            convective: [T::ZERO; AXES],
            rows: [[T::ZERO; MAX_JOINTS]; AXES],
        };
        for (d, direction) in self.directions.iter().enumerate() {
            for axis in 0..3 {
                let along = direction[axis];
                motion.position[d] += along * (pose.position[axis] - self.origin[axis]);
                motion.convective[d] += along * bend[axis];
                for (entry, column) in motion.rows[d].iter_mut().zip(&*jacobian) {
                    *entry += along * column[axis];
                }
            }
            for (&entry, &speed) in motion.rows[d].iter().zip(qd) {
                motion.velocity[d] += entry * speed;
            }
        }
        Ok(motion)
    }
}
