//! Faults of one joint of an arm and their torques.

use rig_shared::multibody::{COLUMNS, Chain, bias_torque, column, inertia_matrix};

use rig_model::robot::Robot;
use rig_model::simulate::{Model, SimulateError};

/// Speed scale of the smooth reversal of a fault's dry friction, rad/s.
const TURN: f64 = 5e-3;

/// A fault of one joint. Torques are additional drive torques.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Friction that falls with speed: torque, N·m, and speed at which half of it remains, rad/s.
    Stribeck([f64; 2]),
    /// More friction forwards than backwards, N·m.
    AsymmetricCoulomb(f64),
    /// A sine once per motor turn, with a second harmonic of a tenth of its amplitude: amplitude, N·m, and phase, rad.
    GearEccentricity([f64; 2]),
    /// Friction per transmitted torque of the gear.
    LoadFriction(f64),
    /// Torque per acceleration of the preceding joint, kg·m².
    InertiaCoupling(f64),
    /// Torque per velocity of the preceding joint, N·m·s/rad: shared friction without inertia.
    ViscousCoupling(f64),
    /// Tilt of the base about x and y, rad.
    GravityTilt([f64; 2]),
    /// A point mass, kg, at a place in the link's frame, m.
    Payload([f64; 4]),
    /// Position reading minus true position, rad.
    JointOffset(f64),
}

impl Fault {
    /// Name in results: that of the library's effect if there is one.
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

    /// Diagnosis that is expected for the fault.
    pub fn calls_for(&self) -> CallsFor {
        match self {
            Self::ViscousCoupling(_) => CallsFor::Remainder,
            Self::Payload(_) | Self::JointOffset(_) => CallsFor::ParameterChange,
            _ => CallsFor::Name,
        }
    }
}

/// Expected diagnosis of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallsFor {
    /// Name and joint of the fault.
    Name,
    /// A change of values in the description.
    ParameterChange,
    /// A remainder: the library has no such effect.
    Remainder,
}

/// Torque of a fault, from the state and the acceleration of the step before.
pub(super) struct Hidden {
    fault: Option<(usize, Fault)>,
    ratio: f64,
    chain: Chain<f64>,
    /// Parameters of the links without friction, offset and drive inertia.
    link: Vec<[f64; COLUMNS]>,
    before: Vec<f64>,
    acceleration: Vec<f64>,
}

impl Hidden {
    /// Creates the torque model of a fault on the arm `model`.
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

    /// Subtracts the fault's torque from the applied torques.
    ///
    /// # Errors
    /// [`SimulateError`] if the dynamics of the arm cannot be computed there.
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
            // Rational instead of Gaussian, unlike the library's effect.
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

    /// Stores the velocities before a step.
    pub(super) fn before(&mut self, v: &[f64]) {
        self.before.copy_from_slice(v);
    }

    /// Computes the accelerations from the velocities after the step.
    pub(super) fn after(&mut self, v: &[f64], dt: f64) {
        for ((a, now), before) in self.acceleration.iter_mut().zip(v).zip(&self.before) {
            *a = (now - before) / dt;
        }
    }
}
