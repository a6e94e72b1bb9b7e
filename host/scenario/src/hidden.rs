//! Hidden effects of the emulated rig and their parameters.

use serde::Serialize;

use super::rig::TICK_RATE;
use rig_plant::effect::cogging::Cogging;
use rig_plant::effect::dead_time::DeadTime;
use rig_plant::effect::drag::QuadraticDrag;
use rig_plant::effect::encoder_eccentricity::EncoderEccentricity;
use rig_plant::effect::friction_warmup::FrictionWarmup;
use rig_plant::effect::gear_eccentricity::GearEccentricity;
use rig_plant::effect::load_friction::LoadFriction;
use rig_plant::effect::position_friction::PositionFriction;
use rig_plant::effect::spring::Spring;
use rig_plant::effect::tilt::Tilt;
use rig_plant::effect::torque_ripple::TorqueRipple;
use rig_plant::effect::torque_saturation::TorqueSaturation;
use rig_plant::effect::transmission::{Backlash, Elasticity};
use rig_plant::{Body, PlantConfig, VelocityWeakening};

/// Mean friction power in the motions of the scenarios, W: 0.8 N·m and 0.25 N·m·s/rad at about 0.7 rad/s.
const FRICTION_POWER: f64 = 0.7;
/// Temperature rise of the gear at that power, K. Only its product with the temperature rate of the friction matters.
const WARMING: f64 = 10.0;
/// Contact stiffness of backlash, N·m/rad, and its damping, N·m·s/rad.
const TEETH: [f64; 2] = [3000.0, 2.0];

/// An effect with its drawn parameters, by the equations of the emulated rig.
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
    /// Torque proportional to the square of speed.
    QuadraticDrag {
        /// N·m·s²/rad²
        coefficient: f64,
    },
    /// Friction proportional to the transmitted torque.
    LoadFriction {
        /// N·m per N·m
        ratio: f64,
    },
    /// Friction that varies with the joint position.
    PositionFriction {
        /// Relative.
        amplitude: f64,
        /// Per turn of the joint.
        order: f64,
        /// rad
        phase: f64,
    },
    /// Presliding: contacts deform before they slide (four Maxwell-slip elements).
    Presliding {
        /// Travel from rest to sliding, rad.
        stroke: f64,
    },
    /// Viscous friction that decreases as friction heats the gear.
    ViscousWarmup {
        /// Final relative decrease.
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
    /// Ripple of the torque constant over the motor angle.
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
    /// Backlash between rotor and link.
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
    /// Eccentric encoder disc.
    EncoderEccentricity {
        /// rad of the motor
        amplitude: f64,
        /// rad
        phase: f64,
    },
    /// Offset of the current sensor.
    CurrentOffset {
        /// A
        current: f64,
    },
    /// Torque constant that falls with the current as 1/(1 + (i/knee)²).
    TorqueSaturation {
        /// Share lost at the current of the torque limit.
        loss: f64,
    },
    /// Delay of the current measurement.
    MeasurementDelay {
        /// s, whole tenths of a millisecond
        delay: f64,
    },
    /// Tilted base.
    GravityTilt {
        /// rad
        angle: f64,
    },
    /// A body on the link that the description does not have.
    Payload {
        /// kg
        mass: f64,
        /// From the joint's axis, m.
        distance: f64,
    },
    /// Spring torque, for example of a cable.
    Spring {
        /// N·m/rad
        stiffness: f64,
        /// Angle from the hanging position at which the spring torque is zero, rad.
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

/// Returns a compact steel body of a few centimetres on the link.
pub fn payload(mass: f64, distance: f64) -> Body {
    Body {
        mass,
        distance,
        angle: 0.0,
        inertia: mass * 4.0e-4,
    }
}

/// An effect in one joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hidden {
    /// Index of the joint.
    pub joint: usize,
    /// Effect.
    pub effect: Effect,
}

impl Effect {
    /// Current at the rig's torque limit of 8 N·m, A.
    pub const PEAK_CURRENT: f64 = 3.2;

    /// Name in results and descriptions.
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

    /// Adds the effect to the rig.
    pub(super) fn hide(&self, config: &mut PlantConfig) {
        let ratio = config.mechanism.ratio;
        let motor = &mut config.motor;
        let mechanism = &mut config.mechanism;
        match *self {
            Self::Stribeck { .. }
            | Self::AsymmetricCoulomb { .. }
            | Self::QuadraticDrag { .. }
            | Self::LoadFriction { .. }
            | Self::PositionFriction { .. }
            | Self::Presliding { .. }
            | Self::ViscousWarmup { .. } => self.hide_in_friction(config),
            Self::GearEccentricity { .. }
            | Self::Backlash { .. }
            | Self::JointElasticity { .. } => self.hide_in_gear(config),
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
            Self::Payload { mass, distance } => mechanism.bodies.push(payload(mass, distance)),
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

    /// Adds an effect of the friction on both sides of the gear.
    fn hide_in_friction(&self, config: &mut PlantConfig) {
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
            _ => {}
        }
    }

    /// Adds an effect of the gear between rotor and link.
    fn hide_in_gear(&self, config: &mut PlantConfig) {
        let mechanism = &mut config.mechanism;
        match *self {
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
            _ => {}
        }
    }
}
