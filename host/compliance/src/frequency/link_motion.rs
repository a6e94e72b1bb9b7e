//! The motion of a link behind the measured motion of its motor.

use super::two_mass::TwoMass;

/// Phase of the link's own swing per step, rad.
const PHASE: f64 = 0.05;
/// Friction below this share of the largest spring torque counts as none: only the sign of the velocity is returned.
const NONE: f64 = 1e-6;

/// Returns the Coulomb friction torque on the link over its size, -1 to 1, at each row. `position` (from the first row, at
/// rest) and `velocity` are those of the motor.
///
/// Time stepping after Moreau (1988): friction stops the link if it can, else it brakes with its full size.
pub(super) fn link_friction(
    model: &TwoMass,
    position: &[f64],
    velocity: &[f64],
    dt: f64,
) -> Vec<f64> {
    let inertia = model.link_inertia;
    let steps = (dt * model.antiresonance() / PHASE)
        .ceil()
        .clamp(1.0, 200.0);
    let h = dt / steps;
    // The spring's torque at rest is part of the origin: twist and gravity are counted from there.
    let (mut q, mut v) = (0.0, 0.0);
    let most = position.iter().fold(0.0, |m: f64, p| m.max(p.abs())) * model.stiffness;
    let size = model.link_coulomb.max(NONE * most);
    let mut friction = Vec::with_capacity(position.len());
    for row in 0..position.len() {
        let mut impulse = 0.0;
        let next = (row + 1).min(position.len() - 1);
        for step in 0..steps as usize {
            let share = (step as f64 + 0.5) / steps;
            let motor = position[row] + share * (position[next] - position[row]);
            let speed = velocity[row] + share * (velocity[next] - velocity[row]);
            let torque = model.stiffness * (motor - q) + model.damping * (speed - v)
                - model.link_viscous * v
                - model.gravity * q;
            let free = v + h * torque / inertia;
            let stopping = (free * inertia).clamp(-h * size, h * size);
            v = free - stopping / inertia;
            q += h * v;
            impulse += stopping;
        }
        friction.push(impulse / (dt * size));
    }
    friction
}
