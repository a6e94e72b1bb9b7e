//! Random effects, with sizes drawn log-uniformly over the range of comparable rigs.

use super::dice::Dice;
use super::hidden::Effect;
use super::rig::TICK_RATE;

/// Smallest and largest size in the unit of the first parameter; for an elastic gear compliance, mrad/(N·m).
const SIZES: [(&str, [f64; 2]); 21] = [
    ("stribeck", [0.1, 1.0]),
    ("asymmetric_coulomb", [0.05, 0.3]),
    ("quadratic_drag", [2.0e-3, 0.1]),
    ("load_friction", [0.03, 0.2]),
    ("position_friction", [0.05, 0.2]),
    ("presliding", [0.5e-3, 30.0e-3]),
    ("viscous_warmup", [0.3, 0.6]),
    ("cogging", [0.05, 0.5]),
    ("torque_ripple", [0.01, 0.08]),
    ("gear_eccentricity", [0.1, 0.4]),
    ("backlash", [0.15, 1.5]),
    ("joint_elasticity", [0.667, 3.333]),
    ("encoder_eccentricity", [0.02, 1.0]),
    ("current_offset", [0.02, 0.2]),
    ("torque_saturation", [0.03, 0.15]),
    ("measurement_delay", [0.5e-3, 6.0e-3]),
    ("gravity_tilt", [1.0, 6.0]),
    ("payload", [0.05, 0.5]),
    ("spring", [0.05, 0.5]),
    ("drive_deadzone", [0.25, 1.9]),
    ("torque_offset", [0.02, 0.5]),
];

impl Effect {
    /// Names of all effects.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SIZES.iter().map(|(name, _)| *name)
    }

    /// Draws an effect of the given name. Its size is drawn from the range of the catalogue and multiplied by
    /// `strength`. None if there is no such name.
    pub fn draw(name: &str, strength: f64, seed: u64) -> Option<Self> {
        let (at, (_, range)) = SIZES
            .iter()
            .enumerate()
            .find(|(_, (known, _))| *known == name)?;
        let mut dice = Dice::new(seed, 16 + at as u64);
        let size = strength * dice.log_uniform(*range);
        let phase = dice.phase();
        Some(match name {
            "stribeck" => Self::Stribeck {
                ratio: 1.0 + size,
                velocity: dice.log_uniform([0.01, 0.3]),
            },
            "asymmetric_coulomb" => Self::AsymmetricCoulomb {
                difference: dice.sign() * size,
            },
            "quadratic_drag" => Self::QuadraticDrag { coefficient: size },
            "load_friction" => Self::LoadFriction { ratio: size },
            "position_friction" => Self::PositionFriction {
                amplitude: size,
                order: [1.0, 2.0, 3.0, 4.0][dice.index(4)],
                phase,
            },
            "presliding" => Self::Presliding { stroke: size },
            "viscous_warmup" => Self::ViscousWarmup {
                fall: size.min(0.95),
                time_constant: dice.log_uniform([15.0, 60.0]),
            },
            "cogging" => Self::Cogging {
                amplitude: size,
                order: [12.0, 24.0, 36.0, 42.0, 84.0][dice.index(5)],
                phase,
            },
            "torque_ripple" => Self::TorqueRipple {
                amplitude: size,
                // Six times the pole pairs (42), twice them (14: unequal gains of the phase currents), and 84.
                order: [42.0, 14.0, 84.0][dice.index(3)],
                phase,
            },
            "gear_eccentricity" => Self::GearEccentricity {
                amplitude: size,
                phase,
            },
            "backlash" => Self::Backlash {
                gap: size.to_radians(),
            },
            "joint_elasticity" => {
                let stiffness = 1000.0 / size;
                Self::JointElasticity {
                    stiffness,
                    // 1 to 6 % of the critical damping of rotor against link.
                    damping: dice.log_uniform([0.02, 0.12]) * (stiffness * 0.0375).sqrt(),
                }
            }
            "encoder_eccentricity" => Self::EncoderEccentricity {
                amplitude: size.to_radians(),
                phase,
            },
            "current_offset" => Self::CurrentOffset {
                current: dice.sign() * size,
            },
            "torque_saturation" => Self::TorqueSaturation {
                loss: size.min(0.9),
            },
            "measurement_delay" => Self::MeasurementDelay {
                delay: (size * TICK_RATE).round().max(1.0) / TICK_RATE,
            },
            "gravity_tilt" => Self::GravityTilt {
                angle: dice.sign() * size.to_radians(),
            },
            "payload" => Self::Payload {
                mass: size,
                distance: dice.uniform(0.25, 0.45),
            },
            "spring" => Self::Spring {
                stiffness: size,
                rest: dice.uniform(-0.5, 0.5),
            },
            "drive_deadzone" => Self::DriveDeadzone { voltage: size },
            _ => Self::TorqueOffset {
                torque: dice.sign() * size,
            },
        })
    }
}
