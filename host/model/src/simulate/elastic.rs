//! Gears with backlash or elasticity at any joints of a chain: the motor is one mass, the link the other.
//!
//! A robot of n joints has n coordinates, and one more for the link of each joint with such a gear. The first n are the
//! motors': positions θ that the motors would give the joints through stiff gears. With coupled drives they are the
//! solution of Ψ = F(θ). A joint without such a gear has its link at the same coordinate. The inertia of coupled motors,
//! its change with the position, and their friction belong to the first n coordinates.
//!
//! The gear of a drive is a spring in series with its motor: its twist is Ψ(θ) − Ψ(q), q the links, and its torque acts
//! on θ and on q by the Jacobian of Ψ at either. Twist and stiffness are those of the joint for simple and coupled drives
//! (motor radians over the drive's own ratio), and those of the motor for a screw, whose ratio changes. A coupled drive
//! connects joints, so all drives that are coupled have such a gear, or none.
//!
//! Sources: Spong 1987 (eqs. 8 and 9: no gyroscopic torque of the rotors); Nordin and Gutman 2002. The drive's inertia,
//! the position sensor and the joint's friction are on the motor's side. The effect moves a share of the joint's viscous
//! and Coulomb friction to the link's side. Friction of coupled motors and of other effects stays on the motor's side.

use std::f64::consts::TAU;

use rig_shared::effects::{Kind, SHAPES, transmission_torque};
use rig_shared::multibody::{bias_torque, column, inertia_matrix};
use rig_shared::transmission::{DriveKind, motor_column};

use nalgebra::{DMatrix, DVector};

use super::error::{Light, SimulateError, TooStiff};
use super::model::Model;
use super::solve::invert;

/// Largest phase of spring and damping within one step, rad. It limits the step length.
const ANGLE: f64 = 0.1;
/// Highest frequency of a gear that is integrated, Hz. The steps are about 60 to a period, so it bounds the time: a second of
/// motion takes 1.3 million steps at most. Gears of arms lie between 5 and 200 Hz, and the fastest stiff screws near 2 kHz.
const HIGHEST: f64 = 20e3;
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
    /// Motor radians per unit of twist: the drive's own ratio; 1 for a screw.
    scale: f64,
    /// Share of the joint's friction that acts on the link.
    pub link_friction: f64,
}

impl Gear {
    /// Returns the torque from motor to link.
    fn torque(&self, twist: f64, speed: f64) -> f64 {
        let [gap, stiffness, damping] = self.law;
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
    /// Rate of the gear of a robot of one joint, whose inertia does not change, rad/s.
    rate: Option<f64>,
    /// Torques that the gears take from the motors' coordinates, and give to the links, joint by joint.
    pub torque: [Vec<f64>; 2],
    side: Side,
}

/// Buffers for one side of the gears.
#[derive(Clone, Debug)]
struct Side {
    q: Vec<f64>,
    v: Vec<f64>,
    position: Vec<f64>,
    speed: Vec<f64>,
    /// n × n, motors' side and links' side.
    jacobians: [Vec<f64>; 2],
    /// Twist and its rate by drive, in motor radians.
    twist: Vec<[f64; 2]>,
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
                scale: 1.0,
                link_friction,
            });
        }
        refuse_half_coupled(model, &mut gears)?;
        let list = || vec![0.0; n];
        let mut elastic = Self {
            torque: [list(), list()],
            side: Side {
                q: list(),
                v: list(),
                position: list(),
                speed: list(),
                jacobians: [vec![0.0; n * n], vec![0.0; n * n]],
                twist: vec![[0.0; 2]; n],
            },
            q: vec![0.0; gears.len()],
            v: vec![0.0; gears.len()],
            gears,
            at,
            moving: false,
            rate: None,
        };
        if elastic.is_empty() {
            return Ok(elastic);
        }
        // Refuses links and motors without inertia.
        elastic.link_mobility(model, &vec![0.0; n])?;
        if n == 1 && model.motors.is_none() {
            elastic.rate = Some(elastic.fastest(model, &[0.0])?);
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

    /// Computes the torques of all gears from positions and velocities of all coordinates.
    ///
    /// # Errors
    /// [`SimulateError::Drives`] on wrong lengths.
    pub(super) fn transmit(
        &mut self,
        model: &Model,
        q: &[f64],
        v: &[f64],
    ) -> Result<(), SimulateError> {
        let n = self.at.len();
        for side in &mut self.torque {
            side.fill(0.0);
        }
        let Some(motors) = &model.motors else {
            for gear in &self.gears {
                let [twist, speed] = [q, v].map(|x| x[gear.joint] - x[gear.link]);
                let torque = gear.torque(twist, speed);
                self.torque[0][gear.joint] = torque;
                self.torque[1][gear.joint] = torque;
            }
            return Ok(());
        };
        let own = &mut self.side;
        own.twist.fill([0.0; 2]);
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            for j in 0..n {
                let at = if side == 0 { j } else { self.at[j] };
                (own.q[j], own.v[j]) = (q[at], v[at]);
            }
            let t = &motors.transmission;
            t.motor_position(&own.q, &mut own.position)?;
            t.motor_velocity(&own.q, &own.v, &mut own.speed)?;
            t.jacobian(&own.q, &mut own.jacobians[side])?;
            for (twist, (position, speed)) in
                (own.twist.iter_mut()).zip(own.position.iter().zip(&own.speed))
            {
                twist[0] += sign * position;
                twist[1] += sign * speed;
            }
        }
        for gear in &self.gears {
            let k = gear.joint;
            let [twist, speed] = own.twist[k].map(|x| x / gear.scale);
            let torque = gear.torque(twist, speed) / gear.scale;
            for (jacobian, torques) in own.jacobians.iter().zip(&mut self.torque) {
                let row = &jacobian[k * n..(k + 1) * n];
                for (to, entry) in torques.iter_mut().zip(row) {
                    *to += entry * torque;
                }
            }
        }
        Ok(())
    }

    /// Returns the twist of each gear per motion of the joints (rows: gears) at positions of the joints.
    fn twists(&self, model: &Model, q: &[f64]) -> Result<DMatrix<f64>, SimulateError> {
        let n = q.len();
        let Some(motors) = &model.motors else {
            return Ok(DMatrix::from_fn(self.gears.len(), n, |k, j| {
                f64::from(u8::from(self.gears[k].joint == j))
            }));
        };
        let mut jacobian = vec![0.0; n * n];
        motors.transmission.jacobian(q, &mut jacobian)?;
        Ok(DMatrix::from_fn(self.gears.len(), n, |k, j| {
            jacobian[self.gears[k].joint * n + j] / self.gears[k].scale
        }))
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
    /// is [`ANGLE`] at most.
    ///
    /// # Errors
    /// [`SimulateError::TooStiff`] beyond [`HIGHEST`].
    pub(super) fn steps(&self, model: &Model, q: &[f64], dt: f64) -> Result<usize, SimulateError> {
        let rate = match self.rate {
            Some(rate) => rate,
            None => self.fastest(model, q)?,
        };
        Ok((dt * rate / ANGLE).ceil().max(1.0) as usize)
    }

    /// Returns the rate of the fastest gear with the motors at `q`, rad/s. The masses on the two sides of a gear are taken
    /// with all other coordinates free, which gives the highest rate.
    ///
    /// # Errors
    /// [`SimulateError::TooStiff`] beyond [`HIGHEST`].
    fn fastest(&self, model: &Model, q: &[f64]) -> Result<f64, SimulateError> {
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
        let motors = self.motor_mobility(&motors, n)?;
        let links = DMatrix::from_row_slice(n, n, &links);
        let [of_motors, of_links] = [self.twists(model, q)?, self.twists(model, &at)?];
        let mut rate = 0.0_f64;
        for (k, gear) in self.gears.iter().enumerate() {
            let of_motor = of_motors.row(k).select_columns(&self.joints());
            let motor = (&of_motor * &motors).dot(&of_motor);
            let link = (of_links.row(k) * &links).dot(&of_links.row(k));
            let reduced = 1.0 / (motor + link);
            let [_, stiffness, damping] = gear.law;
            let [spring, damper] = [(stiffness / reduced).sqrt(), damping / reduced];
            let own = spring + damper;
            if !(own <= TAU * HIGHEST) {
                return Err(SimulateError::TooStiff(Box::new(TooStiff {
                    effect: named_gear(model, gear.joint),
                    frequency: own / TAU,
                    highest: HIGHEST,
                    by: if spring >= damper {
                        "stiffness"
                    } else {
                        "damping"
                    },
                    light: if motor >= link {
                        Light::Rotor
                    } else {
                        Light::Link
                    },
                    inertia: 1.0 / motor.max(link),
                })));
            }
            rate = rate.max(own);
        }
        Ok(rate)
    }

    /// Returns the joints with gears.
    fn joints(&self) -> Vec<usize> {
        self.gears.iter().map(|gear| gear.joint).collect()
    }

    /// Returns the accelerations of the motors behind gears per torque on them, from the motors' inertia matrix (n × n).
    /// Motors of stiff gears are held by their links.
    fn motor_mobility(&self, motors: &[f64], n: usize) -> Result<DMatrix<f64>, SimulateError> {
        let count = self.gears.len();
        let mut own = vec![0.0; count * count];
        for (r, row) in self.gears.iter().enumerate() {
            for (c, col) in self.gears.iter().enumerate() {
                own[r * count + c] = motors[row.joint * n + col.joint];
            }
        }
        let mut inverse = vec![0.0; count * count];
        let joint = self.gears.first().map_or(1, |gear| gear.joint + 1);
        invert(&mut own, &mut inverse, count)
            .map_err(|_| SimulateError::NotPositiveDefinite { joint })?;
        Ok(DMatrix::from_row_slice(count, count, &inverse))
    }

    /// Returns the twist of a gear, of which [`Self::transmit`] has just computed the torque.
    fn twist(&self, model: &Model, q: &[f64], gear: &Gear) -> f64 {
        match model.motors {
            Some(_) => self.side.twist[gear.joint][0] / gear.scale,
            None => q[gear.joint] - q[gear.link],
        }
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
        let joints = self.joints();
        let mut all = q.to_vec();
        all.resize(n + joints.len(), 0.0);
        let at_rest = vec![0.0; all.len()];
        for _ in 0..REST_PASSES {
            bias_torque(&model.chain, &model.parameters, &links, &still, &mut load)?;
            // The model's own offset and friction act on the motor.
            let pull = DVector::from_iterator(
                joints.len(),
                joints
                    .iter()
                    .map(|&j| load[j] - model.parameters[j][column::OFFSET]),
            );
            let to_twist = self.twists(model, &links)?.select_columns(&joints);
            let singular = || SimulateError::NotPositiveDefinite {
                joint: joints.first().map_or(1, |j| j + 1),
            };
            let lu = to_twist.clone().lu();
            let torque = to_twist
                .transpose()
                .lu()
                .solve(&pull)
                .ok_or_else(singular)?;
            for (gear, link) in self.gears.iter().zip(joints.iter().map(|&j| links[j])) {
                all[gear.link] = link;
            }
            self.transmit(model, &all, &at_rest)?;
            let wanted = self.gears.iter().zip(torque.iter()).map(|(gear, pull)| {
                let [gap, stiffness, _] = gear.law;
                let contact = 0.5 * gap * f64::from(i8::from(*pull > 0.0) - i8::from(*pull < 0.0));
                pull / stiffness + contact
            });
            let twist = self.gears.iter().map(|gear| self.twist(model, &all, gear));
            let beyond = DVector::from_iterator(
                joints.len(),
                wanted.zip(twist).map(|(wanted, twist)| wanted - twist),
            );
            let step = lu.solve(&beyond).ok_or_else(singular)?;
            let mut moved = false;
            for (&j, step) in joints.iter().zip(step.iter()) {
                let link = links[j] - step;
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
    Err(SimulateError::NoRotor {
        effect: named_gear(model, joint),
    })
}

/// Names the effect of a gear and its joint.
fn named_gear(model: &Model, joint: usize) -> String {
    let elastic = |k: Kind| k.transmission(&[0.0; SHAPES]).is_some();
    model.effects.named_at(joint, elastic).unwrap_or_default()
}

/// Gives the gears of coupled drives their ratios. Refuses a gear of a drive that is coupled with one whose gear is
/// stiff: a stiff gear binds coordinates of several joints, and these would be no coordinates of their own.
fn refuse_half_coupled(model: &Model, gears: &mut [Gear]) -> Result<(), SimulateError> {
    let Some(motors) = &model.motors else {
        return Ok(());
    };
    let n = model.parameters.len();
    let t = &motors.transmission;
    let has = |joint: usize| gears.iter().any(|gear| gear.joint == joint);
    for drive in 0..n {
        for joint in 0..n {
            if !t.turns_with(drive, joint) || has(drive) == has(joint) {
                continue;
            }
            let (own, other) = if has(drive) {
                (drive, joint)
            } else {
                (joint, drive)
            };
            return Err(SimulateError::HalfCoupled {
                effect: named_gear(model, own),
                other: other + 1,
            });
        }
    }
    for gear in gears {
        if t.kind(gear.joint) != Some(DriveKind::Simple) && gear.link_friction > 0.0 {
            return Err(SimulateError::LinkFriction {
                effect: named_gear(model, gear.joint),
                share: gear.link_friction,
            });
        }
        gear.scale = t.own_turns(gear.joint).unwrap_or(1.0);
    }
    Ok(())
}
