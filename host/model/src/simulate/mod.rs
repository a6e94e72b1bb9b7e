//! The closed loop of a model and its controller.

mod acting;
mod elastic;
mod solve;
mod step;
#[cfg(test)]
mod tests;

use rig_shared::effects::Memory;
use rig_shared::multibody::{
    COLUMNS, Chain, ChainError, MultibodyError, inertia_matrix, inverse_dynamics,
};
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission, TransmissionError};
use thiserror::Error;

use crate::effects::Effects;
use crate::robot::{Controller, Robot};

pub use step::Stepper;

/// Bandwidth of the stand-in controller if the description has none, Hz.
pub const STAND_IN_BANDWIDTH: f64 = 5.0;

/// Share of the largest inertia below which an inertia is rounding.
const NO_INERTIA: f64 = 1e-12;

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
    /// A joint has no inertia to move.
    #[error(
        "joint \"{joint}\" has no inertia to move, so it cannot be simulated: neither its link nor what follows has any about its axis, nor has its drive. Give the link mass and inertia, or the drive a rotor_inertia; `rig identify` writes a description that can."
    )]
    NoInertia {
        /// The joint's name.
        joint: String,
    },
    /// The motion left the range of finite numbers.
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
    /// Friction of coupled drives that feeds energy in.
    #[error(
        "the viscous friction of the coupled drives (fvm with fv of the joints they move) would drive some motion: its least damping is {least} N·m·s/rad; give the motors or the joints more, or identify them anew."
    )]
    DrivingFriction {
        /// Least eigenvalue of the damping matrix.
        least: f64,
    },
    /// Friction that would drive a joint because of effects.
    #[error(
        "the friction of joint {joint} with the description's effects would drive it at {velocity} (rad/s or m/s): it lies between {low} and {high} N·m (N), which must hold 0; give the joint more Coulomb friction, or the effects less."
    )]
    DrivingEffects {
        /// From 1 at the base.
        joint: usize,
        /// rad/s or m/s
        velocity: f64,
        /// Friction for motion backwards.
        low: f64,
        /// Friction for motion forwards.
        high: f64,
    },
    /// Viscous friction that warming made negative.
    #[error(
        "after {time:.3} s of motion joint {joint} has warmed so far that its viscous friction is {left} N·m·s/rad (N·s/m), and would drive it: the description gives it {viscous} cold; give viscous_warmup a smaller drop, or [joint.friction] viscous more."
    )]
    WarmedAway {
        /// From 1 at the base.
        joint: usize,
        /// When, s.
        time: f64,
        /// Viscous friction cold, N·m·s/rad or N·s/m.
        viscous: f64,
        /// Viscous friction at that time, N·m·s/rad or N·s/m.
        left: f64,
    },
    /// Backlash or elasticity where it cannot be simulated.
    #[error(
        "{effect} is simulated for a robot of one joint with a drive of its own only; leave it out, or describe the joint alone."
    )]
    ElasticChain {
        /// The effect and its joint.
        effect: String,
    },
    /// Backlash or elasticity without a second mass.
    #[error(
        "{effect} needs a motor with inertia on the other side of the gear, and the description has none; give rotor_inertia in [joint.drive]."
    )]
    NoRotor {
        /// The effect and its joint.
        effect: String,
    },
    /// The drives are invalid.
    #[error(transparent)]
    Drives(#[from] TransmissionError),
    /// Wrong lengths, or an inertia matrix that is not positive definite.
    #[error(transparent)]
    Multibody(#[from] MultibodyError),
}

/// A robot as numbers: geometry, and one row of parameters a joint in the order of `COLUMN_NAMES`.
pub struct Model {
    /// Geometry and gravity.
    pub chain: Chain<f64>,
    /// Parameters, joint by joint.
    pub parameters: Vec<[f64; COLUMNS]>,
    /// Drives that move several joints or have a changing ratio; `None` if there is no such drive.
    pub motors: Option<Motors>,
    /// Effects beyond these; payloads are already in the parameters.
    pub effects: Effects,
}

/// Coupled drives and their parameters beyond the joints' own.
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
        let chain = Chain::new(&robot.geometry(), robot.gravity)?;
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

/// Returns the controllers of a robot, and the joints that got a stand-in because the description has no controller.
///
/// The stand-in is a cascade that places both poles of the joint's own inertia at [`STAND_IN_BANDWIDTH`], critically
/// damped. It does not compensate friction: dry friction can hold a light link still. Use a feed-forward
/// ([`Inputs::feed_forward`]) for that.
///
/// # Errors
/// [`SimulateError::NoInertia`] if a joint has no inertia to move.
pub fn controllers(
    robot: &Robot,
    model: &Model,
    q: &[f64],
) -> Result<(Vec<Controller>, Vec<String>), SimulateError> {
    let n = robot.joints.len();
    let mut mass = vec![0.0; n * n];
    model.inertia_matrix(q, &mut mass)?;
    if let Some(light) = massless(&mass, n) {
        return Err(SimulateError::NoInertia {
            joint: robot.joints[light].name.clone(),
        });
    }
    let mut stand_ins = Vec::new();
    let mut list = Vec::with_capacity(n);
    for (i, joint) in robot.joints.iter().enumerate() {
        if let Some(controller) = &joint.controller {
            list.push(controller.clone());
            continue;
        }
        let inertia = mass[i * n + i];
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

/// Returns the first joint, from the tip, with almost no inertia to move while the joints beyond it are free. Its pivot
/// of the inertia matrix (n × n, row-major) in the elimination from the tip (Featherstone 2008, sec. 7.3) is rounding.
fn massless(mass: &[f64], n: usize) -> Option<usize> {
    let largest = (0..n).map(|i| mass[i * n + i]).fold(0.0, f64::max);
    let mut left = mass.to_vec();
    for k in (0..n).rev() {
        let pivot = left[k * n + k];
        if pivot.is_nan() || pivot <= NO_INERTIA * mass[k * n + k].max(largest) {
            return Some(k);
        }
        for i in 0..k {
            let share = left[i * n + k] / pivot;
            for j in 0..k {
                left[i * n + j] -= share * left[k * n + j];
            }
        }
    }
    None
}

/// Inputs of a simulation, sample by sample.
pub struct Inputs<'a> {
    /// Sample period, s.
    pub period: f64,
    /// Reference positions: one slice a joint, one value a sample.
    pub reference: &'a [Vec<f64>],
    /// Torques that the controllers add to their output, within the torque limit, same shape; empty for none.
    pub feed_forward: &'a [Vec<f64>],
    /// Torques added after the controllers (disturbances), same shape; empty for none.
    pub added: &'a [Vec<f64>],
    /// Initial positions.
    pub q: &'a [f64],
    /// Initial velocities.
    pub v: &'a [f64],
    /// Steps within one sample.
    pub substeps: u32,
    /// True if the controllers run once a sample and hold their torque. Otherwise they run at every step, with a
    /// reference interpolated between samples, like a drive whose loop is faster than its recorder.
    pub held: bool,
}

impl Inputs<'_> {
    /// Returns reference and feed-forward of joint `i` at `beyond` samples after sample `k`; the last values hold.
    fn asked(&self, i: usize, k: usize, beyond: f64) -> [f64; 2] {
        [self.reference, self.feed_forward].map(|series| {
            let values = series.get(i).and_then(|list| list.get(k..));
            match values {
                Some([now, next, ..]) => now + beyond * (next - now),
                Some([now]) => *now,
                _ => 0.0,
            }
        })
    }
}

/// Returns the torque that a controller asks for, from the measured position and velocity.
fn wish(controller: &Controller, reference: f64, [q, v]: [f64; 2]) -> f64 {
    let speed = controller.position_gain * (reference - q);
    controller.torque_gain * controller.velocity_gain * (speed - v)
}

/// A simulated motion: per joint one value a sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Positions as the sensors read them; of the motor, if it is a separate mass.
    pub q: Vec<Vec<f64>>,
    /// Velocities, from the same sensors.
    pub qd: Vec<Vec<f64>>,
    /// Torques of the controllers (without `Inputs::added`), as the sensors read them. If they are not held, the mean
    /// of the torques before and after the sample.
    pub tau: Vec<Vec<f64>>,
    /// Per joint, number of samples in whose period the torque limit cut the controller's output.
    pub saturated: Vec<usize>,
}

/// History before a simulation begins; empty by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Since {
    /// Time for which the joints have been running, s.
    pub time: f64,
    /// Hidden state of each effect of the model; empty if there is none.
    pub memory: Vec<Memory<f64>>,
}

/// Simulates the closed loop over all samples of the reference. Calls `progress` with the number of finished samples.
///
/// # Errors
/// [`SimulateError`], with the joint at fault.
pub fn closed_loop(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    inputs: &Inputs<'_>,
    progress: impl FnMut(usize),
) -> Result<Motion, SimulateError> {
    closed_loop_since(
        robot,
        model,
        controllers,
        inputs,
        &Since::default(),
        progress,
    )
}

/// Same as [`closed_loop`], for joints that have been running.
///
/// # Errors
/// Same as [`closed_loop`].
pub fn closed_loop_since(
    robot: &Robot,
    model: &Model,
    controllers: &[Controller],
    inputs: &Inputs<'_>,
    since: &Since,
    mut progress: impl FnMut(usize),
) -> Result<Motion, SimulateError> {
    let n = robot.joints.len();
    let samples = inputs.reference.iter().map(Vec::len).min().unwrap_or(0);
    let mut stepper = Stepper::new(model)?;
    stepper.go_on(since);
    let mut motion = Motion {
        q: vec![Vec::with_capacity(samples); n],
        qd: vec![Vec::with_capacity(samples); n],
        tau: vec![Vec::with_capacity(samples); n],
        saturated: vec![0; n],
    };
    let (mut q, mut v) = (inputs.q.to_vec(), inputs.v.to_vec());
    let mut applied = vec![0.0; n];
    let mut torque = vec![0.0; n];
    let mut cut = vec![false; n];
    let mut errors = vec![[0.0; 2]; n];
    let substeps = inputs.substeps.max(1);
    let dt = inputs.period / f64::from(substeps);
    // Controller updates within one sample, and steps for each update.
    let (answers, steps) = match inputs.held {
        true => (1, substeps),
        false => (substeps, 1),
    };
    for k in 0..samples {
        for answer in 0..answers {
            model.effects.position_errors(&q, &v, &mut errors)?;
            for i in 0..n {
                let read = [q[i] + errors[i][0], v[i] + errors[i][1]];
                let [reference, known] = inputs.asked(i, k, f64::from(answer) / f64::from(answers));
                let wish = known + wish(&controllers[i], reference, read);
                let limits = robot.joints[i].limits.as_ref();
                let limit = limits.and_then(|l| l.torque).unwrap_or(f64::INFINITY);
                let before = std::mem::replace(&mut applied[i], wish.max(-limit).min(limit));
                cut[i] |= applied[i] != wish;
                if answer == 0 {
                    motion.q[i].push(read[0]);
                    motion.qd[i].push(read[1]);
                    motion.tau[i].push(match inputs.held || k == 0 {
                        true => applied[i],
                        false => 0.5 * (before + applied[i]),
                    });
                }
                let added = inputs.added.get(i).and_then(|a| a.get(k));
                torque[i] = applied[i] + added.copied().unwrap_or(0.0);
                if !(q[i].is_finite() && v[i].is_finite() && applied[i].is_finite()) {
                    return Err(SimulateError::Diverged {
                        joint: robot.joints[i].name.clone(),
                        time: k as f64 * inputs.period,
                    });
                }
            }
            for _ in 0..steps {
                stepper.step(&mut q, &mut v, &torque, dt)?;
            }
        }
        for (count, cut) in motion.saturated.iter_mut().zip(&mut cut) {
            *count += usize::from(std::mem::take(cut));
        }
        progress(k + 1);
    }
    for (i, torque) in motion.tau.iter_mut().enumerate() {
        model.effects.read_effort(i, torque, inputs.period);
    }
    Ok(motion)
}
