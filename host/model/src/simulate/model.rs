//! A robot as numbers, with its drives and effects.

use rig_shared::multibody::{COLUMNS, Chain, inertia_matrix, inverse_dynamics};
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission};

use super::error::SimulateError;
use crate::effects::Effects;
use crate::robot::Robot;

/// A robot as numbers: geometry, and one row of parameters a link in the order of `COLUMN_NAMES`.
pub struct Model {
    /// Geometry and gravity.
    pub chain: Chain<f64>,
    /// Parameters, link by link: those of the joints, then those of followers.
    pub parameters: Vec<[f64; COLUMNS]>,
    /// Drives that move several joints or have a changing ratio; `None` if there is no such drive.
    pub motors: Option<Motors>,
    /// Effects beyond these; payloads are already in the parameters.
    pub effects: Effects,
}

/// Coupled drives and their parameters beyond the joints' own.
#[derive(Clone)]
pub struct Motors {
    /// Motor positions as functions of the joint positions.
    pub transmission: Transmission<f64>,
    /// Parameters, motor by motor, in the order of `MOTOR_COLUMN_NAMES`.
    pub parameters: Vec<[f64; MOTOR_COLUMNS]>,
}

impl Model {
    /// Builds the model of a description.
    ///
    /// # Errors
    /// [`SimulateError::Chain`] on geometry that does not form a chain.
    pub fn from_robot(robot: &Robot) -> Result<Self, SimulateError> {
        let chain = robot.chain()?;
        let motors = Motors::from_robot(robot)?;
        Self::assembled(robot, chain, robot.standard_parameters(), motors)
    }

    /// Builds a model from these parameters with the effects of `robot`. Its payloads are added.
    ///
    /// # Errors
    /// [`SimulateError::Drives`] on invalid drives.
    pub fn assembled(
        robot: &Robot,
        chain: Chain<f64>,
        mut parameters: Vec<[f64; COLUMNS]>,
        motors: Option<Motors>,
    ) -> Result<Self, SimulateError> {
        let effects = Effects::of(robot)?.beside(&parameters);
        effects.add_loads(&mut parameters);
        Ok(Self {
            chain,
            parameters,
            motors,
            effects,
        })
    }

    /// Returns the number of joints.
    pub fn joint_count(&self) -> usize {
        self.chain.joint_count()
    }

    /// Returns the rows of parameters of the joints, without those of followers.
    pub fn joint_rows(&self) -> &[[f64; COLUMNS]] {
        &self.parameters[..self.joint_count().min(self.parameters.len())]
    }

    /// Computes the inertia matrix at `q`, n × n row-major, with drives and motors.
    ///
    /// # Errors
    /// [`SimulateError::Multibody`], [`SimulateError::Drives`] on wrong lengths.
    pub fn inertia_matrix(&self, q: &[f64], out: &mut [f64]) -> Result<(), SimulateError> {
        inertia_matrix(&self.chain, &self.parameters, q, out)?;
        if let Some(motors) = &self.motors {
            motors
                .transmission
                .add_motor_inertia(&motors.parameters, q, out)?;
        }
        Ok(())
    }

    /// Computes the joint torques (length n) of a motion, with drives, motors and friction.
    /// # Errors
    /// Same as [`Self::inertia_matrix`].
    pub fn inverse_dynamics(
        &self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Result<(), SimulateError> {
        inverse_dynamics(&self.chain, &self.parameters, q, qd, qdd, tau)?;
        if let Some(motors) = &self.motors {
            let width = motors.parameters.len() * MOTOR_COLUMNS;
            let mut columns = vec![0.0; tau.len() * width];
            motors
                .transmission
                .motor_columns(q, qd, qdd, &mut columns)?;
            let values = motors.parameters.as_flattened();
            for (entry, row) in tau.iter_mut().zip(columns.chunks_exact(width)) {
                *entry += row.iter().zip(values).map(|(y, p)| y * p).sum::<f64>();
            }
        }
        Ok(())
    }
}

impl Motors {
    /// Returns the coupled drives of a description; `None` if every drive moves only its own joint at a constant ratio.
    ///
    /// # Errors
    /// [`SimulateError::Drives`] on invalid drives.
    pub fn from_robot(robot: &Robot) -> Result<Option<Self>, SimulateError> {
        let transmission = robot.transmission()?;
        Ok((!transmission.is_simple()).then(|| Self {
            transmission,
            parameters: robot.motor_parameters(),
        }))
    }
}
