//! The motion of a link behind the measured motion of its motor, and the friction and backlash that it shows.

use rig_numerics::statistics::mean;

use super::two_mass::{Gravity, TwoMass};

/// Phase of the link's own swing per step, rad.
const PHASE: f64 = 0.05;
/// Sign of the velocity, 0 to 1, from which on the velocity is beyond its noise: 3 standard deviations.
const CLEAR: f64 = 0.9;
/// Friction below this share of the largest spring torque counts as none: only the sign of the velocity is returned.
const NONE: f64 = 1e-6;

/// Measured motion of the motor, at each row.
pub(super) struct MotorMotion<'a> {
    /// Position from the first row, rad.
    pub(super) position: &'a [f64],
    /// Position of the first row from the mean pose, rad.
    pub(super) first: f64,
    pub(super) velocity: &'a [f64],
    /// Torque of the motor as recorded: a line that is taken off it would be friction of another size at each end.
    pub(super) torque: &'a [f64],
    /// Torque that the motion of the other joints puts on the link.
    pub(super) pushed: &'a [f64],
    /// Sign of the velocity by the measured velocity alone: near 0 where noise decides it.
    pub(super) moving: &'a [f64],
    /// Time between rows, s.
    pub(super) dt: f64,
    /// Rows on either side of a standstill whose velocity it changes.
    pub(super) smeared: usize,
}

/// Nonlinear torques by a model, at each row.
#[derive(Debug, Default)]
pub(super) struct Nonlinear {
    /// Coulomb friction of the motor over its size, -1 to 1.
    pub(super) motor_friction: Vec<f64>,
    /// Coulomb friction of the link over its size, -1 to 1.
    pub(super) link_friction: Vec<f64>,
    /// Torque of the spring less that of a spring without a gap, over c and the gap, -½ to ½.
    pub(super) gap: Vec<f64>,
    /// Torque of gravity on the link less its linear part, N·m.
    pub(super) gravity: Vec<f64>,
}

/// Returns the nonlinear torques on motor and link at each row. At the first row the link rests.
///
/// Time stepping after Moreau (1988): friction stops the link if it can, else it brakes with its full size. The contact of
/// a gap pushes and never pulls (Nordin & Gutman 2002).
pub(super) fn predict(model: &TwoMass, motor: &MotorMotion<'_>, gravity: &Gravity) -> Nonlinear {
    let inertia = model.link_inertia;
    let (position, velocity, dt) = (motor.position, motor.velocity, motor.dt);
    // An even number: the friction of a row is the mean over half a row on either side.
    let steps = 2.0
        * (0.5 * dt * model.antiresonance() / PHASE)
            .ceil()
            .clamp(1.0, 100.0);
    let h = dt / steps;
    // At rest the spring carries the weight: the twist is counted from there.
    let preload = gravity.torque(motor.first);
    let rest = preload / model.stiffness + 0.5 * model.gap * preload.signum();
    let (mut q, mut v) = (0.0, 0.0);
    let most = position.iter().fold(0.0, |m: f64, p| m.max(p.abs())) * model.stiffness;
    let size = model.link_coulomb.max(NONE * most);
    let mut found = Nonlinear::default();
    let mut spring = Vec::with_capacity(position.len());
    let mut before = 0.0;
    for row in 0..position.len() {
        let mut halves = [0.0; 2];
        let next = (row + 1).min(position.len() - 1);
        let (twist, rate) = (position[row] - q, velocity[row] - v);
        let linear = model.stiffness * twist + model.damping * rate;
        let torque = spring_torque(model, rest + twist, rate) - preload;
        spring.push(torque);
        (found.gravity).push(gravity.torque(motor.first + q) - preload - model.gravity * q);
        found.gap.push(match model.gap > 0.0 {
            true => (torque - linear) / (model.stiffness * model.gap),
            false => 0.0,
        });
        for step in 0..steps as usize {
            let share = (step as f64 + 0.5) / steps;
            let motor_position = position[row] + share * (position[next] - position[row]);
            let speed = velocity[row] + share * (velocity[next] - velocity[row]);
            q += 0.5 * h * v;
            let torque = spring_torque(model, rest + motor_position - q, speed - v)
                - model.link_viscous * v
                - motor.pushed[row]
                - gravity.torque(motor.first + q);
            let free = v + h * torque / inertia;
            let stopping = (free * inertia).clamp(-h * size, h * size);
            v = free - stopping / inertia;
            q += 0.5 * h * v;
            halves[usize::from(share > 0.5)] += stopping;
        }
        found.link_friction.push((before + halves[0]) / (dt * size));
        before = halves[1];
    }
    found.motor_friction = motor_friction(model, motor, &spring);
    found
}

/// Returns the torque of the spring at a twist from the middle of its gap.
fn spring_torque(model: &TwoMass, twist: f64, rate: f64) -> f64 {
    let bend = twist - twist.clamp(-0.5 * model.gap, 0.5 * model.gap);
    let torque = model.stiffness * bend + model.damping * rate;
    match model.gap > 0.0 && (bend == 0.0 || torque * bend < 0.0) {
        true => 0.0,
        false => torque,
    }
}

/// Returns the friction of the motor over its size: the sign of its velocity where that is beyond its noise. In between the
/// motor moves on by the model, from the last velocity beyond the noise (time stepping after Moreau 1988): friction stops it if
/// it can, holds it while no other torque is larger, and changes its sign where the velocity does.
fn motor_friction(model: &TwoMass, motor: &MotorMotion<'_>, spring: &[f64]) -> Vec<f64> {
    if model.coulomb <= 0.0 {
        return motor.moving.to_vec();
    }
    // Friction has no mean over a motion to and fro.
    let offset = mean(motor.torque) - mean(spring);
    let (inertia, h) = (model.motor_inertia, 0.5 * motor.dt);
    let last = spring.len() - 1;
    let mut found = Vec::with_capacity(spring.len());
    let (mut v, mut before) = (0.0, 0.0);
    for row in 0..=last {
        let near = &motor.moving
            [row.saturating_sub(motor.smeared)..(row + motor.smeared + 1).min(last + 1)];
        let sign = motor.moving[row].signum();
        let is_clear = near.iter().all(|moving| moving * sign > CLEAR);
        if is_clear {
            v = motor.velocity[row];
        }
        let next = (row + 1).min(last);
        let at_end = motor.torque[if model.hold > 0.0 { row } else { next }];
        let [own, next] = [motor.torque[row] - spring[row], at_end - spring[next]];
        let [own, next] = [own - offset, next - offset];
        // The two halves of the time to the next row.
        let halves = [0.25, 0.75].map(|share| {
            let torque = own + share * (next - own) - model.viscous * v;
            let most = h * model.coulomb;
            let impulse = (inertia * v + h * torque).clamp(-most, most);
            v += (h * torque - impulse) / inertia;
            impulse / most
        });
        found.push(match is_clear {
            true => sign,
            false => 0.5 * (before + halves[0]),
        });
        before = halves[1];
    }
    found
}
