//! What is wrong with one joint of an arm, and the torque that it costs.

use rig_shared::multibody::{COLUMNS, Chain, bias_torque, column, inertia_matrix};

use rig_model::robot::Robot;
use rig_model::simulate::{Model, SimulateError};

/// Speed over which dry friction of a fault turns, rad/s.
const TURN: f64 = 5e-3;

/// What is wrong with one joint. Torques are those that the drive has to give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Friction that falls with the speed: torque, N·m, and speed at which half of it is left, rad/s.
    Stribeck([f64; 2]),
    /// More friction forwards than backwards, N·m.
    AsymmetricCoulomb(f64),
    /// A wave once a motor turn, with a second harmonic of a tenth: amplitude, N·m, and phase, rad.
    GearEccentricity([f64; 2]),
    /// Friction per torque that the gear transmits.
    LoadFriction(f64),
    /// Torque per acceleration of the joint before, kg·m².
    InertiaCoupling(f64),
    /// Torque per velocity of the joint before, N·m·s/rad: friction that it shares, and no inertia.
    ViscousCoupling(f64),
    /// The base turned about x and y, rad.
    GravityTilt([f64; 2]),
    /// A point mass, kg, at a place in the link's frame, m.
    Payload([f64; 4]),
    /// The reading is this much more than the position, rad.
    JointOffset(f64),
}

impl Fault {
    /// Name in results: the library's where it has one.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Stribeck(_) => "stribeck",
            Self::AsymmetricCoulomb(_) => "asymmetric_coulomb",
            Self::GearEccentricity(_) => "gear_eccentricity",
            Self::LoadFriction(_) => "load_friction",
            Self::InertiaCoupling(_) => "inertia_coupling",
            Self::ViscousCoupling(_) => "viscous_coupling",
            Self::GravityTilt(_) => "gravity_tilt",
            Self::Payload(_) => "payload",
            Self::JointOffset(_) => "joint_offset",
        }
    }

    /// What is to be said of it.
    pub fn calls_for(&self) -> CallsFor {
        match self {
            Self::ViscousCoupling(_) => CallsFor::Remainder,
            Self::Payload(_) | Self::JointOffset(_) => CallsFor::ParameterChange,
            _ => CallsFor::Name,
        }
    }
}

/// What is to be said of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallsFor {
    /// Its name, and the joint.
    Name,
    /// That values of the description have changed.
    ParameterChange,
    /// That something is left: the library has no such effect.
    Remainder,
}

/// Torque of a fault, from the state and the acceleration of the step before.
pub(super) struct Hidden {
    fault: Option<(usize, Fault)>,
    ratio: f64,
    chain: Chain<f64>,
    /// Without friction, offset and the drive's inertia.
    link: Vec<[f64; COLUMNS]>,
    before: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Hidden {
    /// Of a fault on the arm `model`.
    pub(super) fn new(fault: Option<(usize, Fault)>, robot: &Robot, model: &Model) -> Self {
        let joint = fault.map_or(0, |f| f.0);
        let mut link = model.parameters.clone();
        for row in &mut link {
            row[column::DRIVE_INERTIA..].fill(0.0);
        }
        let rest = vec![0.0; robot.joints.len()];
        Self {
            fault,
            ratio: robot.joints[joint].gear_ratio(),
            chain: model.chain.clone(),
            link,
            before: rest.clone(),
            acceleration: rest,
        }
    }

    /// Takes the fault's torque off what the drives apply.
    ///
    /// # Errors
    /// [`SimulateError`] where the arm has no dynamics there.
    pub(super) fn take(
        &self,
        q: &[f64],
        v: &[f64],
        applied: &mut [f64],
    ) -> Result<(), SimulateError> {
        let Some((j, fault)) = self.fault else {
            return Ok(());
        };
        let turned = (v[j] / TURN).tanh();
        applied[j] -= match fault {
            // Rational, not Gaussian.
            Fault::Stribeck([more, speed]) => more * turned / (1.0 + (v[j] / speed).powi(2)),
            Fault::AsymmetricCoulomb(half) => half * turned.abs(),
            Fault::GearEccentricity([amplitude, phase]) => {
                let angle = self.ratio * q[j] + phase;
                amplitude * (angle.sin() + 0.1 * (2.0 * angle).sin())
            }
            Fault::LoadFriction(share) => {
                let n = q.len();
                let mut load = vec![0.0; n];
                let mut mass = vec![0.0; n * n];
                bias_torque(&self.chain, &self.link, q, v, &mut load)?;
                inertia_matrix(&self.chain, &self.link, q, &mut mass)?;
                let moved = mass[j * n..(j + 1) * n].iter();
                let inertial: f64 = moved.zip(&self.acceleration).map(|(m, a)| m * a).sum();
                share * (load[j] + inertial).abs() * turned
            }
            Fault::InertiaCoupling(inertia) => inertia * self.acceleration[j - 1],
            Fault::ViscousCoupling(viscous) => viscous * v[j - 1],
            Fault::GravityTilt(_) | Fault::Payload(_) | Fault::JointOffset(_) => 0.0,
        };
        Ok(())
    }

    /// Told of the velocities before a step.
    pub(super) fn before(&mut self, v: &[f64]) {
        self.before.copy_from_slice(v);
    }

    /// Told of the velocities after it.
    pub(super) fn after(&mut self, v: &[f64], dt: f64) {
        for ((a, now), before) in self.acceleration.iter_mut().zip(v).zip(&self.before) {
            *a = (now - before) / dt;
        }
    }
}
