//! One time step of a chain with dry friction that really sticks.
//!
//! Midpoint time-stepping after Moreau (1988; Jean 1999): positions advance by half a step, velocities by a whole step,
//! positions by the other half. Coulomb friction is a set-valued torque. Within a step it takes the value in [−fc, fc]
//! that brings the joint to rest, or ±fc if that is not enough. Nothing is smoothed, so a joint below breakaway stands
//! still exactly. The method is second order in the step while no joint starts or stops.
//!
//! Motors of coupled drives add their inertia A + Jᵀ·I_m·J, its change with the position, their viscous friction and
//! Coulomb friction along the motor's motion. All are taken in the middle of the step.
//!
//! Effects beyond the standard model follow their laws. Terms that depend on the direction widen or shift the bounds of
//! the set-valued friction ([−fc + h(−1), fc + h(1)] at the speed of the step). Presliding replaces its part of Coulomb
//! friction. Other terms are torques in the middle of the step. A coupled inertia is part of the matrix. With backlash
//! or elasticity the motor of a joint is a separate mass ([`super::elastic`]), and the steps are short enough for the gears.
//!
//! Leaves out end stops, temperatures and the electrical side.

use rig_shared::multibody::{COLUMNS, MultibodyError, column, inertia_matrix, inverse_dynamics};
use rig_shared::scalar::Real as _;
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use super::acting::Acting;
use super::elastic::Elastic;
use super::error::SimulateError;
use super::friction::{DryFriction, refuse_driving_friction};
use super::history::Since;
use super::model::Model;
use super::solve::{invert, invert_any};

/// Passes over velocity-dependent terms. The second makes the step second order.
const PASSES: usize = 2;
/// Passes if effects depend on accelerations and hidden states. They converge, but not in one pass.
const PASSES_WITH_EFFECTS: usize = 5;

/// Steps a model. Owns every buffer: a step allocates nothing, except with elastic gears of several joints, whose step
/// length follows the pose.
pub struct Stepper<'a> {
    model: &'a Model,
    /// The parameters without friction and offset, which the step computes itself.
    smooth: Vec<[f64; COLUMNS]>,
    mass: Vec<f64>,
    factor: Vec<f64>,
    inverse: Vec<f64>,
    bias: Vec<f64>,
    middle: Vec<f64>,
    mean_velocity: Vec<f64>,
    free: Vec<f64>,
    next: Vec<f64>,
    /// Viscous friction, n × n.
    damping: Vec<f64>,
    friction: DryFriction,
    acting: Acting<'a>,
    elastic: Elastic,
    /// Positions and velocities of all coordinates.
    both: [Vec<f64>; 2],
    acceleration: Vec<f64>,
    /// Loads of the links on the gears.
    loads: Vec<f64>,
    /// Columns of the motors at zero acceleration.
    columns: Vec<f64>,
    /// Torques from outside on the links; empty for none.
    external: Vec<f64>,
    joints: JointBuffers,
}

/// Terms of the joints alone, before they are placed among all coordinates.
struct JointBuffers {
    acceleration: Vec<f64>,
    torque: Vec<f64>,
    /// n × n.
    matrix: Vec<f64>,
}

impl<'a> Stepper<'a> {
    /// Continues the effects from a history.
    pub fn go_on(&mut self, since: &Since) {
        self.acting.go_on(since);
    }

    /// Prepares the steps of a model.
    ///
    /// # Errors
    /// [`SimulateError::NegativeFriction`] if a joint's friction would feed energy in.
    pub fn new(model: &'a Model) -> Result<Self, SimulateError> {
        let joints = model.joint_count();
        let elastic = Elastic::of(model)?;
        // The motors, then the links that are masses of their own.
        let n = joints + elastic.gears.len();
        let smooth = without_friction(model, &elastic)?;
        let coulomb = coulomb(model, &elastic)?;
        let columns = match &model.motors {
            Some(_) => vec![0.0; joints * joints * MOTOR_COLUMNS],
            None => Vec::new(),
        };
        let stepper = Self {
            model,
            smooth,
            mass: vec![0.0; n * n],
            factor: vec![0.0; n * n],
            inverse: vec![0.0; n * n],
            bias: vec![0.0; n],
            middle: vec![0.0; n],
            mean_velocity: vec![0.0; n],
            free: vec![0.0; n],
            next: vec![0.0; n],
            damping: vec![0.0; n * n],
            friction: DryFriction::new(coulomb, n),
            acting: Acting::new(&model.effects, n, joints),
            acceleration: vec![0.0; n],
            loads: vec![0.0; joints],
            columns,
            external: Vec::with_capacity(joints),
            joints: JointBuffers {
                acceleration: vec![0.0; joints],
                torque: vec![0.0; joints],
                matrix: vec![0.0; joints * joints],
            },
            elastic,
            both: [Vec::with_capacity(n), Vec::with_capacity(n)],
        };
        refuse_driving_friction(model, &stepper.elastic)?;
        Ok(stepper)
    }

    /// Computes the position-dependent terms in the middle of the step: inertia, damping and directions of friction.
    fn place(&mut self) -> Result<(), SimulateError> {
        let n = self.middle.len();
        let own = &mut self.joints;
        let joints = own.torque.len();
        let map = &mut self.elastic.map;
        map.locate(self.model, &self.middle)?;
        inertia_matrix(&self.model.chain, &self.smooth, &map.q, &mut own.matrix)?;
        for (joint, other, inertia) in self.acting.couplings() {
            own.matrix[joint * joints + other] += inertia;
        }
        self.mass.fill(0.0);
        map.add_matrix(&own.matrix, &mut self.mass, n);
        self.damping.fill(0.0);
        for (i, parameters) in self.model.joint_rows().iter().enumerate() {
            self.damping[i * n + i] = parameters[column::VISCOUS];
            if map.is_separate(i) {
                self.mass[i * n + i] += parameters[column::DRIVE_INERTIA];
            }
        }
        for gear in &self.elastic.gears {
            let (motor, link) = (gear.joint * n + gear.joint, gear.link * n + gear.link);
            let viscous = self.damping[motor];
            self.damping[motor] = (1.0 - gear.link_friction) * viscous;
            self.damping[link] = gear.link_friction * viscous;
        }
        self.place_motors()
    }

    /// Adds inertia and viscous friction of coupled motors, and computes the directions of their Coulomb friction.
    fn place_motors(&mut self) -> Result<(), SimulateError> {
        let Some(motors) = &self.model.motors else {
            return Ok(());
        };
        let (n, joints) = (self.middle.len(), self.joints.torque.len());
        let q = &self.middle[..joints];
        let (t, parameters) = (&motors.transmission, &motors.parameters);
        let matrix = &mut self.joints.matrix;
        copy_rows(&self.mass, n, matrix, joints);
        t.add_motor_inertia(parameters, q, matrix)?;
        copy_rows(matrix, joints, &mut self.mass, n);
        copy_rows(&self.damping, n, matrix, joints);
        t.add_motor_viscosity(parameters, q, matrix)?;
        copy_rows(matrix, joints, &mut self.damping, n);
        t.motor_directions(q, matrix)?;
        copy_rows(matrix, joints, &mut self.friction.along[n * n..], n);
        Ok(())
    }

    /// Computes the torques at zero acceleration without friction, with the change of the motors' ratios and torques
    /// from outside.
    fn bias(&mut self) -> Result<(), SimulateError> {
        let own = &mut self.joints;
        let map = &mut self.elastic.map;
        map.follow(self.model, &self.mean_velocity)?;
        own.acceleration.copy_from_slice(&map.convective);
        self.load_links()?;
        let own = &mut self.joints;
        self.bias.fill(0.0);
        (self.elastic.map).add_torques(1.0, &own.torque, &mut self.bias);
        if let Some(motors) = &self.model.motors
            && !motors.transmission.is_constant()
        {
            let joints = own.torque.len();
            // Accelerations of zero.
            own.torque.fill(0.0);
            motors.transmission.motor_columns(
                &self.middle[..joints],
                &self.mean_velocity[..joints],
                &own.torque,
                &mut self.columns,
            )?;
            let rows = self.columns.chunks_exact(joints * MOTOR_COLUMNS);
            for (i, row) in rows.enumerate() {
                for (k, parameters) in motors.parameters.iter().enumerate() {
                    let place = k * MOTOR_COLUMNS + motor_column::INERTIA;
                    self.bias[i] += row[place] * parameters[motor_column::INERTIA];
                }
            }
        }
        if self.elastic.is_empty() {
            return Ok(());
        }
        (self.elastic).transmit(self.model, &self.middle, &self.mean_velocity)?;
        let [of_motors, of_links] = &self.elastic.torque;
        for (bias, torque) in self.bias.iter_mut().zip(of_motors) {
            *bias += torque;
        }
        (self.elastic.map).add_torques(-1.0, of_links, &mut self.bias);
        Ok(())
    }

    /// Computes the torques that move the links at the accelerations in [`JointBuffers::acceleration`], without friction
    /// and effects, but with coupled inertia and torques from outside.
    fn load_links(&mut self) -> Result<(), SimulateError> {
        let own = &mut self.joints;
        let map = &self.elastic.map;
        let (chain, smooth) = (&self.model.chain, &self.smooth);
        inverse_dynamics(
            chain,
            smooth,
            &map.q,
            &map.v,
            &own.acceleration,
            &mut own.torque,
        )?;
        for (joint, other, inertia) in self.acting.couplings() {
            own.torque[joint] += inertia * own.acceleration[other];
        }
        for (torque, external) in own.torque.iter_mut().zip(&self.external) {
            *torque -= external;
        }
        Ok(())
    }

    /// Computes the torques of the effects in the middle of a step, and the resulting bounds of friction.
    fn effects(&mut self, torque: &[f64], dt: f64) -> Result<(), SimulateError> {
        if self.acting.is_empty() {
            return Ok(());
        }
        let n = self.middle.len();
        let map = &self.elastic.map;
        if map.any_mixed() {
            map.accelerations(&self.acceleration, &mut self.joints.acceleration);
            self.load_links()?;
        }
        for (j, load) in self.loads.iter_mut().enumerate() {
            let row = self.mass[j * n..(j + 1) * n].iter();
            let inertia: f64 = row.zip(&self.acceleration).map(|(m, a)| m * a).sum();
            let rotor = self.smooth[j][column::DRIVE_INERTIA] * self.acceleration[j];
            *load = match self.elastic.gear(j) {
                // Effects on the link, of the pass before, load stiff and elastic gears alike.
                _ if self.elastic.map.is_mixed(j) => {
                    self.joints.torque[j] + self.acting.of_links[j]
                }
                // Torque of the shaft without friction on the link's side. A law adds the torque that it transmits.
                Some(gear) => {
                    let speed = self.mean_velocity[gear.link];
                    let friction = self.model.effects.friction(j, speed, speed.sgn());
                    self.elastic.torque[1][j] - gear.link_friction * friction
                }
                None => self.bias[j] + inertia - rotor,
            };
        }
        let motion = [
            self.middle.as_slice(),
            &self.mean_velocity,
            &self.acceleration,
            torque,
        ];
        let map = &self.elastic.map;
        let links = [&map.q[..], &map.v];
        let separate = |j: usize| map.is_separate(j);
        (self.acting).evaluate(motion, links, separate, &self.loads, dt)?;
        map.add_torques(1.0, &self.acting.of_links, &mut self.acting.torque);
        for j in 0..self.loads.len() {
            self.friction.limits[j] =
                self.acting
                    .bounds(j, self.friction.coulomb[j], self.mean_velocity[j])?;
        }
        Ok(())
    }

    /// Advances positions `q` and velocities `v` (length n) by `dt` under the joint torques `torque`. With backlash or
    /// elasticity they belong to the motor; the link starts at rest behind it.
    ///
    /// `external`: torques on the links, N·m or N, length n; empty for none. A force f at a point of the arm gives Jᵀ·f.
    /// At a rigid joint they add to `torque`; behind an elastic gear they act on the link and not on the motor.
    ///
    /// # Errors
    /// [`SimulateError::Multibody`] on wrong lengths, [`SimulateError::NotPositiveDefinite`],
    /// [`SimulateError::DrivingEffects`].
    pub fn step(
        &mut self,
        q: &mut [f64],
        v: &mut [f64],
        torque: &[f64],
        external: &[f64],
        dt: f64,
    ) -> Result<(), SimulateError> {
        if !(external.is_empty() || external.len() == self.loads.len()) {
            return Err(SimulateError::Multibody(MultibodyError::WrongLength {
                argument: "external",
                expected: self.loads.len(),
                found: external.len(),
            }));
        }
        self.external.clear();
        self.external.extend_from_slice(external);
        if self.elastic.is_empty() {
            return self.advance(q, v, torque, dt);
        }
        self.put_links_at_rest(q, v)?;
        let joints = q.len();
        let [mut positions, mut speeds] = std::mem::take(&mut self.both);
        for (all, own, links) in [
            (&mut positions, &*q, &self.elastic.q),
            (&mut speeds, &*v, &self.elastic.v),
        ] {
            all.clear();
            all.extend_from_slice(own);
            all.extend_from_slice(links);
        }
        self.elastic.map.locate(self.model, &positions)?;
        let steps = self.elastic.steps(self.model, q, dt)?;
        for _ in 0..steps {
            self.advance(&mut positions, &mut speeds, torque, dt / steps as f64)
                .map_err(|e| self.with_joint(e))?;
        }
        q.copy_from_slice(&positions[..joints]);
        v.copy_from_slice(&speeds[..joints]);
        self.elastic.note(self.model, &positions, &speeds)?;
        self.both = [positions, speeds];
        Ok(())
    }

    /// Puts the links behind gears with backlash or elasticity at rest under gravity, with their motors at `q` and at
    /// the motors' velocities `v`. Does nothing if they have begun to move. The first step does the same.
    ///
    /// # Errors
    /// [`SimulateError::Multibody`] on wrong lengths.
    pub fn put_links_at_rest(&mut self, q: &[f64], v: &[f64]) -> Result<(), SimulateError> {
        if self.elastic.is_empty() || self.elastic.moving {
            return Ok(());
        }
        self.elastic.put_at_rest(self.model, q, v)
    }

    /// Returns position and velocity of the link of a joint (from 0) if it may be elsewhere than its motor and has a
    /// state: after the first step, or after [`Self::put_links_at_rest`].
    pub fn link(&self, joint: usize) -> Option<[f64; 2]> {
        let Elastic { map, moving, .. } = &self.elastic;
        let known = *moving && joint < map.q.len() && map.is_separate(joint);
        known.then(|| [map.q[joint], map.v[joint]])
    }

    /// Returns the error with the number of a joint instead of a coordinate.
    fn with_joint(&self, error: SimulateError) -> SimulateError {
        let SimulateError::NotPositiveDefinite { joint } = error else {
            return error;
        };
        let behind = (joint - 1).checked_sub(self.loads.len());
        let gear = behind.and_then(|k| self.elastic.gears.get(k));
        SimulateError::NotPositiveDefinite {
            joint: gear.map_or(joint, |gear| gear.joint + 1),
        }
    }

    fn advance(
        &mut self,
        q: &mut [f64],
        v: &mut [f64],
        torque: &[f64],
        dt: f64,
    ) -> Result<(), SimulateError> {
        let n = q.len();
        for i in 0..n {
            self.middle[i] = q[i] + 0.5 * dt * v[i];
        }
        self.place()?;
        // Viscous friction acts on the mean velocity of the step: half of it multiplies the unknown velocity.
        for (entry, (mass, damping)) in self
            .factor
            .iter_mut()
            .zip(self.mass.iter().zip(&self.damping))
        {
            *entry = mass + 0.5 * dt * damping;
        }
        if self.acting.couplings().next().is_some() {
            invert_any(&mut self.factor, &mut self.inverse, n)?;
        } else {
            invert(&mut self.factor, &mut self.inverse, n)?;
        }
        self.friction.respond(&self.inverse, self.free.len());
        self.mean_velocity.copy_from_slice(v);
        let passes = if self.acting.is_empty() {
            PASSES
        } else {
            PASSES_WITH_EFFECTS
        };
        for _ in 0..passes {
            self.bias()?;
            self.effects(torque, dt)?;
            for i in 0..n {
                let own = self.model.joint_rows().get(i);
                let offset = own.map_or(0.0, |own| own[column::OFFSET]) + self.acting.torque[i];
                let drive = torque.get(i).copied().unwrap_or(0.0);
                let row = i * n..(i + 1) * n;
                let drag: f64 = self.damping[row.clone()]
                    .iter()
                    .zip(&*v)
                    .map(|(d, v)| d * v)
                    .sum();
                let driving = drive - self.bias[i] - offset - 0.5 * drag;
                let momentum: f64 = self.mass[row].iter().zip(&*v).map(|(m, v)| m * v).sum();
                self.next[i] = momentum + dt * driving;
            }
            for i in 0..n {
                self.free[i] = (0..n).map(|k| self.inverse[i * n + k] * self.next[k]).sum();
            }
            self.friction.solve(&self.free, dt, &mut self.next);
            for i in 0..n {
                self.mean_velocity[i] = 0.5 * (v[i] + self.next[i]);
                self.acceleration[i] = (self.next[i] - v[i]) / dt;
            }
        }
        if !self.acting.is_empty() {
            let motion = [
                self.middle.as_slice(),
                &self.mean_velocity,
                &self.acceleration,
                torque,
            ];
            let map = &mut self.elastic.map;
            map.follow(self.model, &self.mean_velocity)?;
            self.acting.advance(motion, [&map.q, &map.v], dt);
        }
        for i in 0..n {
            q[i] = self.middle[i] + 0.5 * dt * self.next[i];
            v[i] = self.next[i];
        }
        Ok(())
    }
}

/// Copies the first rows and columns of a matrix with rows of `width` into one with rows of `to_width`.
fn copy_rows(from: &[f64], width: usize, to: &mut [f64], to_width: usize) {
    let columns = width.min(to_width);
    for (from, to) in from.chunks_exact(width).zip(to.chunks_exact_mut(to_width)) {
        to[..columns].copy_from_slice(&from[..columns]);
    }
}

/// Returns the parameters without friction and offset, and without the drives' inertia if the link may be elsewhere than
/// its motor.
///
/// # Errors
/// [`SimulateError::NegativeFriction`].
fn without_friction(
    model: &Model,
    elastic: &Elastic,
) -> Result<Vec<[f64; COLUMNS]>, SimulateError> {
    let mut smooth = model.parameters.clone();
    for (joint, row) in smooth.iter_mut().take(model.joint_count()).enumerate() {
        for (place, name) in [(column::VISCOUS, "fv"), (column::COULOMB, "fc")] {
            refuse_negative(name, joint, row[place])?;
        }
        row[column::VISCOUS] = 0.0;
        row[column::COULOMB] = 0.0;
        row[column::OFFSET] = 0.0;
        if elastic.map.is_separate(joint) {
            row[column::DRIVE_INERTIA] = 0.0;
        }
    }
    Ok(smooth)
}

/// Returns the Coulomb friction of the coordinates, then of the motors of coupled drives. An elastic gear divides its
/// joint's between motor and link.
///
/// # Errors
/// [`SimulateError::NegativeFriction`].
fn coulomb(model: &Model, elastic: &Elastic) -> Result<Vec<f64>, SimulateError> {
    let mut coulomb: Vec<f64> = model
        .joint_rows()
        .iter()
        .map(|p| p[column::COULOMB])
        .collect();
    for gear in &elastic.gears {
        let whole = coulomb[gear.joint];
        coulomb[gear.joint] = (1.0 - gear.link_friction) * whole;
        coulomb.push(gear.link_friction * whole);
    }
    if let Some(motors) = &model.motors {
        let names = [
            (motor_column::VISCOUS, "fvm"),
            (motor_column::COULOMB, "fcm"),
        ];
        for (k, row) in motors.parameters.iter().enumerate() {
            for (place, name) in names {
                refuse_negative(name, k, row[place])?;
            }
            coulomb.push(row[motor_column::COULOMB]);
        }
    }
    Ok(coulomb)
}

/// Refuses friction below zero of joint or motor `k` (from 0), and NaN.
fn refuse_negative(name: &str, k: usize, value: f64) -> Result<(), SimulateError> {
    if value.is_nan() || value < 0.0 {
        return Err(SimulateError::NegativeFriction {
            parameter: format!("{name}{}", k + 1),
            value,
        });
    }
    Ok(())
}
