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
//! or elasticity the motor is a separate mass, and the steps are short enough for the gear.
//!
//! Leaves out end stops, temperatures and the electrical side.

use rig_shared::multibody::{COLUMNS, bias_torque, column, inertia_matrix};
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

/// Steps a model. Owns every buffer, so that a step allocates nothing.
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
    elastic: Option<Elastic>,
    acceleration: Vec<f64>,
    /// Loads of the links on the gears.
    loads: Vec<f64>,
    /// Columns of the motors at zero acceleration.
    columns: Vec<f64>,
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
        let joints = model.parameters.len();
        let elastic = Elastic::of(model)?;
        // The motor, then the link.
        let n = joints + usize::from(elastic.is_some());
        let smooth = without_friction(model, elastic.is_some())?;
        let coulomb = coulomb(model, elastic.as_ref())?;
        let columns = match &model.motors {
            Some(_) => vec![0.0; n * n * MOTOR_COLUMNS],
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
            acting: Acting::new(&model.effects, joints, elastic.map(|_| joints)),
            elastic,
            acceleration: vec![0.0; n],
            loads: vec![0.0; joints],
            columns,
        };
        refuse_driving_friction(model, joints)?;
        Ok(stepper)
    }

    /// Computes the position-dependent terms in the middle of the step: inertia, damping and directions of friction.
    fn place(&mut self) -> Result<(), SimulateError> {
        let n = self.middle.len();
        self.damping.fill(0.0);
        for (i, own) in self.model.parameters.iter().enumerate() {
            self.damping[i * n + i] = own[column::VISCOUS];
        }
        if let Some(elastic) = &self.elastic {
            let (rotor, link) = self.mass.split_at_mut(3);
            rotor.copy_from_slice(&[elastic.rotor, 0.0, 0.0]);
            let viscous = self.damping[0];
            self.damping[0] = (1.0 - elastic.link_friction) * viscous;
            self.damping[3] = elastic.link_friction * viscous;
            inertia_matrix(&self.model.chain, &self.smooth, &self.middle[1..], link)?;
            return Ok(());
        }
        inertia_matrix(
            &self.model.chain,
            &self.smooth,
            &self.middle,
            &mut self.mass,
        )?;
        for (joint, other, inertia) in self.acting.couplings() {
            self.mass[joint * n + other] += inertia;
        }
        if let Some(motors) = &self.model.motors {
            let t = &motors.transmission;
            t.add_motor_inertia(&motors.parameters, &self.middle, &mut self.mass)?;
            t.add_motor_viscosity(&motors.parameters, &self.middle, &mut self.damping)?;
            t.motor_directions(&self.middle, &mut self.friction.along[n * n..])?;
        }
        Ok(())
    }

    /// Computes the torques at zero acceleration without friction, with the change of the motors' ratios.
    fn bias(&mut self) -> Result<(), SimulateError> {
        if let Some(elastic) = &self.elastic {
            let torque = elastic.torque(&self.middle, &self.mean_velocity);
            bias_torque(
                &self.model.chain,
                &self.smooth,
                &self.middle[1..],
                &self.mean_velocity[1..],
                &mut self.bias[1..],
            )?;
            self.bias[0] = torque;
            self.bias[1] -= torque;
            return Ok(());
        }
        bias_torque(
            &self.model.chain,
            &self.smooth,
            &self.middle,
            &self.mean_velocity,
            &mut self.bias,
        )?;
        if let Some(motors) = &self.model.motors
            && !motors.transmission.is_constant()
        {
            let n = self.bias.len();
            // Accelerations of zero; `free` gets its values after this.
            self.free.fill(0.0);
            motors.transmission.motor_columns(
                &self.middle,
                &self.mean_velocity,
                &self.free,
                &mut self.columns,
            )?;
            for (i, row) in self.columns.chunks_exact(n * MOTOR_COLUMNS).enumerate() {
                for (k, parameters) in motors.parameters.iter().enumerate() {
                    let place = k * MOTOR_COLUMNS + motor_column::INERTIA;
                    self.bias[i] += row[place] * parameters[motor_column::INERTIA];
                }
            }
        }
        Ok(())
    }

    /// Computes the torques of the effects in the middle of a step, and the resulting bounds of friction.
    fn effects(&mut self, torque: &[f64], dt: f64) -> Result<(), SimulateError> {
        if self.acting.is_empty() {
            return Ok(());
        }
        let n = self.middle.len();
        for (j, load) in self.loads.iter_mut().enumerate() {
            let row = self.mass[j * n..(j + 1) * n].iter();
            let inertia: f64 = row.zip(&self.acceleration).map(|(m, a)| m * a).sum();
            let rotor = self.smooth[j][column::DRIVE_INERTIA] * self.acceleration[j];
            *load = match self.elastic {
                // Torque of the shaft without friction on the link's side. A law adds the torque that it transmits.
                Some(elastic) => {
                    let speed = self.mean_velocity[1];
                    let friction = self.model.effects.friction(j, speed, speed.sgn());
                    self.bias[0] - elastic.link_friction * friction
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
        self.acting.evaluate(motion, &self.loads, dt)?;
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
    /// # Errors
    /// [`SimulateError::Multibody`] if the inertia matrix is not positive definite, [`SimulateError::DrivingEffects`].
    pub fn step(
        &mut self,
        q: &mut [f64],
        v: &mut [f64],
        torque: &[f64],
        dt: f64,
    ) -> Result<(), SimulateError> {
        let Some(elastic) = self.elastic else {
            return self.advance(q, v, torque, dt);
        };
        let [at, speed] = match elastic.link {
            Some(link) => link,
            None => [elastic.at_rest(self.model, q[0])?, v[0]],
        };
        let (mut both, mut speeds) = ([q[0], at], [v[0], speed]);
        let steps = elastic.steps(dt);
        for _ in 0..steps {
            self.advance(&mut both, &mut speeds, torque, dt / steps as f64)?;
        }
        (q[0], v[0]) = (both[0], speeds[0]);
        if let Some(elastic) = &mut self.elastic {
            elastic.link = Some([both[1], speeds[1]]);
        }
        Ok(())
    }

    /// Returns position and velocity of the link if it is a separate mass and has begun to move.
    pub fn link(&self) -> Option<[f64; 2]> {
        self.elastic.and_then(|e| e.link)
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
                let own = self.model.parameters.get(i);
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
            self.acting.advance(motion, dt);
        }
        for i in 0..n {
            q[i] = self.middle[i] + 0.5 * dt * self.next[i];
            v[i] = self.next[i];
        }
        Ok(())
    }
}

/// Returns the parameters without friction and offset, and without the drives' inertia if the gear is elastic.
///
/// # Errors
/// [`SimulateError::NegativeFriction`].
fn without_friction(model: &Model, elastic: bool) -> Result<Vec<[f64; COLUMNS]>, SimulateError> {
    let mut smooth = model.parameters.clone();
    for (joint, row) in smooth.iter_mut().enumerate() {
        for (place, name) in [(column::VISCOUS, "fv"), (column::COULOMB, "fc")] {
            refuse_negative(name, joint, row[place])?;
        }
        row[column::VISCOUS] = 0.0;
        row[column::COULOMB] = 0.0;
        row[column::OFFSET] = 0.0;
        if elastic {
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
fn coulomb(model: &Model, elastic: Option<&Elastic>) -> Result<Vec<f64>, SimulateError> {
    let mut coulomb: Vec<f64> = model
        .parameters
        .iter()
        .map(|p| p[column::COULOMB])
        .collect();
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
    if let Some(elastic) = elastic {
        let whole = coulomb[0];
        coulomb[0] = (1.0 - elastic.link_friction) * whole;
        coulomb.push(elastic.link_friction * whole);
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
