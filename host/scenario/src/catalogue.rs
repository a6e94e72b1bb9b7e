//! Random effects, with sizes drawn log-uniformly over the range of comparable rigs.

use super::dice::Dice;
use super::hidden::Effect;
use super::rig::TICK_RATE;

/// Makes an effect from its size, a phase in rad, and further draws.
type Make = fn(f64, f64, &mut Dice) -> Effect;

/// Name, smallest and largest size in the unit of the first parameter (for an elastic gear compliance, mrad/(N·m)), and
/// the effect of a size.
const CATALOGUE: [(&str, [f64; 2], Make); 21] = [
    ("stribeck", [0.1, 1.0], |size, _, dice| Effect::Stribeck {
        ratio: 1.0 + size,
        velocity: dice.log_uniform([0.01, 0.3]),
    }),
    ("asymmetric_coulomb", [0.05, 0.3], |size, _, dice| {
        Effect::AsymmetricCoulomb {
            difference: dice.sign() * size,
        }
    }),
    ("quadratic_drag", [2.0e-3, 0.1], |size, _, _| {
        Effect::QuadraticDrag { coefficient: size }
    }),
    ("load_friction", [0.03, 0.2], |size, _, _| {
        Effect::LoadFriction { ratio: size }
    }),
    ("position_friction", [0.05, 0.2], |size, phase, dice| {
        Effect::PositionFriction {
            amplitude: size,
            order: [1.0, 2.0, 3.0, 4.0][dice.index(4)],
            phase,
        }
    }),
    ("presliding", [0.5e-3, 30.0e-3], |size, _, _| {
        Effect::Presliding { stroke: size }
    }),
    ("viscous_warmup", [0.3, 0.6], |size, _, dice| {
        Effect::ViscousWarmup {
            fall: size.min(0.95),
            time_constant: dice.log_uniform([15.0, 60.0]),
        }
    }),
    ("cogging", [0.05, 0.5], |size, phase, dice| {
        Effect::Cogging {
            amplitude: size,
            order: [12.0, 24.0, 36.0, 42.0, 84.0][dice.index(5)],
            phase,
        }
    }),
    ("torque_ripple", [0.01, 0.08], |size, phase, dice| {
        Effect::TorqueRipple {
            amplitude: size,
            // Six times the pole pairs (42), twice them (14: unequal gains of the phase currents), and 84.
            order: [42.0, 14.0, 84.0][dice.index(3)],
            phase,
        }
    }),
    ("gear_eccentricity", [0.1, 0.4], |size, phase, _| {
        Effect::GearEccentricity {
            amplitude: size,
            phase,
        }
    }),
    ("backlash", [0.15, 1.5], |size, _, _| Effect::Backlash {
        gap: size.to_radians(),
    }),
    ("joint_elasticity", [0.667, 3.333], |size, _, dice| {
        let stiffness = 1000.0 / size;
        Effect::JointElasticity {
            stiffness,
            // 1 to 6 % of the critical damping of rotor against link.
            damping: dice.log_uniform([0.02, 0.12]) * (stiffness * 0.0375).sqrt(),
        }
    }),
    ("encoder_eccentricity", [0.02, 1.0], |size, phase, _| {
        Effect::EncoderEccentricity {
            amplitude: size.to_radians(),
            phase,
        }
    }),
    ("current_offset", [0.02, 0.2], |size, _, dice| {
        Effect::CurrentOffset {
            current: dice.sign() * size,
        }
    }),
    ("torque_saturation", [0.03, 0.15], |size, _, _| {
        Effect::TorqueSaturation {
            loss: size.min(0.9),
        }
    }),
    ("measurement_delay", [0.5e-3, 6.0e-3], |size, _, _| {
        Effect::MeasurementDelay {
            delay: (size * TICK_RATE).round().max(1.0) / TICK_RATE,
        }
    }),
    ("gravity_tilt", [1.0, 6.0], |size, _, dice| {
        Effect::GravityTilt {
            angle: dice.sign() * size.to_radians(),
        }
    }),
    ("payload", [0.05, 0.5], |size, _, dice| Effect::Payload {
        mass: size,
        distance: dice.uniform(0.25, 0.45),
    }),
    ("spring", [0.05, 0.5], |size, _, dice| Effect::Spring {
        stiffness: size,
        rest: dice.uniform(-0.5, 0.5),
    }),
    ("drive_deadzone", [0.25, 1.9], |size, _, _| {
        Effect::DriveDeadzone { voltage: size }
    }),
    ("torque_offset", [0.02, 0.5], |size, _, dice| {
        Effect::TorqueOffset {
            torque: dice.sign() * size,
        }
    }),
];

impl Effect {
    /// Names of all effects.
    pub fn names() -> impl Iterator<Item = &'static str> {
        CATALOGUE.iter().map(|(name, ..)| *name)
    }

    /// Draws an effect of the given name. Its size is drawn from the range of the catalogue and multiplied by
    /// `strength`. None if there is no such name.
    pub fn draw(name: &str, strength: f64, seed: u64) -> Option<Self> {
        let (at, (_, range, make)) = CATALOGUE
            .iter()
            .enumerate()
            .find(|(_, (known, ..))| *known == name)?;
        let mut dice = Dice::new(seed, 16 + at as u64);
        let size = strength * dice.log_uniform(*range);
        let phase = dice.phase();
        Some(make(size, phase, &mut dice))
    }
}
