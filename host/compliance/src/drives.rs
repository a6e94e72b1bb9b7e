//! The coordinates in which the stiffness of the drives stands.
//!
//! One spring per drive, in series with its motor. Its twist is the motor's coordinate minus that of the links: s = R(q)·δq,
//! and the joints feel the torque Rᵀ·f of the springs. The rows of R come from the Jacobian of the drives, in the units
//! that [`rig_shared::transmission`] uses for the inertia of a motor:
//!
//! | drive | row of R | unit of the stiffness |
//! | --- | --- | --- |
//! | simple | unit vector of its joint | N·m/rad or N/m at the joint |
//! | coupled | ratios over its own ratio | N·m/rad at its own joint |
//! | varying (screw) | motor radians per joint radian, changes with the pose | N·m/rad at the motor |

use nalgebra::DMatrix;
use rig_model::effects::Effects;
use rig_model::robot::{JointKind, Robot};
use rig_numerics::svd::Svd;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{DriveKind, Transmission, motor_column};

use crate::error::ComplianceError;

/// Smallest reciprocal condition number of the Jacobian of the drives. By judgement: poses nearer to a dead centre of a
/// screw have no meaning.
const SINGULAR: f64 = 1e-9;

/// Returns the parameters of all links with the payloads of the description.
///
/// # Errors
/// [`ComplianceError::Model`].
pub(crate) fn loaded(robot: &Robot) -> Result<Vec<[f64; COLUMNS]>, ComplianceError> {
    let mut rows = robot.standard_parameters();
    let effects = Effects::of(robot).map_err(|error| ComplianceError::Model(error.to_string()))?;
    effects.add_loads(&mut rows);
    Ok(rows)
}

/// Returns true if the description states the inertia of all links that joint `k` carries.
pub(crate) fn are_links_described(robot: &Robot, k: usize) -> bool {
    let links = robot.links_outwards().into_iter();
    let mut carried = links.skip_while(|link| *link != k);
    carried.all(|link| robot.link_inertial(link).is_some())
}

/// The drives of a robot.
#[derive(Clone, Debug)]
pub(crate) struct Drives {
    transmission: Transmission<f64>,
    kinds: Vec<DriveKind>,
}

impl Drives {
    /// Builds the drives of a robot.
    ///
    /// # Errors
    /// [`ComplianceError::Model`].
    pub(crate) fn of(robot: &Robot) -> Result<Self, ComplianceError> {
        let transmission =
            (robot.transmission()).map_err(|error| ComplianceError::Model(error.to_string()))?;
        Ok(Self {
            kinds: robot.drive_kinds(),
            transmission,
        })
    }

    /// Kind of the drive of joint `k`.
    pub(crate) fn kind(&self, k: usize) -> DriveKind {
        self.kinds[k]
    }

    /// Unit of the stiffness of the drive of joint `k`, ASCII.
    pub(crate) fn unit(&self, robot: &Robot, k: usize) -> &'static str {
        match (self.kinds[k], robot.joints[k].kind) {
            (DriveKind::Varying, _) => "N*m/rad at the motor",
            (_, JointKind::Revolute) => "N*m/rad",
            (_, JointKind::Prismatic) => "N/m",
        }
    }

    /// Described inertia of the motor of joint `k` in the coordinate of its stiffness; 0 if unknown.
    pub(crate) fn inertia(&self, robot: &Robot, k: usize) -> f64 {
        match self.kinds[k] {
            DriveKind::Simple => robot.standard_parameters()[k][column::DRIVE_INERTIA],
            _ => robot.motor_parameters()[k][motor_column::INERTIA],
        }
    }

    /// Returns R at a pose: twist of each drive per motion of each joint.
    ///
    /// # Errors
    /// [`ComplianceError::Model`] for a wrong number of joints.
    pub(crate) fn rows(&self, q: &[f64]) -> Result<DMatrix<f64>, ComplianceError> {
        let n = self.kinds.len();
        let mut rows = vec![0.0; n * n];
        (self.transmission.jacobian(q, &mut rows))
            .map_err(|error| ComplianceError::Model(error.to_string()))?;
        Ok(DMatrix::from_fn(n, n, |k, j| {
            rows[k * n + j] / self.transmission.own_turns(k).unwrap_or(1.0)
        }))
    }

    /// Returns the coordinate of each motor where the joints are at a position, in the units of R.
    ///
    /// # Errors
    /// [`ComplianceError::Model`] for a wrong number of joints.
    pub(crate) fn positions(&self, q: &[f64]) -> Result<Vec<f64>, ComplianceError> {
        let mut motors = vec![0.0; self.kinds.len()];
        (self.transmission.motor_position(q, &mut motors))
            .map_err(|error| ComplianceError::Model(error.to_string()))?;
        for (k, motor) in motors.iter_mut().enumerate() {
            *motor /= self.transmission.own_turns(k).unwrap_or(1.0);
        }
        Ok(motors)
    }

    /// Returns the motion of each motor per motion of the joints, in the units of R. It vanishes at a dead centre.
    ///
    /// # Errors
    /// [`ComplianceError::Model`] for a wrong number of joints.
    pub(crate) fn speeds(&self, q: &[f64]) -> Result<Vec<f64>, ComplianceError> {
        Ok(self.rows(q)?.row_iter().map(|row| row.norm()).collect())
    }

    /// Returns R⁻¹ at a pose: motion of each joint per twist of each drive.
    ///
    /// # Errors
    /// [`ComplianceError::SingularDrives`], [`ComplianceError::Model`].
    pub(crate) fn inverse(&self, q: &[f64]) -> Result<DMatrix<f64>, ComplianceError> {
        let mut rows = self.rows(q)?;
        // Rows of unit length: a screw has hundreds of motor radians per joint radian.
        let lengths: Vec<f64> = rows.row_iter().map(|row| row.norm()).collect();
        let singular = || ComplianceError::SingularDrives {
            pose: listed_pose(q),
        };
        for (mut row, length) in rows.row_iter_mut().zip(&lengths) {
            if !(*length > 0.0 && length.is_finite()) {
                return Err(singular());
            }
            row /= *length;
        }
        let values = Svd::of(rows.clone()).singular_values;
        if !(values.min() > SINGULAR * values.max()) {
            return Err(singular());
        }
        let mut inverse = rows.try_inverse().ok_or_else(singular)?;
        for (mut column, length) in inverse.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        Ok(inverse)
    }
}

/// Returns a pose as text.
pub(crate) fn listed_pose(q: &[f64]) -> String {
    let list: Vec<String> = q.iter().map(|q| format!("{q:.4}")).collect();
    list.join(", ")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use rig_model::robot::ONE_LINK_TEMPLATE;
    use rig_shared::multibody::COLUMN_NAMES;

    #[test]
    fn a_described_payload_is_part_of_its_link() {
        let bare = Robot::from_toml(ONE_LINK_TEMPLATE, "rig.toml".as_ref()).unwrap();
        let effect =
            "\n[[effect]]\nkind = \"payload\"\njoint = \"link\"\nmass = 0.5\ndistance = 0.4\n";
        let text = format!("{ONE_LINK_TEMPLATE}{effect}");
        let carrying = Robot::from_toml(&text, "rig.toml".as_ref()).unwrap();
        let (before, after) = (loaded(&bare).unwrap()[0], loaded(&carrying).unwrap()[0]);
        for (name, added) in [("m", 0.5), ("mx", 0.2), ("Iyy", 0.08), ("Izz", 0.08)] {
            let k = COLUMN_NAMES.iter().position(|own| *own == name).unwrap();
            assert!((after[k] - before[k] - added).abs() < 1e-12, "{name}");
        }
    }
}
