//! Position of the links behind held motors, where springs, weight and wrench are in balance.
//!
//! F(q) − F(motors) = twist(load), load = R(q)⁻ᵀ·(J(q)ᵀ·w − g(q)): the wrench w and the described weight g act on the links
//! where they stand. So the stiffness of the tool point is not that of the springs alone: weight and wrench change their
//! torques as the links yield (geometric stiffness).

use rig_shared::multibody::{COLUMNS, Chain, gravity_vector};

use super::wrench::torques;
use crate::drives::loaded;
use crate::error::ComplianceError;
use crate::sag::TWIST;
use crate::tool_point::ToolPoint;

/// Steps to the balance. Each one leaves the error of the one before times the twist, a small angle.
const STEPS: usize = 30;
/// Step that ends them, rad or m: the displacement of a reach of metres is then exact to picometres.
const EXACT: f64 = 1e-13;

/// The loads of an arm behind held motors.
pub(super) struct Equilibrium<'a, 'b> {
    tool: &'b ToolPoint<'a>,
    chain: Chain<f64>,
    parameters: Vec<[f64; COLUMNS]>,
}

impl<'a, 'b> Equilibrium<'a, 'b> {
    /// Takes the weight from the description.
    ///
    /// # Errors
    /// [`ComplianceError::Model`].
    pub(super) fn new(tool: &'b ToolPoint<'a>) -> Result<Self, ComplianceError> {
        let robot = tool.robot();
        let chain = robot
            .chain()
            .map_err(|error| ComplianceError::Model(error.to_string()))?;
        Ok(Self {
            tool,
            chain,
            parameters: loaded(robot)?,
        })
    }

    /// Returns the torques of the weight on the joints.
    ///
    /// # Errors
    /// [`ComplianceError::Model`].
    pub(super) fn weight(&self, q: &[f64]) -> Result<Vec<f64>, ComplianceError> {
        let mut torque = vec![0.0; self.tool.count()];
        gravity_vector(&self.chain, &self.parameters, q, &mut torque)
            .map_err(|error| ComplianceError::Model(error.to_string()))?;
        Ok(torque)
    }

    /// Returns the place of the tool point, m.
    ///
    /// # Errors
    /// [`ComplianceError::Option`].
    pub(super) fn place(&self, q: &[f64]) -> Result<[f64; 3], ComplianceError> {
        Ok(self.tool.jacobian(q)?.0)
    }

    /// Returns the positions of the links at rest behind motors at `motors` under a reading of the wrench. `twist`: twist of each
    /// drive by its load. `None` if they twist further than gears can, or if there is no rest.
    ///
    /// # Errors
    /// [`ComplianceError::Model`].
    pub(super) fn links(
        &self,
        motors: &[f64],
        reading: &[f64; 6],
        twist: impl Fn(usize, f64) -> f64,
    ) -> Result<Option<Vec<f64>>, ComplianceError> {
        let (n, drives) = (self.tool.count(), self.tool.drives());
        let held = drives.positions(motors)?;
        let mut q = motors.to_vec();
        for _ in 0..STEPS {
            let inverse = match drives.inverse(&q) {
                Err(ComplianceError::SingularDrives { .. }) => return Ok(None),
                other => other?,
            };
            let weight = self.weight(&q)?;
            let joint: Vec<f64> = (torques(self.tool, &q, reading)?.iter().zip(&weight))
                .map(|(pushed, weight)| pushed - weight)
                .collect();
            let at = drives.positions(&q)?;
            let missing: Vec<f64> = (0..n)
                .map(|k| {
                    let load = (0..n).map(|j| inverse[(j, k)] * joint[j]).sum();
                    twist(k, load) - (at[k] - held[k])
                })
                .collect();
            let mut most = 0.0f64;
            for (j, q) in q.iter_mut().enumerate() {
                let step: f64 = (0..n).map(|k| inverse[(j, k)] * missing[k]).sum();
                *q += step;
                most = most.max(step.abs());
            }
            let moved = |(q, motor): (&f64, &f64)| (q - motor).abs() <= TWIST;
            if !q.iter().zip(motors).all(moved) {
                return Ok(None);
            }
            if most < EXACT {
                break;
            }
        }
        Ok(Some(q))
    }
}
