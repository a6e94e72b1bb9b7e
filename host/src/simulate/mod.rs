//! The closed loop of a model and its controller.

mod step;
#[cfg(test)]
mod tests;

use rig_shared::multibody::{COLUMNS, Chain, ChainError, MultibodyError, inertia_matrix};
use thiserror::Error;

use crate::robot::{Controller, Robot};

pub use step::Stepper;

/// Bandwidth of the controller that stands in where the description has none, Hz.
pub const STAND_IN_BANDWIDTH: f64 = 5.0;

/// Why a motion could not be simulated.
#[derive(Debug, Error)]
pub enum SimulateError {
    /// Friction that feeds energy in.
    #[error(
        "{parameter} is {value}: friction below zero would drive the joint; give 0 or more, or identify it anew."
    )]
    NegativeFriction {
        /// Name with the joint's number.
        parameter: String,
        /// The value at fault.
        value: f64,
    },
    /// A link without inertia.
    #[error(
        "the inertia that joint {joint} has to move is not positive: give its link a mass and an inertia, or its drive a rotor inertia."
    )]
    NotPositiveDefinite {
        /// From 1 at the base.
        joint: usize,
    },
    /// A joint's inertial parameters are unknown.
    #[error(
        "joint \"{joint}\" has no [joint.inertial] and no drive inertia, so it cannot be simulated; `rig identify` writes a description that can."
    )]
    NoInertia {
        /// The joint's name.
        joint: String,
    },
    /// The motion left what numbers can hold.
    #[error(
        "the simulated motion of joint \"{joint}\" grew beyond all bounds after {time:.3} s: the controller's gains do not fit the model."
    )]
    Diverged {
        /// The joint's name.
        joint: String,
        /// When, s.
        time: f64,
    },
    /// The chain cannot be built.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// Lengths or inertia.
    #[error(transparent)]
    Multibody(#[from] MultibodyError),
}

/// A robot as numbers: geometry, and one row of parameters a joint in the order of `COLUMN_NAMES`.
pub struct Model {
    /// Geometry and gravity.
    pub chain: Chain<f64>,
    /// Parameters, joint by joint.
    pub parameters: Vec<[f64; COLUMNS]>,
}

impl Model {
    /// The model that a description states.
    ///
    /// # Errors
    /// [`SimulateError::Chain`] on geometry that is no chain.
    pub fn from_robot(robot: &Robot) -> Result<Self, SimulateError> {
        let chain = Chain::new(&robot.geometry(), robot.gravity)?;
        let parameters = robot.standard_parameters();
        Ok(Self { chain, parameters })
    }
}

/// The controllers of a robot; a stand-in where the description has none, and for which joints that was so.
///
/// The stand-in is the cascade that places both poles of the joint's own inertia at
/// [`STAND_IN_BANDWIDTH`], critically damped.
///
/// # Errors
/// [`SimulateError::NoInertia`] where there is nothing to design it for.
pub fn controllers(
    robot: &Robot,
    model: &Model,
    q: &[f64],
) -> Result<(Vec<Controller>, Vec<String>), SimulateError> {
    let n = robot.joints.len();
    let mut mass = vec![0.0; n * n];
    inertia_matrix(&model.chain, &model.parameters, q, &mut mass)?;
    let mut stand_ins = Vec::new();
    let mut list = Vec::with_capacity(n);
    for (i, joint) in robot.joints.iter().enumerate() {
        if let Some(controller) = &joint.controller {
            list.push(controller.clone());
            continue;
        }
        let inertia = mass[i * n + i];
        if inertia.is_nan() || inertia <= 0.0 {
            return Err(SimulateError::NoInertia {
                joint: joint.name.clone(),
            });
        }
        let omega = core::f64::consts::TAU * STAND_IN_BANDWIDTH;
        stand_ins.push(joint.name.clone());
        list.push(Controller {
            position_gain: 0.5 * omega,
            velocity_gain: 2.0 * omega,
            torque_gain: inertia,
        });
    }
    Ok((list, stand_ins))
}

/// What drives a simulation, sample by sample.
pub struct Inputs<'a> {
    /// Sample period, s. The controllers run at this rate, their torque held in between.
    pub period: f64,
    /// Reference positions: one slice a joint, one value a sample.
    pub reference: &'a [Vec<f64>],
    /// Torques added to the controllers' (disturbances), same shape; empty for none.
    pub added: &'a [Vec<f64>],
    /// Initial positions.
    pub q: &'a [f64],
    /// Initial velocities.
    pub v: &'a [f64],
    /// Steps within one sample.
    pub substeps: u32,
}

/// A simulated motion: per joint one value a sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Positions.
    pub q: Vec<Vec<f64>>,
    /// Velocities.
    pub qd: Vec<Vec<f64>>,
    /// Torques of the controllers (without `Inputs::added`).
    pub tau: Vec<Vec<f64>>,
    /// Samples at which a joint's torque limit cut the controller's wish.
    pub saturated: Vec<usize>,
}

/// Simulates the closed loop over all samples of the reference. `progress` is told how many are done.
///
/// # Errors
/// [`SimulateError`], with the joint at fault.
pub fn closed_loop(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    inputs: &Inputs<'_>,
    mut progress: impl FnMut(usize),
) -> Result<Motion, SimulateError> {
    let n = robot.joints.len();
    let samples = inputs.reference.iter().map(Vec::len).min().unwrap_or(0);
    let mut stepper = Stepper::new(model)?;
    let mut motion = Motion {
        q: vec![Vec::with_capacity(samples); n],
        qd: vec![Vec::with_capacity(samples); n],
        tau: vec![Vec::with_capacity(samples); n],
        saturated: vec![0; n],
    };
    let (mut q, mut v) = (inputs.q.to_vec(), inputs.v.to_vec());
    let mut torque = vec![0.0; n];
    let dt = inputs.period / f64::from(inputs.substeps.max(1));
    for k in 0..samples {
        for i in 0..n {
            let c = &controllers[i];
            let wish = c.torque_gain
                * c.velocity_gain
                * (c.position_gain * (inputs.reference[i][k] - q[i]) - v[i]);
            let limit = robot.joints[i]
                .limits
                .as_ref()
                .and_then(|l| l.torque)
                .unwrap_or(f64::INFINITY);
            let applied = wish.max(-limit).min(limit);
            motion.saturated[i] += usize::from(applied != wish);
            motion.q[i].push(q[i]);
            motion.qd[i].push(v[i]);
            motion.tau[i].push(applied);
            torque[i] = applied
                + inputs
                    .added
                    .get(i)
                    .and_then(|a| a.get(k))
                    .copied()
                    .unwrap_or(0.0);
            if !(q[i].is_finite() && v[i].is_finite() && applied.is_finite()) {
                return Err(SimulateError::Diverged {
                    joint: robot.joints[i].name.clone(),
                    time: k as f64 * inputs.period,
                });
            }
        }
        for _ in 0..inputs.substeps.max(1) {
            stepper.step(&mut q, &mut v, &torque, dt)?;
        }
        progress(k + 1);
    }
    Ok(motion)
}
