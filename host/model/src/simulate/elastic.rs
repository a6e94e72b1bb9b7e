//! A gear with backlash or elasticity: the motor is one mass, the link the other.
//!
//! Sources: Spong 1987; Nordin and Gutman 2002. The drive's inertia, the position sensor and the joint's friction are
//! on the motor's side. The effect moves a share of viscous and Coulomb friction to the link's side. Friction of other
//! effects stays on the motor.

use rig_shared::effects::{Kind, SHAPES, transmission_torque};
use rig_shared::multibody::{bias_torque, column, inertia_matrix};

use super::error::SimulateError;
use super::model::Model;

/// Largest phase of spring and damping within one step, rad. It limits the step length.
const ANGLE: f64 = 0.1;
/// Iterations for the twist at rest under gravity.
const REST_PASSES: usize = 8;

/// The gear, and the link behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elastic {
    law: [f64; 3],
    /// Share of the joint's friction that acts on the link.
    pub link_friction: f64,
    /// Inertia of the motor's side.
    pub rotor: f64,
    /// Rate that a step has to resolve, rad/s.
    rate: f64,
    /// Position and velocity of the link; `None` before the first step.
    pub link: Option<[f64; 2]>,
}

impl Elastic {
    /// Returns the elastic gear of the model, if any.
    pub(super) fn of(model: &Model) -> Result<Option<Self>, SimulateError> {
        let of = |p: &crate::robot::Placed| {
            let (kind, shapes) = (p.effect.kind, &p.effect.shapes);
            kind.transmission(shapes).zip(kind.link_friction(shapes))
        };
        let Some((law, link_friction)) = model.effects.placed().iter().find_map(of) else {
            return Ok(None);
        };
        let elastic = |k: Kind| k.transmission(&[0.0; SHAPES]).is_some();
        let effect = || model.effects.named(elastic).unwrap_or_default();
        if model.parameters.len() != 1 || model.motors.is_some() {
            return Err(SimulateError::ElasticChain { effect: effect() });
        }
        let rotor = model.parameters[0][column::DRIVE_INERTIA];
        if !(rotor > 0.0) {
            return Err(SimulateError::NoRotor { effect: effect() });
        }
        let mut rows = model.parameters.clone();
        rows[0][column::DRIVE_INERTIA] = 0.0;
        let mut inertia = [0.0];
        inertia_matrix(&model.chain, &rows, &[0.0], &mut inertia)?;
        if !(inertia[0] > 0.0) {
            return Err(SimulateError::NotPositiveDefinite { joint: 1 });
        }
        let reduced = 1.0 / (1.0 / rotor + 1.0 / inertia[0]);
        let [_, stiffness, damping] = law;
        Ok(Some(Self {
            law,
            link_friction,
            rotor,
            rate: (stiffness / reduced).sqrt() + damping / reduced,
            link: None,
        }))
    }

    /// Returns the torque from motor to link for positions and velocities of both.
    pub(super) fn torque(&self, q: &[f64], v: &[f64]) -> f64 {
        let [gap, stiffness, damping] = self.law;
        transmission_torque(gap, stiffness, damping, q[0] - q[1], v[0] - v[1])
    }

    /// Returns the number of substeps of a step of `dt`.
    pub(super) fn steps(&self, dt: f64) -> usize {
        (dt * self.rate / ANGLE).ceil().max(1.0) as usize
    }

    /// Returns the position of the link at rest behind a motor at `q`.
    pub(super) fn at_rest(&self, model: &Model, q: f64) -> Result<f64, SimulateError> {
        let [gap, stiffness, _] = self.law;
        let (mut link, mut load) = (q, [0.0]);
        for _ in 0..REST_PASSES {
            bias_torque(&model.chain, &model.parameters, &[link], &[0.0], &mut load)?;
            // The model's own offset and friction act on the motor.
            let pull = load[0] - model.parameters[0][column::OFFSET];
            let contact = 0.5 * gap * f64::from(i8::from(pull > 0.0) - i8::from(pull < 0.0));
            link = q - pull / stiffness - contact;
        }
        Ok(link)
    }
}
