//! Gears with backlash or elasticity at any joints of a chain: the motor is one mass, the link the other.
//!
//! A robot of n joints has n coordinates, and one more for the link of each joint with such a gear. The first n are the
//! motors': positions θ that the motors would give the joints through stiff gears. With coupled drives they are the
//! solution of Ψ = F(θ). The inertia of coupled motors, its change with the position, and their friction belong to them.
//! A joint without such a gear has its link at the same coordinate, unless its drive is coupled with one that has.
//!
//! The gear of a drive is a spring in series with its motor: its twist is Ψ(θ) − Ψ(q), q the links, and its torque acts
//! on θ and on q by the Jacobian of Ψ at either. Twist and stiffness are those of the joint for simple and coupled drives
//! (motor radians over the drive's own ratio), and those of the motor for a screw, whose ratio changes. Where coupled
//! drives have elastic and stiff gears, a stiff one connects the joints on both sides ([`super::link_map`]).
//!
//! Sources: Spong 1987 (eqs. 8 and 9: no gyroscopic torque of the rotors); Nordin and Gutman 2002. The drive's inertia,
//! the position sensor and the joint's friction are on the motor's side. The effect moves a share of the joint's viscous
//! and Coulomb friction to the link's side. Friction of coupled motors and of other effects stays on the motor's side.

use std::f64::consts::TAU;

use rig_shared::effects::{Kind, SHAPES, transmission_torque};
use rig_shared::multibody::{bias_torque, column, inertia_matrix};
use rig_shared::transmission::{DriveKind, Transmission, motor_column};

use nalgebra::{DMatrix, DVector};

use super::error::{Light, SimulateError, TooStiff};
use super::link_map::LinkMap;
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
    /// The links' motion from that of the coordinates.
    pub map: LinkMap,
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
        let n = model.joint_count();
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
        refuse_link_friction(model, &gears)?;
        let list = || vec![0.0; n];
        let mut elastic = Self {
            torque: [list(), list()],
            side: Side {
                position: list(),
                speed: list(),
                jacobians: [vec![0.0; n * n], vec![0.0; n * n]],
                twist: vec![[0.0; 2]; n],
            },
            q: vec![0.0; gears.len()],
            v: vec![0.0; gears.len()],
            gears,
            map: LinkMap::of(model, at),
            moving: false,
            rate: None,
        };
        if elastic.is_empty() {
            return Ok(elastic);
        }
        // Refuses links and motors without inertia. The ratios of screws may have no inverse at the origin: a robot with
        // screws is checked at its first step.
        let drives = model.motors.as_ref().map(|motors| &motors.transmission);
        if drives.is_none_or(Transmission::is_constant) {
            elastic.link_mobility(model, &vec![0.0; n], &vec![0.0; n])?;
        }
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

    /// Computes the torques of all gears from positions and velocities of all coordinates, with the links where
    /// [`Self::map`] has put them.
    ///
    /// # Errors
    /// [`SimulateError::Drives`] on wrong lengths.
    pub(super) fn transmit(
        &mut self,
        model: &Model,
        q: &[f64],
        v: &[f64],
    ) -> Result<(), SimulateError> {
        let n = self.map.q.len();
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
        let of_motors = [&q[..n], &v[..n]];
        let of_links = [&self.map.q[..], &self.map.v];
        for (side, sign, [q, v]) in [(0, 1.0, of_motors), (1, -1.0, of_links)] {
            let t = &motors.transmission;
            t.motor_position(q, &mut own.position)?;
            t.motor_velocity(q, v, &mut own.speed)?;
            t.jacobian(q, &mut own.jacobians[side])?;
            for (twist, (position, speed)) in
                (own.twist.iter_mut()).zip(own.position.iter().zip(&own.speed))
            {
                twist[0] += sign * position;
                twist[1] += sign * speed;
            }
        }
        for gear in &self.gears {
            let k = gear.joint;
            let turns = self.map.turns(k);
            let [twist, speed] = own.twist[k].map(|x| x / turns);
            let torque = gear.torque(twist, speed) / turns;
            for (jacobian, torques) in own.jacobians.iter().zip(&mut self.torque) {
                let row = &jacobian[k * n..(k + 1) * n];
                for (to, entry) in torques.iter_mut().zip(row) {
                    *to += entry * torque;
                }
            }
        }
        Ok(())
    }

    /// Returns the inertia of the drives in the motors' coordinates `q` (n × n).
    fn drive_inertia(model: &Model, q: &[f64]) -> Result<DMatrix<f64>, SimulateError> {
        let n = q.len();
        let mut matrix = DMatrix::zeros(n, n);
        for (j, own) in model.joint_rows().iter().enumerate() {
            matrix[(j, j)] = own[column::DRIVE_INERTIA];
        }
        if let Some(motors) = &model.motors {
            let t = &motors.transmission;
            t.add_motor_inertia(&motors.parameters, q, matrix.as_mut_slice())?;
        }
        Ok(matrix)
    }

    /// Returns the inverse of the inertia matrix of the links and of the motors with stiff gears (n × n), the other motors
    /// at rest. `q`: positions of the motors; `links`: of the links.
    fn link_mobility(
        &self,
        model: &Model,
        q: &[f64],
        links: &[f64],
    ) -> Result<DMatrix<f64>, SimulateError> {
        let n = q.len();
        let mut rows = model.parameters.clone();
        for row in &mut rows {
            row[column::DRIVE_INERTIA] = 0.0;
        }
        let mut matrix = vec![0.0; n * n];
        inertia_matrix(&model.chain, &rows, links, &mut matrix)?;
        let mut stiff = self.map.jacobian(model, links)?;
        for gear in &self.gears {
            stiff.row_mut(gear.joint).fill(0.0);
        }
        let turned = self.map.inverse(model, q)? * stiff;
        let motors = turned.tr_mul(&(Self::drive_inertia(model, q)? * &turned));
        for (entry, motor) in matrix.iter_mut().zip(&motors) {
            *entry += motor;
        }
        let mut inverse = DMatrix::zeros(n, n);
        invert(&mut matrix, inverse.as_mut_slice(), n)?;
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
        let links = self.link_mobility(model, q, &self.map.q)?;
        let motors = self.motor_mobility(model, q)?;
        let twists = self.map.jacobian(model, &self.map.q)?;
        let mut rate = 0.0_f64;
        for (k, gear) in self.gears.iter().enumerate() {
            let of_link = twists.row(gear.joint);
            let motor = motors[(k, k)];
            let link = (of_link * &links).dot(&of_link);
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

    /// Returns the accelerations of the outputs of the motors behind gears, in the unit of the twist, per torque on them.
    /// Motors of stiff gears are held by their links.
    fn motor_mobility(&self, model: &Model, q: &[f64]) -> Result<DMatrix<f64>, SimulateError> {
        let joints: Vec<usize> = self.gears.iter().map(|gear| gear.joint).collect();
        let count = joints.len();
        let turned = self.map.inverse(model, q)?.select_columns(&joints);
        let mut own = turned.tr_mul(&(Self::drive_inertia(model, q)? * &turned));
        let mut inverse = DMatrix::zeros(count, count);
        let joint = joints.first().map_or(1, |joint| joint + 1);
        invert(own.as_mut_slice(), inverse.as_mut_slice(), count)
            .map_err(|_| SimulateError::NotPositiveDefinite { joint })?;
        Ok(inverse)
    }

    /// Notes positions and velocities of all coordinates, and where the links are.
    ///
    /// # Errors
    /// [`SimulateError::Drives`] if no position of the links fits the drives.
    pub(super) fn note(
        &mut self,
        model: &Model,
        q: &[f64],
        v: &[f64],
    ) -> Result<(), SimulateError> {
        let n = self.map.q.len();
        self.q.copy_from_slice(&q[n..]);
        self.v.copy_from_slice(&v[n..]);
        self.map.locate(model, q)?;
        self.map.follow(model, v)?;
        Ok(())
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
        let motors = self.map.positions(model, q)?;
        for _ in 0..REST_PASSES {
            bias_torque(&model.chain, &model.parameters, &links, &still, &mut load)?;
            // The model's own offset and friction act on the motor.
            for (load, own) in load.iter_mut().zip(model.joint_rows()) {
                *load -= own[column::OFFSET];
            }
            let inverse = self.map.inverse(model, &links)?;
            let pull = inverse.tr_mul(&DVector::from_column_slice(&load));
            // A stiff gear has no twist.
            let mut beyond = DVector::from_vec(self.map.positions(model, &links)?);
            beyond -= DVector::from_column_slice(&motors);
            for gear in &self.gears {
                let [gap, stiffness, _] = gear.law;
                let pull = pull[gear.joint];
                let contact = 0.5 * gap * f64::from(i8::from(pull > 0.0) - i8::from(pull < 0.0));
                beyond[gear.joint] += pull / stiffness + contact;
            }
            let mut moved = false;
            for (link, step) in links.iter_mut().zip(&(inverse * beyond)) {
                let next = *link - step;
                moved |= next != *link;
                *link = next;
            }
            if !moved {
                break;
            }
        }
        let outputs = self.map.positions(model, &links)?;
        let speeds = self.map.jacobian(model, q)? * DVector::from_column_slice(v);
        let (mut positions, mut velocities) = (q.to_vec(), v.to_vec());
        for gear in &self.gears {
            let j = gear.joint;
            let mixed = self.map.is_mixed(j);
            positions.push(if mixed { outputs[j] } else { links[j] });
            velocities.push(if mixed { speeds[j] } else { v[j] });
        }
        self.map.q = links;
        self.note(model, &positions, &velocities)?;
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

/// Refuses friction on the link's side of a coupled drive.
fn refuse_link_friction(model: &Model, gears: &[Gear]) -> Result<(), SimulateError> {
    let Some(motors) = &model.motors else {
        return Ok(());
    };
    for gear in gears {
        let kind = motors.transmission.kind(gear.joint);
        if kind != Some(DriveKind::Simple) && gear.link_friction > 0.0 {
            return Err(SimulateError::LinkFriction {
                effect: named_gear(model, gear.joint),
                share: gear.link_friction,
            });
        }
    }
    Ok(())
}
