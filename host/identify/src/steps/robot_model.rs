//! The robot of a fit and its equations.

use rig_shared::multibody::Chain;
use rig_shared::transmission::Transmission;

use super::task::Task;
use crate::error::IdentifyError;
use crate::structure::base::Base;
use crate::structure::chain::{chain_of, transmission_of};
use crate::treatment::cutoff::Equations;
use crate::unmodelled::beyond::{Beyond, with_beyond};
use rig_model::effects::Effects;
use rig_model::robot::Robot;

/// A robot with its geometry, drives and base parameters.
pub(crate) struct RobotModel {
    /// The described robot with the effects that are known beyond the description.
    pub robot: Robot,
    /// Geometry.
    pub chain: Chain<f64>,
    /// Drives.
    pub transmission: Transmission<f64>,
    /// Base parameters.
    pub base: Base,
}

impl RobotModel {
    /// Builds the model of the described robot with the effects `known`.
    ///
    /// # Errors
    /// [`IdentifyError`]: an invalid geometry, impossible drives, ambiguous base parameters.
    pub(crate) fn of(task: &Task, known: &Beyond) -> Result<Self, IdentifyError> {
        let robot = with_beyond(task.described, &known.torques, known.tilt.as_ref());
        Ok(Self {
            chain: chain_of(&robot)?,
            transmission: transmission_of(&robot)?,
            base: Base::structural(&robot, task.options.model, task.options.seed)?,
            robot,
        })
    }

    /// Returns the number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.robot.joints.len()
    }

    /// Returns the equations of a trial of cut-offs; `complete` if the description has no effects beside them.
    pub(crate) fn equations(&self, complete: bool) -> Equations<'_> {
        Equations {
            chain: &self.chain,
            transmission: &self.transmission,
            columns: &self.base.columns,
            complete,
        }
    }

    /// Returns the robot's effects, which use the standard parameters of `task`.
    ///
    /// # Errors
    /// [`IdentifyError::Model`] if an effect is impossible.
    pub(crate) fn effects(&self, task: &Task) -> Result<Effects, IdentifyError> {
        Ok(Effects::of(&self.robot)
            .map_err(|e| IdentifyError::Model(e.to_string()))?
            .beside(task.beside))
    }
}
