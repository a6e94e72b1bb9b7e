//! What is hidden in a recording: an effect of the emulated rig with its parameters, drawn log-uniformly over what
//! such rigs have.

use serde::Serialize;

use super::dice::Dice;
use super::rig::TICK_RATE;
use crate::plant::effect::cogging::Cogging;
use crate::plant::effect::dead_time::DeadTime;
use crate::plant::effect::drag::QuadraticDrag;
use crate::plant::effect::encoder_eccentricity::EncoderEccentricity;
use crate::plant::effect::friction_warmup::FrictionWarmup;
use crate::plant::effect::gear_eccentricity::GearEccentricity;
use crate::plant::effect::load_friction::LoadFriction;
use crate::plant::effect::position_friction::PositionFriction;
use crate::plant::effect::spring::Spring;
use crate::plant::effect::tilt::Tilt;
use crate::plant::effect::torque_ripple::TorqueRipple;
use crate::plant::effect::torque_saturation::TorqueSaturation;
use crate::plant::effect::transmission::{Backlash, Elasticity};
use crate::plant::{Body, PlantConfig, VelocityWeakening};

/// Power that friction takes on average in the scenarios' motion, W: 0.8 N·m and 0.25 N·m·s/rad at some 0.7 rad/s.
const FRICTION_POWER: f64 = 0.7;
/// Rise of the gear's temperature at that power, K. Only its product with the rate of the friction shows.
const WARMING: f64 = 10.0;
/// Stiffness of closed teeth, N·m/rad, and their damping, N·m·s/rad.
const TEETH: [f64; 2] = [3000.0, 2.0];

/// An effect with the parameters that are drawn, as the emulated rig means them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Rational velocity weakening: breakaway over Coulomb torque, and speed at half of the excess, rad/s.
    Stribeck {
        /// Fs/Fc
        ratio: f64,
        /// rad/s
        velocity: f64,
    },
    /// Difference of Coulomb friction between the directions over their mean.
    AsymmetricCoulomb {
        /// (F₊ − F₋)/F
        difference: f64,
    },
    /// Torque with the square of speed.
    QuadraticDrag {
        /// N·m·s²/rad²
        coefficient: f64,
    },
    /// Friction with the torque transmitted.
    LoadFriction {
        /// N·m per N·m
        ratio: f64,
    },
    /// Tight spots of the joint.
    PositionFriction {
        /// Relative.
        amplitude: f64,
        /// Per turn of the joint.
        order: f64,
        /// rad
        phase: f64,
    },
    /// Contact that yields before it slides (four Maxwell-slip elements).
    Presliding {
        /// From rest to sliding, rad.
        stroke: f64,
    },
    /// Viscous friction falling as friction heats the gear.
    ViscousWarmup {
        /// Share that is gone in the end.
        fall: f64,
        /// s
        time_constant: f64,
    },
    /// Detent torque.
    Cogging {
        /// Joint-side, N·m.
        amplitude: f64,
        /// Per turn of the motor.
        order: f64,
        /// rad
        phase: f64,
    },
    /// Torque constant over the motor's angle.
    TorqueRipple {
        /// Relative.
        amplitude: f64,
        /// Per turn of the motor.
        order: f64,
        /// rad
        phase: f64,
    },
    /// Torque once per turn of the motor.
    GearEccentricity {
        /// N·m
        amplitude: f64,
        /// rad
        phase: f64,
    },
    /// Play between rotor and link.
    Backlash {
        /// Whole gap, rad.
        gap: f64,
    },
    /// Elastic gear.
    JointElasticity {
        /// N·m/rad
        stiffness: f64,
        /// N·m·s/rad
        damping: f64,
    },
    /// Encoder off its axis.
    EncoderEccentricity {
        /// rad of the motor
        amplitude: f64,
        /// rad
        phase: f64,
    },
    /// Error of the current sensor.
    CurrentOffset {
        /// A
        current: f64,
    },
    /// Torque constant over the current, 1/(1 + (i/knee)²).
    TorqueSaturation {
        /// Share lost at the current of the torque limit.
        loss: f64,
    },
    /// Current reading that comes late.
    MeasurementDelay {
        /// s, whole tenths of a millisecond
        delay: f64,
    },
    /// Base not level.
    GravityTilt {
        /// rad
        angle: f64,
    },
    /// A body on the link that nobody wrote down.
    Payload {
        /// kg
        mass: f64,
        /// From the joint's axis, m.
        distance: f64,
    },
    /// Cable.
    Spring {
        /// N·m/rad
        stiffness: f64,
        /// Angle from hanging at which it pulls nothing, rad.
        rest: f64,
    },
    /// Dead time of the bridge.
    DriveDeadzone {
        /// V
        voltage: f64,
    },
    /// Constant torque on the joint.
    TorqueOffset {
        /// N·m
        torque: f64,
    },
}

/// An effect in one joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hidden {
    /// Index of the joint.
    pub joint: usize,
    /// What.
    pub effect: Effect,
}

/// Names and what sizes are drawn from: least and largest, in the unit of the first parameter. For an elastic gear
/// the size is its compliance, mrad/(N·m).
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
    /// Current at the rig's torque limit of 8 N·m, A.
    pub const PEAK_CURRENT: f64 = 3.2;

    /// All names, as the contract has them.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SIZES.iter().map(|(name, _)| *name)
    }

    /// Name as the contract has it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Stribeck { .. } => "stribeck",
            Self::AsymmetricCoulomb { .. } => "asymmetric_coulomb",
            Self::QuadraticDrag { .. } => "quadratic_drag",
            Self::LoadFriction { .. } => "load_friction",
            Self::PositionFriction { .. } => "position_friction",
            Self::Presliding { .. } => "presliding",
            Self::ViscousWarmup { .. } => "viscous_warmup",
            Self::Cogging { .. } => "cogging",
            Self::TorqueRipple { .. } => "torque_ripple",
            Self::GearEccentricity { .. } => "gear_eccentricity",
            Self::Backlash { .. } => "backlash",
            Self::JointElasticity { .. } => "joint_elasticity",
            Self::EncoderEccentricity { .. } => "encoder_eccentricity",
            Self::CurrentOffset { .. } => "current_offset",
            Self::TorqueSaturation { .. } => "torque_saturation",
            Self::MeasurementDelay { .. } => "measurement_delay",
            Self::GravityTilt { .. } => "gravity_tilt",
            Self::Payload { .. } => "payload",
            Self::Spring { .. } => "spring",
            Self::DriveDeadzone { .. } => "drive_deadzone",
            Self::TorqueOffset { .. } => "torque_offset",
        }
    }

    /// An effect of that name at random; its size is drawn over the catalogue's range and multiplied by `strength`.
    /// None where there is no such name.
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
                // Six times the pole pairs, and what unequal gains of the phase currents give.
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
                    // 1 to 6 % of critical for rotor against link.
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

    /// Puts it into the rig.
    pub(super) fn hide(&self, config: &mut PlantConfig) {
        let ratio = config.mechanism.ratio;
        let motor = &mut config.motor;
        let mechanism = &mut config.mechanism;
        match *self {
            Self::Stribeck {
                ratio: excess,
                velocity,
            } => {
                let weakening = |scale: f64| VelocityWeakening {
                    breakaway_ratio: excess,
                    velocity: velocity * scale,
                };
                motor.friction.weakening = Some(weakening(ratio));
                mechanism.friction.weakening = Some(weakening(1.0));
            }
            Self::AsymmetricCoulomb { difference } => {
                motor.friction.asymmetry = 0.5 * difference;
                mechanism.friction.asymmetry = 0.5 * difference;
            }
            Self::QuadraticDrag { coefficient } => {
                mechanism.friction.drag = Some(QuadraticDrag { coefficient });
            }
            Self::LoadFriction { ratio } => {
                mechanism.friction.load = Some(LoadFriction { ratio });
            }
            Self::PositionFriction {
                amplitude,
                order,
                phase,
            } => {
                let place = |scale: f64| PositionFriction {
                    amplitude,
                    order: order * scale,
                    phase,
                };
                motor.friction.position = Some(place(1.0 / ratio));
                mechanism.friction.position = Some(place(1.0));
            }
            Self::Presliding { stroke } => {
                motor.friction.presliding.stroke = stroke * ratio;
                mechanism.friction.presliding.stroke = stroke;
            }
            Self::ViscousWarmup {
                fall,
                time_constant,
            } => {
                let thermal_resistance = WARMING / FRICTION_POWER;
                mechanism.warmup = Some(FrictionWarmup {
                    heat_capacity: time_constant / thermal_resistance,
                    thermal_resistance,
                    viscous_rate: -(1.0 - fall).ln() / WARMING,
                    coulomb_rate: 0.0,
                });
            }
            Self::Cogging {
                amplitude,
                order,
                phase,
            } => {
                motor.cogging = Some(Cogging {
                    amplitude: amplitude / ratio,
                    order,
                    phase,
                });
            }
            Self::TorqueRipple {
                amplitude,
                order,
                phase,
            } => {
                motor.ripple = Some(TorqueRipple {
                    amplitude,
                    order,
                    phase,
                });
            }
            Self::GearEccentricity { amplitude, phase } => {
                mechanism.eccentricity = Some(GearEccentricity {
                    amplitude,
                    order: 1.0,
                    phase,
                });
            }
            Self::Backlash { gap } => {
                let [stiffness, damping] = TEETH;
                mechanism.backlash = Some(Backlash {
                    gap,
                    stiffness,
                    damping,
                });
            }
            Self::JointElasticity { stiffness, damping } => {
                mechanism.elasticity = Some(Elasticity {
                    stiffness,
                    hardening: 0.0,
                    damping,
                });
            }
            Self::EncoderEccentricity { amplitude, phase } => {
                config.sensors.encoder.eccentricity =
                    Some(EncoderEccentricity { amplitude, phase });
            }
            Self::CurrentOffset { current } => config.sensors.current.offset = current,
            Self::TorqueSaturation { loss } => {
                motor.saturation = Some(TorqueSaturation {
                    knee: Self::PEAK_CURRENT * ((1.0 - loss) / loss).sqrt(),
                });
            }
            Self::MeasurementDelay { delay } => {
                config.sensors.current_delay = Some((delay * TICK_RATE).round() as usize);
            }
            Self::GravityTilt { angle } => {
                mechanism.tilt = Some(Tilt {
                    about_x: 0.0,
                    about_y: angle,
                });
            }
            Self::Payload { mass, distance } => mechanism.bodies.push(Body {
                mass,
                distance,
                angle: 0.0,
                // A compact body of steel: a few centimetres.
                inertia: mass * 4.0e-4,
            }),
            Self::Spring { stiffness, rest } => {
                mechanism.spring = Some(Spring {
                    stiffness,
                    rest: config.sensors.encoder.zero + rest,
                });
            }
            Self::DriveDeadzone { voltage } => {
                config.bridge.dead_time = Some(DeadTime {
                    voltage,
                    fade_current: 0.1,
                });
            }
            Self::TorqueOffset { torque } => mechanism.torque_offset = Some(torque),
        }
    }
}
