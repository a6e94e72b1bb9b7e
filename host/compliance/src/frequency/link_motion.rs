//! The motion of a link behind the measured motion of its motor, and the friction and backlash that it shows.

use rig_numerics::statistics::mean;

use super::two_mass::{Gravity, TwoMass};

/// Phase of the link's own swing per step, rad. At its antiresonance the link enlarges errors as it does the motion, some tenfold.
const PHASE: f64 = 0.02;
/// Sign of the velocity, 0 to 1, from which on the velocity is beyond its noise: 3 standard deviations.
const CLEAR: f64 = 0.9;
/// Steps of the motor in half the time of a row: it changes its direction, or stops, between two rows.
const HALF_STEPS: usize = 8;
/// Predictions of the friction, each with a better constant torque. Friction that holds the motor at rest has a mean.
const OFFSETS: usize = 4;
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
    /// Antiresonance that the steps are made for, rad/s.
    pub(super) swing: f64,
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
    let steps = 2.0 * (0.5 * dt * motor.swing / PHASE).ceil().clamp(1.0, 100.0);
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
        let (twist, rate) = (position[row] - q, velocity[row] - v);
        let linear = model.stiffness * twist + model.damping * rate;
        let torque = spring_torque(model, rest + twist, rate) - preload;
        spring.push(torque);
        (found.gravity).push(gravity.torque(motor.first + q) - preload - model.gravity * q);
        found.gap.push(match model.gap > 0.0 {
            true => (torque - linear) / (model.stiffness * model.gap),
            false => 0.0,
        });
        let course = course(position, row);
        let next = (row + 1).min(position.len() - 1);
        let pushed = [motor.pushed[row], motor.pushed[next]];
        for step in 0..steps as usize {
            let share = (step as f64 + 0.5) / steps;
            let [motor_position, moved] = course(share);
            let speed = moved / dt;
            q += 0.5 * h * v;
            let pull = spring_torque(model, rest + motor_position - q, speed - v);
            let torque = pull
                - model.link_viscous * v
                - (pushed[0] + share * (pushed[1] - pushed[0]))
                - gravity.torque(motor.first + q);
            // Damping by the mean velocity of the step: that of its start would be late, and the link seem stiffer.
            let damping = if model.gap > 0.0 && pull == 0.0 {
                0.0
            } else {
                model.damping
            };
            let damped = inertia + 0.5 * h * (damping + model.link_viscous);
            let free = v + h * torque / damped;
            let stopping = (free * damped).clamp(-h * size, h * size);
            v = free - stopping / damped;
            q += 0.5 * h * v;
            halves[usize::from(share > 0.5)] += stopping;
        }
        found.link_friction.push((before + halves[0]) / (dt * size));
        before = halves[1];
    }
    found.motor_friction = motor_friction(model, motor, &spring);
    found
}

/// Returns the course of a position from a row to the next and its slope per row, by the share of the time: a cubic with the
/// slopes of the neighbours at both rows.
fn course(position: &[f64], row: usize) -> impl Fn(f64) -> [f64; 2] {
    let last = position.len() - 1;
    let at = |k: usize| position[k.min(last)];
    let (now, next) = (at(row), at(row + 1));
    let first = 0.5 * (next - at(row.saturating_sub(1)));
    let second = 0.5 * (at(row + 2) - now);
    let way = next - now;
    move |share| {
        let rest = 1.0 - share;
        let (early, late) = (first - way, second - way);
        [
            now + share * (way + rest * (early * rest - late * share)),
            way + early * rest * (rest - 2.0 * share) + late * share * (share - 2.0 * rest),
        ]
    }
}

/// Returns what the mean velocity over `half` rows on either side has beyond that of the row itself, by the course of the torque
/// that accelerates, per inertia and time of a row.
fn averaged_away(torque: impl Fn(usize) -> f64, row: usize, half: usize, last: usize) -> f64 {
    if row < half || row + half > last {
        return 0.0;
    }
    let pair = |j: usize| torque(row + j) - torque(row - j);
    // ∫ (half − s)·torque ds over a torque that is linear between rows.
    let inner: f64 = (1..half).map(|j| (half - j) as f64 * pair(j)).sum();
    (inner + pair(half) / 6.0) / (2 * half) as f64
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
    // What the torque holds beside spring and friction has no mean over a motion that begins and ends at rest.
    let constant = mean(motor.torque) - mean(spring);
    let clear: Vec<bool> = (0..spring.len()).map(|row| is_clear(motor, row)).collect();
    let mut found = Vec::new();
    let mut offset = constant;
    for _ in 0..OFFSETS {
        found = friction_beside(model, motor, spring, &clear, offset);
        offset = constant - model.coulomb * mean(&found);
    }
    found
}

/// Returns true if the velocity of a row is beyond its noise, in one direction over the rows that a standstill changes.
fn is_clear(motor: &MotorMotion<'_>, row: usize) -> bool {
    let end = (row + motor.smeared + 1).min(motor.moving.len());
    let sign = motor.moving[row].signum();
    (motor.moving[row.saturating_sub(motor.smeared)..end].iter())
        .all(|moving| moving * sign > CLEAR)
}

/// Returns the friction of the motor over its size beside a constant torque, N·m.
fn friction_beside(
    model: &TwoMass,
    motor: &MotorMotion<'_>,
    spring: &[f64],
    clear: &[bool],
    offset: f64,
) -> Vec<f64> {
    let (inertia, h) = (model.motor_inertia, 0.5 * motor.dt / HALF_STEPS as f64);
    let most = h * model.coulomb;
    let last = spring.len() - 1;
    let mut found = Vec::with_capacity(spring.len());
    let (mut v, mut before) = (0.0, 0.0);
    for row in 0..=last {
        let next = (row + 1).min(last);
        let sign = motor.moving[row].signum();
        // The motion from here to a row whose velocity is measured is not used.
        if clear[row] && clear[next] {
            found.push(sign);
            continue;
        }
        if clear[row] {
            let push = |k: usize| motor.torque[k] - spring[k] - model.viscous * motor.velocity[k];
            v = motor.velocity[row]
                - averaged_away(push, row, motor.smeared, last) * motor.dt / inertia;
        }
        let at_end = motor.torque[if model.hold > 0.0 { row } else { next }];
        let [own, next] = [motor.torque[row] - spring[row], at_end - spring[next]];
        let [own, next] = [own - offset, next - offset];
        // The two halves of the time to the next row.
        let mut halves = [0.0; 2];
        for step in 0..2 * HALF_STEPS {
            let share = (step as f64 + 0.5) / (2 * HALF_STEPS) as f64;
            let torque = own + share * (next - own) - model.viscous * v;
            let impulse = (inertia * v + h * torque).clamp(-most, most);
            v += (h * torque - impulse) / inertia;
            halves[step / HALF_STEPS] += impulse / (most * HALF_STEPS as f64);
        }
        found.push(match clear[row] {
            true => sign,
            false => 0.5 * (before + halves[0]),
        });
        before = halves[1];
    }
    found
}
