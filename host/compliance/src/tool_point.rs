//! The compliance matrix of the tool point.
//!
//! A wrench w at the tool point loads the springs of the drives with f = R⁻ᵀ·Jᵀ·w. They twist by f/c, and the tool point
//! moves by J·R⁻¹·f/c, so that
//!
//! K_p = J·R⁻¹·diag(1/c)·R⁻ᵀ·Jᵀ
//!
//! with the Jacobian J of the tool frame in the base axes, and the map R of the [`drives`](crate::drives) (Salisbury 1980;
//! Kozłowski 1998, the compliance matrix K_p). Rows and columns: displacement dx dy dz (m) and rotation rx ry rz (rad) for
//! force (N) and moment (N·m), all in the base axes about the tool point. K_p is symmetric and positive semidefinite; its
//! rank is at most the number of elastic drives.
//!
//! Leaves out: elasticity of links, bearings, base and tool; the geometric stiffness of a preloaded robot, −∂Jᵀ/∂q·w of
//! gravity and of the wrench itself; the stiffness of the position loop of the motors, which count as held.

use nalgebra::{DMatrix, Isometry3, Matrix3, SMatrix, SymmetricEigen, Vector3};
use rig_model::robot::Robot;
use rig_shared::multibody::{Chain, Pose, frame_pose};
use serde::Serialize;

use crate::drives::{Drives, listed_pose};
use crate::error::ComplianceError;
use crate::stiffness::DriveStiffness;
use crate::value::Value;

/// A 6 × 6 matrix.
pub(crate) type Six = SMatrix<f64, 6, 6>;
/// Reciprocal condition number below which K_p counts as singular, with lengths over the reach of the tool point. By
/// judgement: a pose so near to a singular one that one direction is a million times stiffer than another.
const SINGULAR: f64 = 1e-9;

/// A principal direction of the translational compliance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrincipalCompliance {
    /// Displacement along the direction per force along it, m/N.
    pub compliance: Value,
    /// Unit vector in the base axes.
    pub direction: [f64; 3],
    /// Share of each drive in the compliance, base joint first; the sum is 1.
    pub shares: Vec<f64>,
}

/// The compliance of the tool point at one pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ToolCompliance {
    /// Joint positions, rad or m.
    pub pose: Vec<f64>,
    /// Tool point in the base frame, m.
    pub position: [f64; 3],
    /// K_p, rows dx dy dz rx ry rz, columns fx fy fz mx my mz, base axes.
    pub compliance: [[f64; 6]; 6],
    /// Standard deviation of each entry of K_p.
    pub compliance_std: [[f64; 6]; 6],
    /// K_p⁻¹; `None` if K_p is singular.
    pub stiffness: Option<[[f64; 6]; 6]>,
    /// Standard deviation of each entry of K_p⁻¹.
    pub stiffness_std: Option<[[f64; 6]; 6]>,
    /// Rank of K_p.
    pub rank: usize,
    /// Inverse of the translational block of K_p, N/m: force per displacement where the tool is free to turn. `None` if
    /// the block is singular.
    pub translational_stiffness: Option<[[f64; 3]; 3]>,
    /// Principal directions of the translational block, most compliant first.
    pub principal: Vec<PrincipalCompliance>,
}

/// The robot with its tool point.
#[derive(Clone, Debug)]
pub struct ToolPoint<'a> {
    robot: &'a Robot,
    chain: Chain<f64>,
    drives: Drives,
    fixed: Pose<f64>,
    offset: [f64; 3],
    /// Frame in which wrenches are read, and the sign that makes them the wrench on the robot; `None` for the tool point and
    /// the base axes.
    sensor: Option<(Pose<f64>, f64)>,
}

impl<'a> ToolPoint<'a> {
    /// Creates the tool point: `offset` (m) in the flange frame.
    ///
    /// # Errors
    /// [`ComplianceError::Model`].
    pub fn new(robot: &'a Robot, offset: [f64; 3]) -> Result<Self, ComplianceError> {
        let chain = robot
            .chain()
            .map_err(|error| ComplianceError::Model(error.to_string()))?;
        let flange = &robot.flange_pose();
        let place = flange * nalgebra::Translation3::from(Vector3::from(offset));
        Ok(Self {
            robot,
            chain,
            drives: Drives::of(robot)?,
            fixed: frame(&place),
            offset,
            sensor: None,
        })
    }

    /// Takes wrenches as readings of the wrist sensor of the description: about its origin and in its axes.
    ///
    /// # Errors
    /// [`ComplianceError::Option`]: no sensor is described, or not which wrench it reads, or it is metres away.
    pub(crate) fn with_sensor(mut self) -> Result<Self, ComplianceError> {
        let sensor = self.robot.wrist_sensor.as_ref();
        let reads = sensor.and_then(|sensor| sensor.reads);
        let (Some(sensor), Some(reads)) = (sensor, reads) else {
            return Err(ComplianceError::Option(format!(
                "The wrench is to be that of the wrist sensor, but {} has no [wrist_sensor] with `reads` (\"load\" or \"robot\"); describe it, or record the wrench at the tool point in the base axes (--wrench base).",
                self.robot.name
            )));
        };
        if let Some(text) = sensor.too_far() {
            return Err(ComplianceError::Option(text));
        }
        // The sensor reads the robot's wrench on the load, or its opposite, which acts on the robot.
        let pose = self.robot.flange_pose() * sensor.pose();
        self.sensor = Some((frame(&pose), -reads.sign()));
        Ok(self)
    }

    /// Returns true if wrenches are readings of the wrist sensor.
    pub(crate) fn is_sensed(&self) -> bool {
        self.sensor.is_some()
    }

    /// Takes wrenches on the robot at the tool point, in the axes of the base.
    pub(crate) fn in_base_axes(mut self) -> Self {
        self.sensor = None;
        self
    }

    /// Takes wrenches on the robot at the tool point, in the axes of the flange after a turn about its z axis, rad.
    pub(crate) fn in_flange_axes(mut self, angle: f64) -> Self {
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let place =
            self.robot.flange_pose() * nalgebra::Translation3::from(Vector3::from(self.offset));
        self.sensor = Some((frame(&(place * turn)), 1.0));
        self
    }

    /// Returns the rotation from the axes of a wrench's readings to the base, the sign that makes them the wrench on the robot,
    /// and the Jacobian of the point that they are about.
    pub(crate) fn wrench_frame(
        &self,
        q: &[f64],
    ) -> Result<(Matrix3<f64>, f64, DMatrix<f64>), ComplianceError> {
        match &self.sensor {
            None => Ok((Matrix3::identity(), 1.0, self.jacobian(q)?.1)),
            Some((fixed, sign)) => {
                let (pose, jacobian) = self.frame_at(q, fixed)?;
                let rotation = Matrix3::from_fn(|r, c| pose.rotation[r][c]);
                Ok((rotation, *sign, jacobian))
            }
        }
    }

    /// Number of joints.
    pub(crate) fn count(&self) -> usize {
        self.robot.joints.len()
    }

    /// The tool point in the flange frame, m.
    pub(crate) fn offset(&self) -> [f64; 3] {
        self.offset
    }

    /// The robot.
    pub(crate) fn robot(&self) -> &'a Robot {
        self.robot
    }

    /// The drives.
    pub(crate) fn drives(&self) -> &Drives {
        &self.drives
    }

    /// Returns the position of the tool point and its Jacobian J, 6 × n.
    pub(crate) fn jacobian(&self, q: &[f64]) -> Result<([f64; 3], DMatrix<f64>), ComplianceError> {
        let (pose, jacobian) = self.frame_at(q, &self.fixed)?;
        Ok((pose.position, jacobian))
    }

    /// Returns the pose of a frame of the last link and its Jacobian.
    fn frame_at(
        &self,
        q: &[f64],
        fixed: &Pose<f64>,
    ) -> Result<(Pose<f64>, DMatrix<f64>), ComplianceError> {
        let n = self.count();
        if q.len() != n || !q.iter().all(|q| q.is_finite()) {
            return Err(ComplianceError::Option(format!(
                "The pose {} has {} numbers, but {} has {n} joints; give one finite position for each joint, base first.",
                listed_pose(q),
                q.len(),
                self.robot.name
            )));
        }
        let mut columns = vec![[0.0; 6]; n];
        let pose = frame_pose(&self.chain, q, self.chain.last_link(), fixed, &mut columns)
            .map_err(|error| ComplianceError::Model(error.to_string()))?;
        Ok((pose, DMatrix::from_fn(6, n, |r, j| columns[j][r])))
    }

    /// Returns J·R⁻¹, 6 × n: motion of the tool point per twist of each drive, and the tool point's position.
    pub(crate) fn per_twist(&self, q: &[f64]) -> Result<([f64; 3], DMatrix<f64>), ComplianceError> {
        let (position, jacobian) = self.jacobian(q)?;
        Ok((position, jacobian * self.drives.inverse(q)?))
    }

    /// Computes the compliance at a pose. Uncertainty of the stiffness is propagated to first order; the drives'
    /// estimates count as independent.
    ///
    /// # Errors
    /// [`ComplianceError`]: an impossible pose.
    pub fn compliance(
        &self,
        q: &[f64],
        stiffness: &[DriveStiffness],
    ) -> Result<ToolCompliance, ComplianceError> {
        let (position, per_twist) = self.per_twist(q)?;
        let terms: Vec<(Six, Value)> = (per_twist.column_iter().zip(stiffness))
            .map(|(column, entry)| {
                let column = column.fixed_rows::<6>(0).into_owned();
                (column * column.transpose(), entry.compliance())
            })
            .collect();
        let sum: Six = terms.iter().map(|(term, own)| term * own.value).sum();
        let rank = rank(&sum, &per_twist);
        let inverse = (rank == 6).then(|| sum.try_inverse()).flatten();
        let deviation = |of: &dyn Fn(&Six) -> Six| {
            let squares: Six = (terms.iter())
                .map(|(term, own)| of(term).map(|v| (v * own.std).powi(2)))
                .sum();
            array(&squares.map(f64::sqrt))
        };
        let translation: Matrix3<f64> = sum.fixed_view::<3, 3>(0, 0).into_owned();
        Ok(ToolCompliance {
            pose: q.to_vec(),
            position,
            compliance: array(&sum),
            compliance_std: deviation(&|term| *term),
            stiffness: inverse.as_ref().map(array),
            stiffness_std: inverse.map(|inverse| deviation(&|term| inverse * term * inverse)),
            rank,
            translational_stiffness: regular(&translation)
                .then(|| translation.try_inverse())
                .flatten()
                .map(|m| std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]))),
            principal: principal(&translation, &terms),
        })
    }

    /// Returns the largest displacement per force over all directions, m/N, at a pose.
    pub(crate) fn largest(
        &self,
        q: &[f64],
        stiffness: &[DriveStiffness],
    ) -> Result<f64, ComplianceError> {
        let (_, per_twist) = self.per_twist(q)?;
        let mut sum = Matrix3::zeros();
        for (column, entry) in per_twist.column_iter().zip(stiffness) {
            let column = column.fixed_rows::<3>(0).into_owned();
            sum += column * column.transpose() * entry.compliance().value;
        }
        Ok(SymmetricEigen::new(sum).eigenvalues.max())
    }
}

/// Converts a pose.
fn frame(pose: &Isometry3<f64>) -> Pose<f64> {
    let turn = pose.rotation.to_rotation_matrix();
    Pose {
        position: pose.translation.vector.into(),
        rotation: std::array::from_fn(|r| std::array::from_fn(|c| turn[(r, c)])),
    }
}

fn array(matrix: &Six) -> [[f64; 6]; 6] {
    std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)]))
}

fn regular(matrix: &Matrix3<f64>) -> bool {
    let values = matrix.symmetric_eigenvalues();
    values.min() > SINGULAR * values.max()
}

/// Returns the rank of K_p with lengths over the largest arm of the drives, so that metres and radians compare.
fn rank(sum: &Six, per_twist: &DMatrix<f64>) -> usize {
    let (linear, angular) = (per_twist.rows(0, 3).norm(), per_twist.rows(3, 3).norm());
    let arm = if linear > 0.0 && angular > 0.0 {
        linear / angular
    } else {
        1.0
    };
    let scale = Six::from_diagonal(&nalgebra::Vector6::from_fn(|r, _| {
        if r < 3 { 1.0 / arm } else { 1.0 }
    }));
    let values = (scale * sum * scale).symmetric_eigenvalues();
    let most = values.max();
    values
        .iter()
        .filter(|v| most > 0.0 && **v > SINGULAR * most)
        .count()
}

/// Returns the principal directions of the translational compliance, most compliant first.
fn principal(translation: &Matrix3<f64>, terms: &[(Six, Value)]) -> Vec<PrincipalCompliance> {
    let eigen = SymmetricEigen::new(*translation);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let of = |k: usize| {
        let axis: Vector3<f64> = eigen.eigenvectors.column(k).into_owned();
        // The largest component is positive: the same robot gives the same axes.
        let axis = if axis[axis.iamax()] < 0.0 {
            -axis
        } else {
            axis
        };
        let parts: Vec<(f64, f64)> = (terms.iter())
            .map(|(term, own)| {
                let block = term.fixed_view::<3, 3>(0, 0);
                let size = axis.dot(&(block * axis));
                (size * own.value, size * own.std)
            })
            .collect();
        let value: f64 = parts.iter().map(|(v, _)| v).sum();
        let std = parts.iter().map(|(_, s)| s * s).sum::<f64>().sqrt();
        let share = |v: f64| if value > 0.0 { v / value } else { 0.0 };
        PrincipalCompliance {
            compliance: Value::new(value, std),
            direction: axis.into(),
            shares: parts.iter().map(|(v, _)| share(*v)).collect(),
        }
    };
    order.map(of).into()
}
