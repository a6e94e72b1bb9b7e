//! A gear with play or elasticity: the motor as one mass, the link as the other.
//!
//! Sources: Spong 1987; Nordin and Gutman 2002. The drive's inertia and the position sensor are on the motor's side. So is the
//! joint's friction, but for the share of its viscous and Coulomb parts that the effect puts on the link's; what effects add
//! to friction stays on the motor.

use rig_shared::effects::{Kind, SHAPES, transmitted};
use rig_shared::multibody::{bias_torque, column, inertia_matrix};

use super::{Model, SimulateError};

/// Steps are so short that neither the spring nor its damping turns by more than this within one, rad.
const ANGLE: f64 = 0.1;
/// Passes on the twist at rest under gravity.
const REST_PASSES: usize = 8;

/// The gear, and the link behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elastic {
    law: [f64; 3],
    /// Share of the joint's friction that acts on the link.
    pub link_friction: f64,
    /// Inertia of the motor's side.
    pub rotor: f64,
    /// rad/s that a step has to resolve.
    rate: f64,
    /// Position and velocity of the link; none before the first step.
    pub link: Option<[f64; 2]>,
}

impl Elastic {
    /// The one that the model has, if any.
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

    /// Torque from motor to link at these positions and velocities of the two.
    pub(super) fn torque(&self, q: &[f64], v: &[f64]) -> f64 {
        let [gap, stiffness, damping] = self.law;
        transmitted(gap, stiffness, damping, q[0] - q[1], v[0] - v[1])
    }

    /// Steps that a step of `dt` is cut into.
    pub(super) fn steps(&self, dt: f64) -> usize {
        (dt * self.rate / ANGLE).ceil().max(1.0) as usize
    }

    /// Where the link hangs at rest behind a motor at `q`.
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
