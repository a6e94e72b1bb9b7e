//! Known values of a voltage-driven joint, and its nominal parameters.

use rig_shared::multibody::{COLUMNS, column, gravity_vector};

use crate::DiagnoseError;
use rig_model::robot::{JointKind, Robot};

/// Nominal parameters, in the order of [`NAMES`].
pub(crate) const NOMINAL: usize = 6;
/// Drive inertia seen at the joint; torque per volt; back-EMF; Coulomb and viscous friction; constant torque.
pub(crate) const NAMES: [(&str, &str); NOMINAL] = [
    ("Ia1", "kg*m^2"),
    ("torque per volt", "N*m/V"),
    ("back-EMF", "V*s/rad"),
    ("fc1", "N*m"),
    ("fv1", "N*m*s/rad"),
    ("off1", "N*m"),
];

/// Reasons why a robot or its recordings give no model under voltage.
#[derive(Clone, Copy, Debug, thiserror::Error)]
pub(crate) enum Unfit {
    /// A number of joints other than one.
    #[error(
        "without torque or current only a robot of one joint is diagnosed, and this one has {0}; record the current as well."
    )]
    Joints(usize),
    /// A link without inertia.
    #[error(
        "without torque or current the link's own inertia is the scale of everything else; state it in [joint.inertial]."
    )]
    NoInertia,
    /// A voltage that does not drive the joint.
    #[error(
        "the voltage does not move this joint as a motor's would; check the sign of the voltage, or record a livelier motion."
    )]
    NotDriven,
    /// Described effects that cannot be simulated.
    #[error(
        "with its effects the description cannot be simulated under these voltages; look at the values of its [[effect]] tables."
    )]
    NotSimulated,
}

impl From<Unfit> for DiagnoseError {
    fn from(unfit: Unfit) -> Self {
        Self::Model(unfit.to_string())
    }
}

/// Known values of the joint.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Plant {
    /// Inertia of the link, kg·m² or kg.
    pub inertia: f64,
    /// Torque against gravity: with cos q, with sin q, constant, N·m or N.
    pub gravity: [f64; 3],
    /// The same per kg·m of first moment along x, m/s².
    pub per_moment: [f64; 3],
    /// Motor turns per joint turn.
    pub ratio: f64,
    /// Number of halvings of the longest step.
    pub halvings: i32,
}

impl Plant {
    /// Returns the described values of the only joint.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`]: more than one joint, a link without inertia, a geometry that is no chain.
    pub(crate) fn of(robot: &Robot) -> Result<Self, DiagnoseError> {
        let [joint] = robot.joints.as_slice() else {
            return Err(Unfit::Joints(robot.joints.len()).into());
        };
        let wrong = |error: &dyn std::fmt::Display| DiagnoseError::Model(error.to_string());
        let chain = robot.chain().map_err(|e| wrong(&e))?;
        let mut row = [0.0; COLUMNS];
        if let Some(inertial) = &joint.inertial {
            row[column::MASS] = inertial.mass;
            row[column::FIRST_MOMENT..column::INERTIA].copy_from_slice(&inertial.first_moment);
            row[column::INERTIA..column::DRIVE_INERTIA].copy_from_slice(&inertial.inertia);
        }
        let inertia = match joint.kind {
            JointKind::Revolute => row[column::INERTIA + 5],
            JointKind::Prismatic => row[column::MASS],
        };
        if !(inertia > 0.0) {
            return Err(Unfit::NoInertia.into());
        }
        let weight = |row: [f64; COLUMNS]| -> Result<[f64; 3], DiagnoseError> {
            let mut at = [0.0; 3];
            let angles = [0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI];
            for (to, q) in at.iter_mut().zip(angles) {
                let mut torque = [0.0];
                gravity_vector(&chain, &[row], &[q], &mut torque).map_err(|e| wrong(&e))?;
                *to = torque[0];
            }
            let constant = 0.5 * (at[0] + at[2]);
            Ok([at[0] - constant, at[1] - constant, constant])
        };
        let mut unit = [0.0; COLUMNS];
        unit[column::FIRST_MOMENT] = 1.0;
        Ok(Self {
            inertia,
            gravity: weight(row)?,
            per_moment: weight(unit)?,
            ratio: joint.drive.as_ref().map_or(1.0, |drive| drive.gear_ratio),
            halvings: 0,
        })
    }

    /// Returns the nominal parameters of a description; `None` if any is missing.
    pub(crate) fn described(&self, robot: &Robot) -> Option<[f64; NOMINAL]> {
        let joint = robot.joints.first()?;
        let (drive, friction) = (joint.drive.as_ref()?, joint.friction.as_ref()?);
        let emf = drive.torque_constant * self.ratio.abs();
        let gain = emf / drive.resistance?;
        (gain.is_finite() && gain > 0.0).then_some([
            drive.joint_inertia + self.ratio * self.ratio * drive.rotor_inertia,
            gain,
            emf,
            friction.coulomb,
            friction.viscous,
            friction.offset,
        ])
    }

    /// Returns the torque against gravity, N·m or N.
    pub(crate) fn weight(&self, q: f64) -> f64 {
        let (sin, cos) = q.sin_cos();
        self.gravity[0] * cos + self.gravity[1] * sin + self.gravity[2]
    }

    /// Returns the same plant with half the step.
    pub(crate) fn finer(&self) -> Self {
        Self {
            halvings: self.halvings + 1,
            ..*self
        }
    }
}
