//! The model that a law uses: a description, perhaps with wrong parameters.

use rand::{RngExt as _, SeedableRng};
use rand_pcg::Pcg64;

use super::error::ControlError;
use rig_model::robot::{JointKind, Robot};
use rig_model::simulate::{Model, Motors, controllers};
use rig_shared::control::arm::{ArmModel, ArmMotors};
use rig_shared::multibody::{COLUMNS, Chain, Follower, JointKind as ChainKind, column};

/// The model that a law uses.
#[derive(Clone)]
pub struct LawModel {
    /// Geometry and gravity.
    pub chain: Chain<f64>,
    /// Parameters with payloads, one row a joint.
    pub parameters: Vec<[f64; COLUMNS]>,
    /// Coupled drives.
    pub motors: Option<Motors>,
    /// The description, for its effects.
    pub robot: Robot,
    /// Share of each joint's effects that the model has; 1 as described.
    pub effects: Vec<f64>,
    /// Described Coulomb and viscous friction of each joint, which its effects stand beside.
    pub friction: Vec<[f64; 2]>,
}

fn kind_name(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "revolute",
        JointKind::Prismatic => "prismatic",
    }
}

/// Returns what an axis follows: its kind, joint, ratio and offset.
fn gear(own: &Follower) -> (ChainKind, usize, f64, f64) {
    (own.geometry.kind, own.master, own.ratio, own.offset)
}

impl LawModel {
    /// Builds the model of a description.
    ///
    /// # Errors
    /// [`ControlError::Simulate`] if it is no valid chain.
    pub fn of(robot: &Robot) -> Result<Self, ControlError> {
        let Model {
            chain,
            parameters,
            motors,
            ..
        } = Model::from_robot(robot)?;
        Ok(Self {
            chain,
            friction: (parameters.iter().take(robot.joints.len()))
                .map(|row| [row[column::COULOMB], row[column::VISCOUS]])
                .collect(),
            parameters,
            motors,
            effects: vec![1.0; robot.joints.len()],
            robot: robot.clone(),
        })
    }

    /// Builds the model of another description of a robot, and a sentence about joints with other names. `what` names the
    /// description.
    ///
    /// # Errors
    /// [`ControlError::OtherRobot`], [`ControlError::OtherKind`] if it has other joints; [`ControlError::Model`] if a joint
    /// has no inertia.
    pub fn of_same(
        other: &Robot,
        robot: &Robot,
        what: &str,
    ) -> Result<(Self, Option<String>), ControlError> {
        if other.joints.len() != robot.joints.len() {
            return Err(ControlError::OtherRobot {
                what: what.to_owned(),
                expected: robot.joints.len(),
                found: other.joints.len(),
            });
        }
        if other
            .follower_axes()
            .iter()
            .map(gear)
            .ne(robot.follower_axes().iter().map(gear))
        {
            return Err(ControlError::OtherFollowers(what.to_owned()));
        }
        let pairs = || other.joints.iter().zip(&robot.joints);
        if let Some((k, (found, own))) = (pairs().enumerate()).find(|(_, (a, b))| a.kind != b.kind)
        {
            return Err(ControlError::OtherKind {
                what: what.to_owned(),
                place: k + 1,
                own: own.name.clone(),
                expected: kind_name(own.kind),
                name: found.name.clone(),
                found: kind_name(found.kind),
            });
        }
        let renamed: Vec<String> = (pairs().filter(|(a, b)| a.name != b.name))
            .map(|(a, b)| format!("{} for {}", a.name, b.name))
            .collect();
        let note = (!renamed.is_empty()).then(|| {
            format!(
                "Warning: joints of {what} have other names than those of the robot ({}); is it a description of the same robot?",
                renamed.join(", ")
            )
        });
        let refused = |reason| ControlError::Model {
            what: what.to_owned(),
            reason,
        };
        let model = Model::from_robot(other).map_err(refused)?;
        controllers(other, &model, &other.middle_position()).map_err(refused)?;
        Ok((Self::of(other)?, note))
    }

    /// Multiplies every link's ten inertial parameters by one factor, and each parameter of its drive and friction by
    /// one of its own. Bodies remain possible bodies. One factor serves the torque of all effects of a joint.
    fn multiply(&mut self, mut factor: impl FnMut() -> f64) {
        for row in &mut self.parameters {
            let body = factor();
            for (k, value) in row.iter_mut().enumerate() {
                *value *= if k < column::DRIVE_INERTIA {
                    body
                } else {
                    factor()
                };
            }
        }
        for value in (self.motors.iter_mut()).flat_map(|m| m.parameters.as_flattened_mut()) {
            *value *= factor();
        }
        for share in &mut self.effects {
            *share *= factor();
        }
    }

    /// Multiplies all parameters by one factor.
    pub fn scale(&mut self, by: f64) {
        self.multiply(|| by);
    }

    /// Multiplies the parameters by random factors, uniform within 1 ± `share`; the same seed gives the same model. One
    /// factor serves the ten inertial parameters of a link.
    pub fn disturb(&mut self, share: f64, seed: u64) {
        let mut random = Pcg64::seed_from_u64(seed);
        self.multiply(|| 1.0 + share * (2.0 * random.random::<f64>() - 1.0));
    }

    /// Returns the view that laws take.
    pub fn view(&self) -> ArmModel<'_, f64> {
        ArmModel {
            chain: &self.chain,
            parameters: &self.parameters,
            motors: self.motors.as_ref().map(|motors| ArmMotors {
                transmission: &motors.transmission,
                parameters: &motors.parameters,
            }),
        }
    }

    /// Returns all standard parameters: 14 a link, then 3 a motor with coupled drives.
    pub fn standard(&self) -> Vec<f64> {
        let motors = self.motors.iter().flat_map(|m| m.parameters.as_flattened());
        (self.parameters.as_flattened().iter().chain(motors))
            .copied()
            .collect()
    }
}
