//! The rows of a wrist sensor as joint torques of a longer chain.
//!
//! Three sliding and three turning joints that never move lead from the last joint's frame to the sensor's origin. The
//! body behind them is the load. Its wrench about the sensor's origin, axis by axis, is what these joints hold. So the
//! regressor's gradient is that of any chain ([`regressor_gradient`]).
//!
//! The axes are parallel to those of the last joint, not to the sensor's. With one noise of all forces and one of all
//! moments both give the same information.

use core::f64::consts::FRAC_PI_2;

use rig_shared::lanes::Lanes;
use rig_shared::multibody::{
    COLUMNS, Chain, ChainError, INERTIAL_PARAMETERS, JointGeometry, JointKind, regressor_gradient,
    wrench_regressor,
};
use rig_shared::scalar::Real;

use crate::ExciteError;
use crate::lanes::{L, LANES};
use rig_model::robot::{Robot, WristSensor};

/// Readings of the sensor at an instant: three forces, three moments.
pub(super) const AXES: usize = 6;
/// For force along x, y, z and moment about x, y, z the added joint that holds it, from 0.
const HELD_BY: [usize; AXES] = [2, 1, 0, 3, 4, 5];

/// The chain from the base to the sensor.
pub(super) struct WristChain {
    /// Number of joints that move.
    joints: usize,
    lanes: Chain<Lanes<LANES>>,
    plain: Chain<f64>,
}

impl WristChain {
    /// Adds the six joints to those of a robot.
    ///
    /// # Errors
    /// [`ChainError::TooManyJoints`] if the robot has more than ten axes.
    pub(super) fn of(robot: &Robot, sensor: &WristSensor) -> Result<Self, ChainError> {
        let at = (robot.flange_pose() * sensor.pose()).translation;
        let joint = |kind, alpha, theta, d| JointGeometry {
            kind,
            alpha,
            a: 0.0,
            theta,
            d,
        };
        let mut joints = robot.geometry();
        joints.extend([
            // Along z, y and x of the last joint, then about x, y and z; the last frame has its axes again.
            joint(JointKind::Prismatic, 0.0, 0.0, at.z),
            joint(JointKind::Prismatic, -FRAC_PI_2, FRAC_PI_2, at.y),
            joint(JointKind::Prismatic, FRAC_PI_2, 0.0, at.x),
            joint(JointKind::Revolute, 0.0, 0.0, 0.0),
            joint(JointKind::Revolute, -FRAC_PI_2, -FRAC_PI_2, 0.0),
            joint(JointKind::Revolute, FRAC_PI_2, 0.0, 0.0),
        ]);
        Ok(Self {
            joints: robot.joints.len(),
            lanes: Chain::with_followers(&joints, &robot.follower_axes(), robot.gravity)?,
            plain: Chain::with_followers(&joints, &robot.follower_axes(), robot.gravity)?,
        })
    }

    /// Computes the regressor of the wrench at one instant, 6 × 10, row-major.
    pub(super) fn rows(
        &self,
        state: [&[f64]; 3],
    ) -> Result<[f64; AXES * INERTIAL_PARAMETERS], ExciteError> {
        wrench_rows(&self.plain, state)
    }

    /// The same for instants side by side.
    pub(super) fn lane_rows(
        &self,
        state: [&[L]; 3],
    ) -> Result<[L; AXES * INERTIAL_PARAMETERS], ExciteError> {
        wrench_rows(&self.lanes, state)
    }

    /// Returns the gradient of the weighted sum of these rows by position, velocity and acceleration of the joints that
    /// move.
    pub(super) fn gradient(
        &self,
        state: [&[L]; 3],
        weights: &[L; AXES * INERTIAL_PARAMETERS],
    ) -> Result<[Vec<L>; 3], ExciteError> {
        let count = self.joints + AXES;
        let width = self.plain.parameter_count();
        let mut entries = vec![L::ZERO; count * width];
        for (own, held_by) in weights.chunks_exact(INERTIAL_PARAMETERS).zip(HELD_BY) {
            let start = (self.joints + held_by) * width + (count - 1) * COLUMNS;
            entries[start..start + INERTIAL_PARAMETERS].copy_from_slice(own);
        }
        let [q, qd, qdd] = state.map(with_added_joints);
        let [mut by_q, mut by_qd, mut by_qdd] = [(); 3].map(|()| vec![L::ZERO; count]);
        regressor_gradient(
            &self.lanes,
            &q,
            &qd,
            &qdd,
            &entries,
            &mut by_q,
            &mut by_qd,
            &mut by_qdd,
        )?;
        Ok([by_q, by_qd, by_qdd].map(|mut by| {
            by.truncate(self.joints);
            by
        }))
    }
}

/// Appends the added joints, at rest.
fn with_added_joints<T: Real>(values: &[T]) -> Vec<T> {
    let rest = std::iter::repeat_n(T::ZERO, AXES);
    values.iter().copied().chain(rest).collect()
}

fn wrench_rows<T: Real>(
    chain: &Chain<T>,
    state: [&[T]; 3],
) -> Result<[T; AXES * INERTIAL_PARAMETERS], ExciteError> {
    let [q, qd, qdd] = state.map(with_added_joints);
    let mut out = [T::ZERO; AXES * INERTIAL_PARAMETERS];
    wrench_regressor(chain, &q, &qd, &qdd, &mut out)?;
    Ok(out)
}
