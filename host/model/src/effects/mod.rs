//! The effects of a description, placed on its joints, and their action on a motion and a recording.
//!
//! [`rig_shared::effects`] has the equations. This module supplies their inputs from the robot: motor angles, gear load
//! and the motion of the other joint. A payload is not a torque but a point mass on its link.
//!
//! Leaves out effects on the voltage, and effects between motor and link. [`crate::simulate`] models the latter with a
//! second mass; a recording cannot be compensated for them.

use std::f64::consts::PI;

use rig_shared::dual::Dual;
use rig_shared::effects::{Channel, Instant, Kind, Memory, Periodic, SHAPES};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::scalar::Real as _;
use rig_shared::transmission::{Transmission, TransmissionError};

use crate::robot::{Placed, Robot};

/// The effects of one robot.
#[derive(Clone, Debug)]
pub struct Effects {
    placed: Vec<Placed>,
    /// Titles for messages.
    titles: Vec<String>,
    transmission: Transmission<f64>,
    /// Parameters of links and drives, without payloads: from the description, or from a model.
    standard: Vec<[f64; COLUMNS]>,
    /// Payloads, one row a joint.
    loads: Vec<[f64; COLUMNS]>,
}

/// State of all joints at one instant, joint by joint.
#[derive(Clone, Copy, Debug)]
pub struct State<'a> {
    /// Positions, rad or m.
    pub q: &'a [f64],
    /// Velocities, rad/s or m/s.
    pub qd: &'a [f64],
    /// Accelerations, rad/s² or m/s².
    pub qdd: &'a [f64],
    /// Angles of the motors.
    pub motor: &'a [f64],
    /// Torques from the motor currents, N·m or N.
    pub drive: &'a [f64],
    /// Time, s.
    pub time: f64,
    /// Temperature rise, K.
    pub warming: &'a [f64],
    /// Sample period, s.
    pub period: f64,
}

/// Order in which a joint's effects are computed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Contact deflection, which other friction depends on.
    Presliding,
    /// Effects on the link, which are part of the load.
    Others,
    /// Friction that depends on the load.
    LoadFriction,
}

impl Turn {
    /// All, in the order of computation.
    pub const ALL: [Self; 3] = [Self::Presliding, Self::Others, Self::LoadFriction];

    /// Returns the turn in which an effect acts.
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::LoadFriction => Self::LoadFriction,
            _ if kind.is_presliding() => Self::Presliding,
            _ => Self::Others,
        }
    }
}

/// Returns the ratio of the friction of effects to the joint's own Coulomb friction, 1; zero without Coulomb friction.
pub fn over_coulomb(friction: f64, coulomb: f64) -> f64 {
    if coulomb > 0.0 {
        friction / coulomb
    } else {
        0.0
    }
}

/// Returns true if the effect is a joint torque that its law gives along a motion.
pub fn is_torque(kind: Kind) -> bool {
    kind.about().channel == Channel::Torque || kind == Kind::GravityTilt
}

/// Returns true if the motor's angle passes more than half a wave between two samples. The true mean effect is then
/// almost zero, but sampling turns it into a false slow wave (aliasing).
pub fn outruns(kind: Kind, shapes: &[f64; SHAPES], motor_velocity: f64, period: f64) -> bool {
    let about = kind.about();
    let of_the_motor = matches!(
        kind.periodic(),
        Some(Periodic::Motor | Periodic::MotorTimesDrive)
    );
    of_the_motor
        && about.channel == Channel::Torque
        && (shapes[0] * motor_velocity * period).abs() > PI
}

impl Effects {
    /// Returns the effects of a description.
    ///
    /// # Errors
    /// [`TransmissionError`] on drives that do not form a transmission.
    pub fn of(robot: &Robot) -> Result<Self, TransmissionError> {
        let placed = robot.placed_effects();
        let titles = robot
            .effects
            .iter()
            .zip(&placed)
            .map(|(effect, p)| {
                let joint = &robot.joints[p.joint].name;
                format!("{} of joint {joint}", effect.title())
            })
            .collect();
        let mut loads = vec![[0.0; COLUMNS]; robot.joints.len()];
        for p in placed.iter().filter(|p| p.effect.kind == Kind::Payload) {
            let (mass, arm) = (p.effect.gains[0], p.effect.shapes[0]);
            let row = &mut loads[p.joint];
            row[column::MASS] += mass;
            row[column::FIRST_MOMENT] += mass * arm;
            // Iyy and Izz of a point on x.
            row[column::INERTIA + 3] += mass * arm * arm;
            row[column::INERTIA + 5] += mass * arm * arm;
        }
        Ok(Self {
            placed,
            titles,
            transmission: robot.transmission()?,
            standard: robot.standard_parameters(),
            loads,
        })
    }

    /// Returns the same effects with parameters other than the description's, one row a joint.
    pub fn beside(mut self, parameters: &[[f64; COLUMNS]]) -> Self {
        self.standard = parameters.to_vec();
        self
    }

    /// Returns true if there are no effects.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Returns the parameters that payloads add, one row a joint.
    #[must_use]
    pub fn loads(&self) -> &[[f64; COLUMNS]] {
        &self.loads
    }

    /// Returns the motor coordinates of the robot.
    #[must_use]
    pub fn transmission(&self) -> &Transmission<f64> {
        &self.transmission
    }

    /// Returns the parameters of links and drives without payloads, one row a joint.
    #[must_use]
    pub fn standard(&self) -> &[[f64; COLUMNS]] {
        &self.standard
    }

    /// Returns all effects.
    pub fn placed(&self) -> &[Placed] {
        &self.placed
    }

    /// Adds the payloads to parameters, one row a joint.
    pub fn add_loads(&self, rows: &mut [[f64; COLUMNS]]) {
        for (to, from) in rows.iter_mut().zip(&self.loads) {
            for (a, b) in to.iter_mut().zip(from) {
                *a += b;
            }
        }
    }

    /// Computes the motor angles at joint positions `q`.
    pub fn motor_angles(&self, q: &[f64], out: &mut [f64]) -> Result<(), TransmissionError> {
        self.transmission.motor_position(q, out)
    }

    /// Returns Coulomb and viscous friction of a joint for a velocity and a direction, N·m.
    pub fn friction(&self, joint: usize, velocity: f64, direction: f64) -> f64 {
        let row = &self.standard[joint];
        row[column::COULOMB] * direction + row[column::VISCOUS] * velocity
    }

    /// Returns the friction of effects over the joint's own, 1. The contact deflects further by this share.
    pub fn over_coulomb(&self, joint: usize, friction: f64) -> f64 {
        over_coulomb(friction, self.friction(joint, 0.0, 1.0))
    }

    /// Returns the inputs of the law of effect `k`, without load and direction. Friction is in the velocity's
    /// direction; the travel since the last instant is that of a constant velocity.
    pub fn instant(&self, k: usize, at: &State<'_>) -> Instant<f64> {
        let Placed { joint, other, .. } = self.placed[k];
        Instant {
            position: at.q[joint],
            velocity: at.qd[joint],
            acceleration: at.qdd[joint],
            direction: 0.0,
            motor_angle: at.motor[joint],
            drive_torque: at.drive[joint],
            friction: self.friction(joint, at.qd[joint], at.qd[joint].sgn()),
            time: at.time,
            temperature_rise: at.warming.get(joint).copied().unwrap_or(0.0),
            other: other.map_or([0.0; 3], |o| [at.q[o], at.qd[o], at.qdd[o]]),
            period: at.period,
            travel: at.qd[joint] * at.period,
            ..Instant::default()
        }
    }

    /// Computes the errors of the position sensors, and their rates of change.
    pub fn position_errors(
        &self,
        q: &[f64],
        qd: &[f64],
        out: &mut [[f64; 2]],
    ) -> Result<(), TransmissionError> {
        out.fill([0.0; 2]);
        if !self.any(Channel::Position) {
            return Ok(());
        }
        let (mut psi, mut psid) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        self.transmission.motor_position(q, &mut psi)?;
        self.transmission.motor_velocity(q, qd, &mut psid)?;
        let moving = |value: f64, derivative: f64| Dual {
            value,
            derivative: [derivative],
        };
        for p in self.of_channel(Channel::Position) {
            let at = Instant {
                position: moving(q[p.joint], qd[p.joint]),
                motor_angle: moving(psi[p.joint], psid[p.joint]),
                ..Instant::<Dual<f64, 1>>::default()
            };
            let shapes = p.effect.shapes.map(Dual::constant);
            let mut none = Memory::default();
            let terms = p.effect.kind.terms(&shapes, &mut none.0, &at);
            for (gain, term) in p.effect.gains.iter().zip(terms) {
                out[p.joint][0] += gain * term.value;
                out[p.joint][1] += gain * term.derivative[0];
            }
        }
        Ok(())
    }

    /// Turns the true torque of a joint, at instants `period` apart, into its sensor reading. The reading is delayed
    /// (linear interpolation; the first value holds before the first) and has an offset.
    pub fn read_effort(&self, joint: usize, torque: &mut Vec<f64>, period: f64) {
        let (delay, offset) = self.effort(joint);
        if delay != 0.0 {
            *torque = shifted(torque, -delay / period);
        }
        if offset != 0.0 {
            for value in torque {
                *value += offset;
            }
        }
    }

    /// Returns the true torque of a joint for a sensor `reading`, at the same instants: the inverse of
    /// [`Self::read_effort`]. The last value holds.
    pub fn applied_effort(&self, joint: usize, reading: &[f64], period: f64) -> Vec<f64> {
        let (delay, offset) = self.effort(joint);
        let mut torque = shifted(reading, delay / period);
        for value in &mut torque {
            *value -= offset;
        }
        torque
    }

    /// Returns delay, s, and offset, N·m or N, of a joint's torque reading.
    pub fn effort(&self, joint: usize) -> (f64, f64) {
        let sum = |kind| {
            let of = self.of_channel(Channel::Effort);
            of.filter(|p| p.joint == joint && p.effect.kind == kind)
                .map(|p| p.effect.gains[0])
                .sum()
        };
        (sum(Kind::MeasurementDelay), sum(Kind::CurrentOffset))
    }

    fn of_channel(&self, channel: Channel) -> impl Iterator<Item = &Placed> {
        let of = move |p: &&Placed| p.effect.kind.about().channel == channel;
        self.placed.iter().filter(of)
    }

    fn any(&self, channel: Channel) -> bool {
        self.of_channel(channel).next().is_some()
    }

    /// Returns `title of joint name` of the effects that `which` selects, joined; `None` if it selects none.
    pub fn named(&self, which: impl Fn(Kind) -> bool) -> Option<String> {
        self.listed(|p| which(p.effect.kind))
    }

    /// Same as [`Self::named`], of one joint (from 0).
    pub fn named_at(&self, joint: usize, which: impl Fn(Kind) -> bool) -> Option<String> {
        self.listed(|p| p.joint == joint && which(p.effect.kind))
    }

    fn listed(&self, which: impl Fn(&Placed) -> bool) -> Option<String> {
        let names: Vec<&str> = self
            .placed
            .iter()
            .zip(&self.titles)
            .filter(|(p, _)| which(p))
            .map(|(_, title)| title.as_str())
            .collect();
        (!names.is_empty()).then(|| names.join(", "))
    }

    /// Returns sentences on the effects that a simulated motion does not show.
    pub fn unsimulated(&self) -> Vec<String> {
        let voltage = self
            .named(|k| k.about().channel == Channel::Voltage)
            .map(|names| {
                format!(
                    "{names}: acts on the voltage, which is not simulated; it does nothing here."
                )
            });
        let warm = self
            .named(|k| k == Kind::ViscousWarmupTemperature)
            .map(|names| {
                format!(
                    "{names}: the temperature is not simulated and stays what it was at the start."
                )
            });
        voltage.into_iter().chain(warm).collect()
    }

    /// Returns sentences on the effects compensated in a recording, and on those that were not.
    pub fn uncompensated(&self) -> [Option<String>; 2] {
        let stays = |k: Kind| matches!(k.about().channel, Channel::Voltage | Channel::Transmission);
        [
            self.named(|k| !stays(k)).map(|names| {
                format!("What the description states of these was taken off the measured motion and torque before anything else: {names}.")
            }),
            self.named(stays).map(|names| {
                format!("{names}: acts on the voltage or between motor and link, which a torque for a given motion does not show; not part of this.")
            }),
        ]
    }
}

/// Returns a series advanced by `rows` rows (later values come forward), by linear interpolation; the end values hold.
pub fn shifted(series: &[f64], rows: f64) -> Vec<f64> {
    let last = series.len().saturating_sub(1) as f64;
    (0..series.len())
        .map(|k| {
            let at = (k as f64 + rows).clamp(0.0, last);
            let (below, part) = (at.floor() as usize, at.fract());
            let above = (below + 1).min(series.len() - 1);
            series[below] + part * (series[above] - series[below])
        })
        .collect()
}
