//! One joint that a voltage drives, simulated freely from a recorded start.
//!
//! J·q̈ + g(q) + viscous·q̇ + friction + offset = gain·(u − emf·q̇), current without delay (L neglected), none where the
//! drive is off. The voltage is the recorded one, or
//! in the closed loop that of the recording's own controller. Steps after Moreau (1988), as in [`crate::simulate`]: dry friction is whatever value within its bounds
//! brings the joint to rest, so it really sticks. What is proportional to the velocity is taken at the end of the step.
//!
//! Leaves out: inductance, sag of the supply between rows, heating, play and elasticity of the gear.

use rig_shared::effects::{Channel, Direction, Effect, Instant, Kind, Memory};
use rig_shared::scalar::Real as _;

use super::log::{Log, Segment};
use crate::effects::over_coulomb;
use crate::robot::Robot;

/// Longest step, s.
const STEP: f64 = 1.0e-3;
/// Nominal parameters, in the order of [`NAMES`].
pub(super) const NOMINAL: usize = 6;
/// Drive inertia seen at the joint; torque per volt; back-EMF; Coulomb and viscous friction; constant torque.
pub(super) const NAMES: [(&str, &str); NOMINAL] = [
    ("Ia1", "kg*m^2"),
    ("torque per volt", "N*m/V"),
    ("back-EMF", "V*s/rad"),
    ("fc1", "N*m"),
    ("fv1", "N*m*s/rad"),
    ("off1", "N*m"),
];

/// What is known of the joint.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plant {
    /// Of the link, kg·m² or kg.
    pub inertia: f64,
    /// Torque against gravity: with cos q, with sin q, constant, N·m or N.
    pub gravity: [f64; 3],
    /// The same per kg·m of first moment along x, m/s².
    pub per_moment: [f64; 3],
    /// Motor turns per joint turn.
    pub ratio: f64,
}

/// With cos q, with sin q, constant.
fn wave(c: &[f64; 3], q: f64) -> f64 {
    let (sin, cos) = q.sin_cos();
    c[0] * cos + c[1] * sin + c[2]
}

/// Effects with their parameters, after the nominal ones in the list of a fit.
struct Part {
    effect: Effect<f64>,
    memory: Memory<f64>,
}

fn parts(effects: &[Kind], theta: &[f64]) -> Vec<Part> {
    let mut at = NOMINAL;
    let mut take = move |count: usize| {
        at += count;
        &theta[at - count..at]
    };
    effects
        .iter()
        .map(|kind| {
            let about = kind.about();
            let (gains, shapes) = (take(about.gains.len()), take(about.shapes.len()));
            Part {
                effect: Effect::new(*kind, gains, shapes),
                memory: Memory::default(),
            }
        })
        .collect()
}

impl Part {
    fn torque(&self, at: &Instant<f64>) -> f64 {
        self.effect.torque(&mut self.memory.clone(), at)
    }

    /// How far the contact is bent by then, of presliding.
    fn bent(&self, at: &Instant<f64>) -> f64 {
        let mut memory = self.memory;
        self.effect.torque(&mut memory, at);
        self.effect.bent(&memory, at.beside)
    }
}

impl Plant {
    /// The nominal parameters of a description, where it states all of them.
    pub(super) fn described(&self, robot: &Robot) -> Option<[f64; NOMINAL]> {
        let joint = robot.joints.first()?;
        let (drive, friction) = (joint.drive.as_ref()?, joint.friction.as_ref()?);
        let emf = drive.torque_constant * self.ratio.abs();
        let gain = emf / drive.resistance?;
        (gain.is_finite() && gain > 0.0).then_some([
            drive.joint_inertia + self.ratio * self.ratio * drive.rotor_inertia,
            gain,
            emf,
            friction.coulomb,
            friction.viscous,
            friction.offset,
        ])
    }

    /// Torque against gravity, N·m or N.
    pub(super) fn weight(&self, q: f64) -> f64 {
        wave(&self.gravity, q)
    }

    /// Simulated positions at the rows of `segment`, appended to `out`; false where friction would drive the joint or
    /// the motion grows beyond all bounds.
    pub(super) fn simulate(
        &self,
        effects: &[Kind],
        theta: &[f64],
        log: &Log,
        segment: &Segment,
        out: &mut Vec<f64>,
    ) -> bool {
        let &[armature, gain, emf, coulomb, viscous, offset, ..] = theta else {
            return false;
        };
        let inertia = self.inertia + armature;
        let sliding = |v: f64| viscous * v + coulomb * v.sgn();
        let mut parts = parts(effects, theta);
        let late: f64 = (parts.iter())
            .filter(|p| p.effect.kind == Kind::MeasurementDelay)
            .map(|p| p.effect.gains[0])
            .sum();
        parts.retain(|p| p.effect.kind != Kind::MeasurementDelay);
        let mut between = Between {
            log,
            row: segment.from,
        };
        let (mut q, mut v) = (log.q[segment.from], segment.velocity);
        let (mut acceleration, mut drive_before) = (0.0, 0.0);
        for k in segment.from..segment.to {
            out.push(q);
            if k + 1 == segment.to {
                break;
            }
            let interval = log.t[k + 1] - log.t[k];
            let steps = (interval / STEP).ceil().max(1.0);
            let dt = interval / steps;
            let on = log.on[k];
            for s in 0..steps as usize {
                let now = log.t[k] + (s as f64 + 0.5) * dt;
                let middle = q + 0.5 * dt * v;
                let mut at = Instant {
                    position: middle,
                    velocity: v,
                    acceleration,
                    motor_angle: self.ratio * middle,
                    gravity: wave(&self.per_moment, middle),
                    time: now,
                    period: dt,
                    ..Instant::default()
                };
                let weight = self.weight(middle);
                let mut effective = match log.law {
                    _ if !on => 0.0,
                    Some(law) => {
                        let reference = between.at(now, &log.reference);
                        law.voltage(reference, middle, v)
                    }
                    None => between.at(now + late, &log.u),
                };
                if on {
                    let net = effective - emf * v;
                    at.drive_torque = gain * net;
                    let lost: f64 = (parts.iter())
                        .filter(|p| p.effect.kind.about().channel == Channel::Voltage)
                        .map(|p| p.torque(&at))
                        .sum();
                    // What is lost stops the current; it does not turn it round.
                    effective -= lost.abs().min(net.abs()) * net.signum();
                    at.drive_torque = gain * (effective - emf * v);
                }
                at.drive_rate = (at.drive_torque - drive_before) / dt;
                drive_before = at.drive_torque;
                at.load = self.inertia * acceleration + weight;
                at.friction = sliding(v);
                let mut torque = if on { gain * effective } else { 0.0 } - weight - offset;
                let (mut low, mut high) = (-coulomb, coulomb);
                let contact = parts.iter().find(|p| p.effect.kind.is_presliding());
                let bent = contact.map(|part| part.bent(&at));
                let mut through = 0.0;
                for part in &parts {
                    let kind = part.effect.kind;
                    let about = kind.about();
                    if about.channel == Channel::Voltage {
                        continue;
                    }
                    if about.direction == Direction::Indifferent {
                        torque -= part.torque(&at);
                        continue;
                    }
                    let bent = bent.filter(|_| kind.acts_through_contact());
                    let towards = |direction: f64, bent: f64| {
                        part.torque(&Instant {
                            direction,
                            friction: viscous * v + coulomb * bent,
                            ..at
                        })
                    };
                    if let Some(bent) = bent {
                        let whole = towards(1.0, bent);
                        (low, high) = (low + whole * bent, high + whole * bent);
                        through += whole;
                        continue;
                    }
                    (low, high) = (low + towards(-1.0, -1.0), high + towards(1.0, 1.0));
                }
                if low.is_nan() || high.is_nan() || low > high {
                    return false;
                }
                at.beside = over_coulomb(through, coulomb);
                let braking = viscous + if on { gain * emf } else { 0.0 };
                let mass = inertia + dt * braking;
                let stop = inertia * v / dt + torque;
                let next = dt * (stop - stop.clamp(low, high)) / mass;
                acceleration = (next - v) / dt;
                q += 0.5 * dt * (v + next);
                v = next;
                at.velocity = v;
                at.direction = v.sgn();
                at.friction = sliding(v);
                for part in &mut parts {
                    part.effect.torque(&mut part.memory, &at);
                }
            }
            if !(q.abs() < 1.0e6 && v.abs() < 1.0e6) {
                return false;
            }
        }
        true
    }
}

/// Columns over time: on a line between two rows of one state of the drive, held where that changes.
struct Between<'a> {
    log: &'a Log,
    row: usize,
}

impl Between<'_> {
    fn at(&mut self, time: f64, column: &[f64]) -> f64 {
        let log = self.log;
        while self.row + 1 < log.t.len() && log.t[self.row + 1] <= time {
            self.row += 1;
        }
        while self.row > 0 && log.t[self.row] > time {
            self.row -= 1;
        }
        let (k, next) = (self.row, self.row + 1);
        if next >= log.t.len() || log.on[k] != log.on[next] {
            return column[k];
        }
        let share = ((time - log.t[k]) / (log.t[next] - log.t[k])).clamp(0.0, 1.0);
        column[k] + share * (column[next] - column[k])
    }
}
