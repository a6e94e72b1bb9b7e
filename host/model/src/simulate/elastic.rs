//! Gears with backlash or elasticity at any joints of a chain: the motor is one mass, the link the other.
//!
//! A robot of n joints has n coordinates, and one more for the link of each joint with such a gear. The first n are the
//! motors': positions that the motors would give the joints through stiff gears. With coupled drives they are the
//! solution q of Ψ = F(q). A joint without such a gear has its link at the same coordinate. The gear's torque acts
//! between the two coordinates of its joint. The inertia of coupled motors, its change with the position, and their
//! friction belong to the first n coordinates. So a wound-up gear does not change the ratio of a screw.
//!
//! Sources: Spong 1987 (eqs. 8 and 9: no gyroscopic torque of the rotors); Nordin and Gutman 2002. The drive's inertia,
//! the position sensor and the joint's friction are on the motor's side. The effect moves a share of the joint's viscous
//! and Coulomb friction to the link's side. Friction of coupled motors and of other effects stays on the motor's side.

use rig_shared::effects::{Kind, SHAPES, transmission_torque};
use rig_shared::multibody::{bias_torque, column, inertia_matrix};
use rig_shared::transmission::motor_column;

use super::error::SimulateError;
use super::model::Model;
use super::solve::invert;

/// Largest phase of spring and damping within one step, rad. It limits the step length.
const ANGLE: f64 = 0.1;
/// Bound on the iterations for the twist at rest under gravity. They converge by the ratio of gravity's stiffness to the
/// gear's: a gear of 200 N·m/rad under 3 N·m needs 8.
const REST_PASSES: usize = 64;

/// A gear with backlash or elasticity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gear {
    /// Its joint, from 0; also the coordinate of its motor.
    pub joint: usize,
    /// Coordinate of its link.
    pub link: usize,
    law: [f64; 3],
    /// Share of the joint's friction that acts on the link.
    pub link_friction: f64,
}

impl Gear {
    /// Returns the torque from motor to link for positions and velocities of all coordinates.
    pub(super) fn torque(&self, q: &[f64], v: &[f64]) -> f64 {
        let [gap, stiffness, damping] = self.law;
        let [twist, speed] = [q, v].map(|x| x[self.joint] - x[self.link]);
        transmission_torque(gap, stiffness, damping, twist, speed)
    }
}

/// The gears of a chain, and the state of the links behind them.
#[derive(Clone, Debug)]
pub(super) struct Elastic {
    /// By joint.
    pub gears: Vec<Gear>,
    /// Coordinate of each joint's link.
    pub at: Vec<usize>,
    /// Positions of the coordinates beyond the joints'.
    pub q: Vec<f64>,
    /// Their velocities.
    pub v: Vec<f64>,
    /// True if the links have a state.
    pub moving: bool,
}

impl Elastic {
    /// Returns the gears of the model.
    ///
    /// # Errors
    /// [`SimulateError::NoRotor`], [`SimulateError::NotPositiveDefinite`] if motor or link has no inertia.
    pub(super) fn of(model: &Model) -> Result<Self, SimulateError> {
        let n = model.parameters.len();
        let mut gears = Vec::new();
        let mut at: Vec<usize> = (0..n).collect();
        for joint in 0..n {
            let of = |p: &crate::robot::Placed| {
                let (kind, shapes) = (p.effect.kind, &p.effect.shapes);
                kind.transmission(shapes).zip(kind.link_friction(shapes))
            };
            let mut own = model.effects.placed().iter().filter(|p| p.joint == joint);
            let Some((law, link_friction)) = own.find_map(of) else {
                continue;
            };
            refuse_no_rotor(model, joint)?;
            let link = n + gears.len();
            at[joint] = link;
            gears.push(Gear {
                joint,
                link,
                law,
                link_friction,
            });
        }
        let elastic = Self {
            q: vec![0.0; gears.len()],
            v: vec![0.0; gears.len()],
            gears,
            at,
            moving: false,
        };
        if !elastic.is_empty() {
            elastic.link_mobility(model, &vec![0.0; n])?;
        }
        Ok(elastic)
    }

    /// Returns true if all gears are stiff.
    pub(super) fn is_empty(&self) -> bool {
        self.gears.is_empty()
    }

    /// Returns the share of the friction of a joint that acts on a link behind its gear.
    pub(super) fn link_friction(&self, joint: usize) -> f64 {
        self.gear(joint).map_or(0.0, |gear| gear.link_friction)
    }

    /// Returns the gear of a joint, if it is not stiff.
    pub(super) fn gear(&self, joint: usize) -> Option<&Gear> {
        self.gears.iter().find(|gear| gear.joint == joint)
    }

    /// Copies the values of the links from those of all coordinates.
    pub(super) fn links(&self, all: &[f64], out: &mut [f64]) {
        for (own, at) in out.iter_mut().zip(&self.at) {
            *own = all[*at];
        }
    }

    /// Returns the inverse of the inertia matrix of the links and of the motors with stiff gears (n × n), the other motors
    /// at rest.
    fn link_mobility(&self, model: &Model, q: &[f64]) -> Result<Vec<f64>, SimulateError> {
        let n = q.len();
        let mut rows = model.parameters.clone();
        for gear in &self.gears {
            rows[gear.joint][column::DRIVE_INERTIA] = 0.0;
        }
        let mut matrix = vec![0.0; n * n];
        inertia_matrix(&model.chain, &rows, q, &mut matrix)?;
        if let Some(coupled) = &model.motors {
            let mut motors = vec![0.0; n * n];
            let t = &coupled.transmission;
            t.add_motor_inertia(&coupled.parameters, q, &mut motors)?;
            let stiff = |j: usize| self.at[j] == j;
            for k in (0..n * n).filter(|k| stiff(k / n) && stiff(k % n)) {
                matrix[k] += motors[k];
            }
        }
        let mut inverse = vec![0.0; n * n];
        invert(&mut matrix, &mut inverse, n)?;
        Ok(inverse)
    }

    /// Returns the number of substeps of a step of `dt` with the motors at `q`: the phase of the fastest gear within one
    /// is [`ANGLE`] at most. The masses on the two sides of a gear are taken with all other coordinates free, which gives
    /// the highest rate.
    pub(super) fn steps(&self, model: &Model, q: &[f64], dt: f64) -> Result<usize, SimulateError> {
        let n = q.len();
        let mut at = q.to_vec();
        for (gear, link) in self.gears.iter().zip(&self.q) {
            at[gear.joint] = *link;
        }
        let links = self.link_mobility(model, &at)?;
        let mut motors = vec![0.0; n * n];
        // Joints with stiff gears move with their links: here they only need an inertia.
        for (j, own) in model.parameters.iter().enumerate() {
            motors[j * n + j] = own[column::DRIVE_INERTIA];
        }
        if let Some(coupled) = &model.motors {
            let t = &coupled.transmission;
            t.add_motor_inertia(&coupled.parameters, q, &mut motors)?;
        }
        let mut rate = 0.0_f64;
        for gear in &self.gears {
            let j = gear.joint;
            let motor = self.motor_mobility(&motors, n, j)?;
            let reduced = 1.0 / (motor + links[j * n + j]);
            let [_, stiffness, damping] = gear.law;
            rate = rate.max((stiffness / reduced).sqrt() + damping / reduced);
        }
        Ok((dt * rate / ANGLE).ceil().max(1.0) as usize)
    }

    /// Returns the acceleration of motor `joint` per torque on it, from the motors' inertia matrix. Motors behind other
    /// gears of this kind are free; those of stiff gears are held by their links.
    fn motor_mobility(&self, motors: &[f64], n: usize, joint: usize) -> Result<f64, SimulateError> {
        let count = self.gears.len();
        let mut own = vec![0.0; count * count];
        for (r, row) in self.gears.iter().enumerate() {
            for (c, col) in self.gears.iter().enumerate() {
                own[r * count + c] = motors[row.joint * n + col.joint];
            }
        }
        let mut inverse = vec![0.0; count * count];
        let place = self.gears.iter().position(|gear| gear.joint == joint);
        invert(&mut own, &mut inverse, count)
            .map_err(|_| SimulateError::NotPositiveDefinite { joint: joint + 1 })?;
        Ok(place.map_or(0.0, |k| inverse[k * count + k]))
    }

    /// Puts the links at rest under gravity behind motors at `q`, with the velocities `v` of the motors.
    ///
    /// Takes the side of a backlash that gravity presses on. A gear softer than gravity's stiffness has no such rest:
    /// the links then start from the last iterate.
    pub(super) fn put_at_rest(
        &mut self,
        model: &Model,
        q: &[f64],
        v: &[f64],
    ) -> Result<(), SimulateError> {
        let n = q.len();
        let (mut links, mut load) = (q.to_vec(), vec![0.0; n]);
        let still = vec![0.0; n];
        for _ in 0..REST_PASSES {
            bias_torque(&model.chain, &model.parameters, &links, &still, &mut load)?;
            let mut moved = false;
            for gear in &self.gears {
                let j = gear.joint;
                let [gap, stiffness, _] = gear.law;
                // The model's own offset and friction act on the motor.
                let pull = load[j] - model.parameters[j][column::OFFSET];
                let contact = 0.5 * gap * f64::from(i8::from(pull > 0.0) - i8::from(pull < 0.0));
                let link = q[j] - pull / stiffness - contact;
                moved |= link != links[j];
                links[j] = link;
            }
            if !moved {
                break;
            }
        }
        for (k, gear) in self.gears.iter().enumerate() {
            (self.q[k], self.v[k]) = (links[gear.joint], v[gear.joint]);
        }
        self.moving = true;
        Ok(())
    }
}

/// Refuses a gear whose motor has no inertia.
fn refuse_no_rotor(model: &Model, joint: usize) -> Result<(), SimulateError> {
    let own = model.parameters[joint][column::DRIVE_INERTIA];
    let coupled = model
        .motors
        .as_ref()
        .and_then(|motors| motors.parameters.get(joint))
        .map_or(0.0, |row| row[motor_column::INERTIA]);
    if own + coupled > 0.0 {
        return Ok(());
    }
    let elastic = |k: Kind| k.transmission(&[0.0; SHAPES]).is_some();
    Err(SimulateError::NoRotor {
        effect: model.effects.named_at(joint, elastic).unwrap_or_default(),
    })
}
