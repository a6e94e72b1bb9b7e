//! One step of a voltage-driven joint.

use rig_shared::effects::{Channel, Direction, Effect, Instant, Kind, Memory};
use rig_shared::scalar::Real as _;

use crate::voltage::halt::Halt;
use crate::voltage::log::{Log, Segment};
use crate::voltage::plant::{NOMINAL, Plant};
use rig_model::effects::over_coulomb;
use rig_model::robot::Demand;

/// State of a simulated joint at a row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct State {
    /// rad or m
    pub(crate) position: f64,
    /// rad/s or m/s
    pub(crate) velocity: f64,
    /// Voltage at the motor, V.
    pub(crate) voltage: f64,
    /// Supply at that voltage, V; 1 if the recorded voltage drives.
    pub(crate) supply: f64,
}

/// Place of an effect in a step.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Reduces the voltage.
    Voltage,
    /// A torque for any direction of motion.
    Torque,
    /// Dry friction.
    Dry,
    /// Dry friction through the contact of presliding, if any.
    Contact,
}

/// An effect with its parameters and its memory.
struct Part {
    effect: Effect<f64>,
    memory: Memory<f64>,
    role: Role,
    /// True if its hidden state must be advanced.
    remembers: bool,
}

/// Returns effects with their parameters, which follow the nominal ones in a fit's list.
fn parts(effects: &[Kind], theta: &[f64]) -> Vec<Part> {
    let mut at = NOMINAL;
    let mut take = move |count: usize| {
        at += count;
        &theta[at - count..at]
    };
    let presliding = effects.iter().any(|kind| kind.is_presliding());
    (effects.iter())
        .map(|kind| {
            let about = kind.about();
            let (gains, shapes) = (take(about.gains.len()), take(about.shapes.len()));
            Part {
                effect: Effect::new(*kind, gains, shapes),
                memory: Memory::default(),
                role: match (about.channel, about.direction) {
                    (Channel::Voltage, _) => Role::Voltage,
                    (_, Direction::Indifferent) => Role::Torque,
                    _ if presliding && kind.acts_through_contact() => Role::Contact,
                    _ => Role::Dry,
                },
                remembers: kind.is_presliding() || kind.is_viscous_warmup(),
            }
        })
        .collect()
}

impl Part {
    fn torque(&self, at: &Instant<f64>) -> f64 {
        self.effect.torque(&mut self.memory.clone(), at)
    }

    /// Returns the deflection of the presliding contact.
    fn bent(&self, at: &Instant<f64>) -> f64 {
        let mut memory = self.memory;
        self.effect.torque(&mut memory, at);
        self.effect
            .contact_deflection(&memory, at.extra_friction_ratio)
    }
}

/// Torques of one step without back-EMF and viscous friction.
struct Torques {
    /// Torque of drive, gravity and effects, N·m.
    torque: f64,
    /// Bounds of dry friction at rest, N·m.
    dry: [f64; 2],
}

/// A joint in motion.
pub(crate) struct Stepper<'a> {
    plant: &'a Plant,
    armature: f64,
    gain: f64,
    emf: f64,
    coulomb: f64,
    viscous: f64,
    offset: f64,
    /// Delay of a voltage after its row, s.
    late: f64,
    parts: Vec<Part>,
    /// Index of the presliding effect, if any.
    contact: Option<usize>,
    q: f64,
    v: f64,
    acceleration: f64,
    drive_torque: f64,
    /// Integral of the position error, rad·s or m·s.
    integral: f64,
    /// Recording row of the last lookup.
    row: usize,
}

impl<'a> Stepper<'a> {
    /// Builds a stepper with nominal parameters and those of the effects; `None` if parameters are missing.
    pub(crate) fn new(plant: &'a Plant, effects: &[Kind], theta: &[f64]) -> Option<Self> {
        let &[armature, gain, emf, coulomb, viscous, offset, ..] = theta else {
            return None;
        };
        let mut parts = parts(effects, theta);
        let late: f64 = (parts.iter())
            .filter(|p| p.effect.kind == Kind::MeasurementDelay)
            .map(|p| p.effect.gains[0])
            .sum();
        parts.retain(|p| p.effect.kind != Kind::MeasurementDelay);
        Some(Self {
            plant,
            armature,
            gain,
            emf,
            coulomb,
            viscous,
            offset,
            late,
            contact: parts.iter().position(|p| p.effect.kind.is_presliding()),
            parts,
            q: 0.0,
            v: 0.0,
            acceleration: 0.0,
            drive_torque: 0.0,
            integral: 0.0,
            row: 0,
        })
    }

    /// Starts at the first row of a segment.
    pub(crate) fn start(&mut self, log: &Log, segment: &Segment) {
        self.row = segment.from;
        (self.q, self.v) = (log.q[segment.from], segment.velocity);
        self.integral = log.integral.get(segment.from).copied().unwrap_or(0.0);
    }

    /// Returns the angular frequency of the closed loop without friction, or its damping rate if that is faster, 1/s; 0
    /// if the recorded voltage drives.
    pub(crate) fn fastest(&self, log: &Log) -> f64 {
        let Some(law) = &log.law else { return 0.0 };
        let per_share = self.gain * law.supply[0].abs() / (self.plant.inertia + self.armature);
        let stiffness = per_share * law.proportional;
        stiffness.sqrt().max(per_share * law.derivative.abs())
    }

    /// Returns true if position and velocity are within ± `most`.
    pub(crate) fn is_within(&self, most: f64) -> bool {
        self.q.abs() < most && self.v.abs() < most
    }

    /// Returns the state at row `k`.
    pub(crate) fn state(&mut self, log: &Log, k: usize) -> State {
        let voltage = match log.on[k] {
            true => self.voltage(log, log.t[k], [self.q, self.v], 0.0),
            false => 0.0,
        };
        State {
            position: self.q,
            velocity: self.v,
            voltage,
            supply: log.law.map_or(1.0, |law| law.supply_at(voltage)),
        }
    }

    /// Returns the controller's voltage at a state, or the recorded one; integrates the position error over `dt`.
    fn voltage(&mut self, log: &Log, now: f64, [q, v]: [f64; 2], dt: f64) -> f64 {
        let Some(law) = &log.law else {
            let (k, share) = self.place(log, now + self.late);
            return between(&log.u, k, share);
        };
        let (k, share) = self.place(log, now);
        let fed = |gain: f64, column: &[f64]| match gain != 0.0 {
            true => between(column, k, share),
            false => 0.0,
        };
        let demand = Demand {
            error: between(&log.reference, k, share) - q,
            integral: self.integral,
            velocity: v,
            reference_velocity: fed(law.velocity_feedforward, &log.reference_velocity),
            reference_acceleration: fed(law.acceleration_feedforward, &log.reference_acceleration),
        };
        let wish = law.unlimited_share(&demand);
        self.integral += law.integrated(wish, demand.error, dt);
        law.voltage(wish)
    }

    /// Returns the row before a time and the elapsed share of its interval: linear between rows with one drive state,
    /// held at a change.
    fn place(&mut self, log: &Log, time: f64) -> (usize, f64) {
        while self.row + 1 < log.t.len() && log.t[self.row + 1] <= time {
            self.row += 1;
        }
        while self.row > 0 && log.t[self.row] > time {
            self.row -= 1;
        }
        let (k, next) = (self.row, self.row + 1);
        if next >= log.t.len() || log.on[k] != log.on[next] {
            return (k, 0.0);
        }
        let share = (time - log.t[k]) / (log.t[next] - log.t[k]);
        (k, share.clamp(0.0, 1.0))
    }

    /// Returns the velocity in the middle of a step of `dt`, never beyond a reversal.
    fn middle_velocity(&self, dt: f64) -> f64 {
        let middle = self.v + 0.5 * dt * self.acceleration;
        if middle * self.v > 0.0 { middle } else { 0.0 }
    }

    /// Takes one step of `dt` after row `row`, its middle at `now`.
    ///
    /// # Errors
    /// [`Halt`] if friction would drive the joint.
    pub(crate) fn step(&mut self, log: &Log, row: usize, now: f64, dt: f64) -> Result<(), Halt> {
        let on = log.on[row];
        let middle = self.q + 0.5 * dt * self.v;
        let speed = self.middle_velocity(dt);
        let voltage = match on {
            true => self.voltage(log, now, [middle, speed], dt),
            false => 0.0,
        };
        let (sin, cos) = middle.sin_cos();
        let wave = |c: &[f64; 3]| c[0] * cos + c[1] * sin + c[2];
        let mut at = Instant {
            position: middle,
            velocity: speed,
            acceleration: self.acceleration,
            motor_angle: self.plant.ratio * middle,
            gravity: wave(&self.plant.per_moment),
            time: now,
            period: dt,
            travel: speed * dt,
            ..Instant::default()
        };
        let weight = wave(&self.plant.gravity);
        let braking = self.viscous + if on { self.gain * self.emf } else { 0.0 };
        let drive = if on {
            self.drive(voltage, &mut at)
        } else {
            0.0
        };
        at.drive_rate = (at.drive_torque - self.drive_torque) / dt;
        self.drive_torque = at.drive_torque;
        at.load = self.plant.inertia * self.acceleration + weight;
        at.friction = self.sliding(speed);
        let Torques { torque, dry } = self.torques(drive - weight - self.offset, &mut at);
        let [low, high] = dry;
        if low.is_nan() || high.is_nan() || low > high {
            return Err(Halt::driving(now));
        }
        let inertia = self.plant.inertia + self.armature;
        let half = 0.5 * dt * braking;
        let stop = (inertia - half) * self.v / dt + torque;
        let next = dt * (stop - stop.clamp(low, high)) / (inertia + half);
        self.acceleration = (next - self.v) / dt;
        self.q += 0.5 * dt * (self.v + next);
        self.v = next;
        at.velocity = next;
        at.travel = next * dt;
        at.direction = next.sgn();
        at.friction = self.sliding(next);
        for part in self.parts.iter_mut().filter(|part| part.remembers) {
            part.effect.torque(&mut part.memory, &at);
        }
        Ok(())
    }

    /// Returns Coulomb and viscous friction at a velocity, N·m.
    fn sliding(&self, v: f64) -> f64 {
        self.viscous * v + self.coulomb * v.sgn()
    }

    /// Returns the torque of the voltage without the back-EMF; sets the drive torque, N·m.
    fn drive(&self, voltage: f64, at: &mut Instant<f64>) -> f64 {
        let back = self.emf * at.velocity;
        let net = voltage - back;
        at.drive_torque = self.gain * net;
        let lost: f64 = (self.parts.iter())
            .filter(|part| part.role == Role::Voltage)
            .map(|part| part.torque(at))
            .sum();
        // The loss stops the current but does not reverse it.
        let effective = voltage - lost.abs().min(net.abs()) * net.signum();
        at.drive_torque = self.gain * (effective - back);
        self.gain * effective
    }

    /// Adds the effects to a torque and to the Coulomb friction.
    fn torques(&self, mut torque: f64, at: &mut Instant<f64>) -> Torques {
        let [mut low, mut high] = [-self.coulomb, self.coulomb];
        let bent = self.contact.map_or(0.0, |k| self.parts[k].bent(at));
        let mut through = 0.0;
        for part in &self.parts {
            let towards = |direction: f64, bent: f64| {
                part.torque(&Instant {
                    direction,
                    friction: self.viscous * at.velocity + self.coulomb * bent,
                    ..*at
                })
            };
            match part.role {
                Role::Voltage => {}
                Role::Torque => torque -= part.torque(at),
                Role::Contact => {
                    let whole = towards(1.0, bent);
                    [low, high] = [low + whole * bent, high + whole * bent];
                    through += whole;
                }
                Role::Dry => [low, high] = [low + towards(-1.0, -1.0), high + towards(1.0, 1.0)],
            }
        }
        at.extra_friction_ratio = over_coulomb(through, self.coulomb);
        Torques {
            torque,
            dry: [low, high],
        }
    }
}

/// Interpolates a column between row `k` and the next.
fn between(column: &[f64], k: usize, share: f64) -> f64 {
    let now = column[k];
    match column.get(k + 1) {
        Some(next) if share > 0.0 => now + share * (next - now),
        _ => now,
    }
}
