//! Base parameters of a robot, and their columns along a motion.

use nalgebra::Vector3;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::DiagnoseError;
use rig_data::runs::Run;
use rig_identify::{Base, ModelKind, chain_of, transmission_of};
use rig_model::batch::{BLOCK, ChainBatch};
use rig_model::robot::{JointKind, Robot};

/// Sine of the angle below which two directions are parallel.
const PARALLEL: f64 = 1e-6;

/// Base parameters with their geometry.
pub(crate) struct Nominal {
    /// Base parameters.
    pub(crate) base: Base,
    robot: Robot,
    batch: ChainBatch,
    transmission: rig_shared::transmission::Transmission<f64>,
}

impl Nominal {
    /// Creates the base parameters of a robot.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(robot: &Robot) -> Result<Self, DiagnoseError> {
        let model = |e: rig_identify::IdentifyError| DiagnoseError::Model(e.to_string());
        Ok(Self {
            base: Base::structural(robot, ModelKind::Differential, 1).map_err(model)?,
            robot: robot.clone(),
            batch: ChainBatch::new(&chain_of(robot).map_err(model)?),
            transmission: transmission_of(robot).map_err(model)?,
        })
    }

    /// Returns the described values of the base parameters.
    pub(crate) fn stated(&self, robot: &Robot) -> Vec<f64> {
        let mut standard = robot.standard_parameters().concat();
        standard.extend(robot.motor_parameters().as_flattened());
        standard.resize(self.base.combination.ncols(), 0.0);
        (self.base.combination.row_iter())
            .map(|row| row.iter().zip(&standard).map(|(k, p)| k * p).sum())
            .collect()
    }

    /// Returns the axes of the base frame about which a tilt matters. If all joints turn about one direction that is
    /// not vertical, only that direction matters: about another one the change is of second order.
    pub(crate) fn tilt_axes(&self) -> Vec<[f64; 3]> {
        let g = Vector3::from(self.robot.gravity);
        if g.norm() == 0.0 {
            return Vec::new();
        }
        let (first, others) = match self.robot.joints.split_first() {
            Some(joints) => joints,
            None => return Vec::new(),
        };
        // z of frame 1 in the base frame: RotX(alpha) alone turns it.
        let (s, c) = first.alpha.sin_cos();
        let upright = Vector3::new(0.0, -s, c).cross(&g).norm() < PARALLEL * g.norm();
        let planar = (self.robot.joints.iter()).all(|j| j.kind == JointKind::Revolute)
            && others.iter().all(|j| j.alpha.sin().abs() < PARALLEL);
        if others.is_empty() || planar && !upright {
            return vec![[0.0, -s, c]];
        }
        let one = if g.normalize().x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let first = g.cross(&one).normalize();
        let second = g.cross(&first).normalize();
        vec![first.into(), second.into()]
    }

    /// Returns gravity across the first joint's axis, m/s²: the largest torque per kg·m of first moment.
    pub(crate) fn pull(&self) -> f64 {
        let alpha = self.robot.joints.first().map_or(0.0, |joint| joint.alpha);
        let axis = Vector3::new(0.0, -alpha.sin(), alpha.cos());
        axis.cross(&Vector3::from(self.robot.gravity)).norm()
    }

    /// Returns true if a base parameter is Coulomb friction.
    pub(crate) fn is_coulomb(&self, k: usize) -> bool {
        self.place(k).is_ok_and(|c| c == column::COULOMB)
            || self.place(k).is_err_and(|c| c == motor_column::COULOMB)
    }

    /// Returns true if a base parameter belongs to the drive: friction, offset or its own inertia.
    pub(crate) fn is_drive(&self, k: usize) -> bool {
        self.place(k).map_or(true, |c| c >= column::DRIVE_INERTIA)
    }

    /// Returns true if the drive inertia of a joint is a base parameter of its own.
    pub(crate) fn has_own_drive_inertia(&self, joint: usize) -> bool {
        self.base
            .columns
            .contains(&(joint * COLUMNS + column::DRIVE_INERTIA))
    }

    /// Returns the index of a base parameter's column in its joint, or (as the error) in its motor.
    fn place(&self, k: usize) -> Result<usize, usize> {
        let c = self.base.columns[k];
        match c.checked_sub(self.joints() * COLUMNS) {
            None => Ok(c % COLUMNS),
            Some(motor) => Err(motor % MOTOR_COLUMNS),
        }
    }

    /// Returns the number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.batch.joint_count()
    }

    /// Visits the regressor of a motion at the full rate: `visit(base parameter, joint, values)` for each column that
    /// is not structurally zero.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if lengths differ.
    pub(crate) fn columns(
        &self,
        motion: [&[Vec<f64>]; 3],
        visit: &mut dyn FnMut(usize, usize, &[f64]),
    ) -> Result<(), DiagnoseError> {
        let failed = |e: &dyn std::fmt::Display| DiagnoseError::Model(e.to_string());
        let n = self.joints();
        let samples = motion[0].first().map_or(0, Vec::len);
        let standard = n * COLUMNS;
        let wanted: Vec<(usize, usize, usize)> = (self.base.columns.iter().enumerate())
            .filter(|(_, c)| **c < standard)
            .flat_map(|(k, &c)| (0..n).map(move |j| (k, j, c)))
            .filter(|&(_, j, c)| !self.batch.is_zero(j, c))
            .collect();
        let mut values = vec![Vec::with_capacity(samples); wanted.len()];
        let mut block = self.batch.block(BLOCK);
        self.batch
            .each_differential_block(motion[0], motion[1], motion[2], &mut block, |part| {
                for (to, &(_, j, c)) in values.iter_mut().zip(&wanted) {
                    to.extend_from_slice(part.column(j, c));
                }
                Ok::<(), rig_model::batch::BatchError>(())
            })
            .map_err(|e| failed(&e))?;
        for (values, &(k, j, _)) in values.iter().zip(&wanted) {
            visit(k, j, values);
        }
        self.motor_columns(motion, visit)
    }

    /// Returns the torque of a joint for a motion with these base parameters, without friction and offset.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn inertial(
        &self,
        values: &[f64],
        joint: usize,
        motion: [&[Vec<f64>]; 3],
    ) -> Result<Vec<f64>, DiagnoseError> {
        let mut torque = vec![0.0; motion[0].first().map_or(0, Vec::len)];
        self.columns(motion, &mut |k, j, column| {
            if j == joint && !self.is_drive(k) {
                for (to, y) in torque.iter_mut().zip(column) {
                    *to += values[k] * y;
                }
            }
        })?;
        Ok(torque)
    }

    /// Returns, joint by joint, the samples where a motor with friction on this joint is slow, even if the joint is
    /// fast. Empty if each drive moves only its own joint. As in an identification, the threshold of a motor is the
    /// root sum of squares of its joints' thresholds.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn slow_motors(
        &self,
        run: &Run,
        thresholds: &[f64],
    ) -> Result<Vec<Vec<bool>>, DiagnoseError> {
        if self.transmission.is_simple() {
            return Ok(Vec::new());
        }
        let n = self.joints();
        let mut slow = vec![vec![false; run.len()]; n];
        let (mut q, mut directions) = (vec![0.0; n], vec![0.0; n * n]);
        for row in 0..run.len() {
            for (q, joint) in q.iter_mut().zip(&run.joints) {
                *q = joint.q[row];
            }
            self.transmission
                .motor_directions(&q, &mut directions)
                .map_err(|e| DiagnoseError::Model(e.to_string()))?;
            for direction in directions.chunks_exact(n) {
                let speed: f64 = (direction.iter().zip(&run.joints))
                    .map(|(along, joint)| along * joint.qd[row])
                    .sum();
                let least: f64 = (direction.iter().zip(thresholds))
                    .map(|(along, threshold)| (along * threshold).powi(2))
                    .sum();
                if speed.abs() < least.sqrt() {
                    let moved =
                        (slow.iter_mut().zip(direction)).filter(|(_, along)| **along != 0.0);
                    moved.for_each(|(slow, _)| slow[row] = true);
                }
            }
        }
        Ok(slow)
    }

    fn motor_columns(
        &self,
        motion: [&[Vec<f64>]; 3],
        visit: &mut dyn FnMut(usize, usize, &[f64]),
    ) -> Result<(), DiagnoseError> {
        let n = self.joints();
        let motors: Vec<(usize, usize)> = (self.base.columns.iter().enumerate())
            .filter_map(|(k, &c)| Some((k, c.checked_sub(n * COLUMNS)?)))
            .collect();
        if motors.is_empty() {
            return Ok(());
        }
        let samples = motion[0].first().map_or(0, Vec::len);
        let width = n * MOTOR_COLUMNS;
        let mut columns = vec![0.0; n * width];
        let mut values = vec![vec![0.0; samples]; motors.len() * n];
        let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for row in 0..samples {
            for (now, lists) in state.iter_mut().zip(motion) {
                for (to, list) in now.iter_mut().zip(lists) {
                    *to = list[row];
                }
            }
            self.transmission
                .motor_columns(&state[0], &state[1], &state[2], &mut columns)
                .map_err(|e| DiagnoseError::Model(e.to_string()))?;
            for (m, &(_, c)) in motors.iter().enumerate() {
                for j in 0..n {
                    values[m * n + j][row] = columns[j * width + c];
                }
            }
        }
        for (m, &(k, _)) in motors.iter().enumerate() {
            for j in 0..n {
                visit(k, j, &values[m * n + j]);
            }
        }
        Ok(())
    }
}
