//! Configuration of an emulated rig: its true values.

use core::f64::consts::{FRAC_PI_2, PI};

use rig_firmware::sample::Scaling;

use super::body::{Body, Load};
use super::effect::cogging::Cogging;
use super::effect::dead_time::DeadTime;
use super::effect::disturbance::Disturbance;
use super::effect::encoder_eccentricity::EncoderEccentricity;
use super::effect::end_stops::EndStops;
use super::effect::friction_warmup::FrictionWarmup;
use super::effect::gear_eccentricity::GearEccentricity;
use super::effect::spring::Spring;
use super::effect::tilt::Tilt;
use super::effect::torque_ripple::TorqueRipple;
use super::effect::torque_saturation::TorqueSaturation;
use super::effect::transmission::{Backlash, Elasticity};
use super::effect::unequal_lines::UnequalLines;
use super::effect::winding_temperature::WindingTemperature;
use super::friction::{Friction, Presliding, VelocityWeakening};

/// Motor: winding, rotor and the friction of its own bearings and of the gear's input side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Ω at the nameplate temperature.
    pub resistance: f64,
    /// H.
    pub inductance: f64,
    /// N·m/A, equal to the back-EMF constant in V·s/rad.
    pub torque_constant: f64,
    /// Rotor with pinion, kg·m².
    pub rotor_inertia: f64,
    /// Friction in rotor units.
    pub friction: Friction,
    /// J/K of winding and iron.
    pub heat_capacity: f64,
    /// Winding to surroundings, K/W.
    pub thermal_resistance: f64,
    /// Change of resistance and torque constant with temperature.
    pub temperature: Option<WindingTemperature>,
    /// Detent torque.
    pub cogging: Option<Cogging>,
    /// Torque constant over the electrical angle.
    pub ripple: Option<TorqueRipple>,
    /// Torque constant over the current.
    pub saturation: Option<TorqueSaturation>,
}

/// Supply and bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// Open-circuit supply, V.
    pub supply: f64,
    /// Internal resistance of the supply, Ω; 0 for a stiff one. It takes current back as well.
    pub supply_resistance: f64,
    /// Forward drop of one free-wheeling diode, V, conducting while the bridge is off.
    pub diode_drop: f64,
    /// Error of the mean voltage.
    pub dead_time: Option<DeadTime>,
}

/// Gear and link.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism {
    /// Motor turns per joint turn.
    pub ratio: f64,
    /// Bodies that the joint carries.
    pub bodies: Vec<Body>,
    /// Gravity in the base frame, m/s².
    pub gravity: [f64; 3],
    /// Base that is not level.
    pub tilt: Option<Tilt>,
    /// Friction of the joint's own bearing, in joint units.
    pub friction: Friction,
    /// Friction that decreases with warm-up, in motor and joint.
    pub warmup: Option<FrictionWarmup>,
    /// Elastic instead of rigid gear.
    pub elasticity: Option<Elasticity>,
    /// Backlash of the gear.
    pub backlash: Option<Backlash>,
    /// Torque with the period of a motor turn.
    pub eccentricity: Option<GearEccentricity>,
    /// Cable or hose.
    pub spring: Option<Spring>,
    /// Ends of the range.
    pub end_stops: Option<EndStops>,
    /// Constant torque to overcome, N·m at the joint, with the sign of `off`.
    pub torque_offset: Option<f64>,
    /// Random torque.
    pub disturbance: Option<Disturbance>,
}

/// An analogue channel, from quantity to code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// Standard deviation of one sample, in the channel's unit.
    pub noise: Option<f64>,
    /// Constant error, in the channel's unit.
    pub offset: f64,
    /// Relative gain error.
    pub gain_error: f64,
    /// Time constant of the sense filter, s.
    pub lag: Option<f64>,
}

/// Encoder on the motor shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Counts per motor turn after quadrature.
    pub counts_per_turn: f64,
    /// Joint angle at which the counter is 0, rad.
    pub zero: f64,
    /// Once-per-turn reading error.
    pub eccentricity: Option<EncoderEccentricity>,
    /// Unevenly spaced edges.
    pub unequal_lines: Option<UnequalLines>,
    /// True if a timer captures the time of the last edge.
    pub timed: bool,
}

/// Absolute encoder on the link side of the gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkEncoder {
    /// Counts per turn of the joint.
    pub counts_per_turn: f64,
    /// Joint angle at which it reads 0, rad.
    pub zero: f64,
    /// Standard deviation of one reading before quantisation, rad.
    pub noise: Option<f64>,
    /// Reading error with the period of a joint turn.
    pub eccentricity: Option<EncoderEccentricity>,
}

/// Sensors of the rig, as inputs of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Position.
    pub encoder: Encoder,
    /// Position of the link, not available to the controller.
    pub link_encoder: Option<LinkEncoder>,
    /// Motor current.
    pub current: Channel,
    /// Supply voltage.
    pub supply: Channel,
    /// Winding temperature.
    pub temperature: Channel,
    /// Delay of the current reading in whole ticks.
    pub current_delay: Option<usize>,
    /// Nominal scaling of the codes.
    pub scaling: Scaling,
}

/// One emulated rig.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantConfig {
    /// Control period, s.
    pub tick: f64,
    /// Integration steps per control period.
    pub substeps: u32,
    /// Joint angle at start, at rest, rad.
    pub initial_position: f64,
    /// True if the link is held there by hand until the bridge is switched on.
    pub held: bool,
    /// Temperature of the surroundings and of everything at start, °C.
    pub ambient: f64,
    /// Motor.
    pub motor: Motor,
    /// Supply and bridge.
    pub bridge: Bridge,
    /// Gear and link.
    pub mechanism: Mechanism,
    /// Sensors.
    pub sensors: Sensors,
}

/// Drive and encoder as in a data sheet: the values that a description can replace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// Motor turns per joint turn, negative for a gear that reverses; not 0.
    pub gear_ratio: f64,
    /// Encoder counts per motor turn after quadrature.
    pub counts_per_turn: f64,
    /// N·m/A, equal to the back-EMF constant in V·s/rad.
    pub torque_constant: f64,
    /// Ω.
    pub resistance: f64,
    /// H.
    pub inductance: f64,
    /// Rotor with pinion, kg·m².
    pub rotor_inertia: f64,
}

impl Default for Hardware {
    /// The drive and encoder of the documentation's rig.
    fn default() -> Self {
        Self {
            gear_ratio: 50.0,
            counts_per_turn: 8192.0,
            torque_constant: 0.05,
            resistance: 0.6,
            inductance: 0.5e-3,
            rotor_inertia: 2.0e-5,
        }
    }
}

/// The six one-link parameters of this rig in steady sliding, joint-side:
/// τ = J·q̈ + gc·cos q + gs·sin q + fv·q̇ + fc·sgn q̇ + off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equivalent {
    /// Inertia with the reflected rotor, kg·m².
    pub inertia: f64,
    /// Gravity with cos q, N·m.
    pub gravity_cos: f64,
    /// Gravity with sin q, N·m.
    pub gravity_sin: f64,
    /// N·m·s/rad.
    pub viscous: f64,
    /// N·m.
    pub coulomb: f64,
    /// N·m.
    pub offset: f64,
}

impl Equivalent {
    /// Returns the parameters for an angle that is zero at the joint angle `zero`, as an incremental encoder counts it.
    pub fn about(self, zero: f64) -> Self {
        let (s, c) = zero.sin_cos();
        Self {
            gravity_cos: self.gravity_cos * c + self.gravity_sin * s,
            gravity_sin: self.gravity_sin * c - self.gravity_cos * s,
            ..self
        }
    }

    /// Returns the parameters in the order J, gc, gs, fv, fc, off.
    pub fn to_array(self) -> [f64; 6] {
        [
            self.inertia,
            self.gravity_cos,
            self.gravity_sin,
            self.viscous,
            self.coulomb,
            self.offset,
        ]
    }
}

/// Velocity weakening of the documentation's rig, at the joint.
const WEAKENING: VelocityWeakening = VelocityWeakening {
    breakaway_ratio: 1.33,
    velocity: 0.025,
};
/// Presliding of the documentation's rig, at the joint.
const PRESLIDING: Presliding = Presliding {
    stroke: 1.0e-3,
    damping_time: 1.0e-3,
    lag: 1.0e-3,
};

/// Returns the motor of the documentation's rig with another drive.
fn motor_of(hardware: &Hardware) -> Motor {
    // The sign of the gear ratio does not affect friction.
    let ratio = hardware.gear_ratio.abs();
    Motor {
        resistance: hardware.resistance,
        inductance: hardware.inductance,
        torque_constant: hardware.torque_constant,
        rotor_inertia: hardware.rotor_inertia,
        // 0.1 N·m and 0.1 N·m·s/rad of the joint's friction act on the rotor.
        friction: Friction {
            coulomb: 0.1 / ratio,
            asymmetry: 0.0,
            viscous: 0.1 / (ratio * ratio),
            weakening: Some(VelocityWeakening {
                velocity: WEAKENING.velocity * ratio,
                ..WEAKENING
            }),
            presliding: Presliding {
                stroke: PRESLIDING.stroke * ratio,
                ..PRESLIDING
            },
            load: None,
            position: None,
            drag: None,
        },
        heat_capacity: 60.0,
        thermal_resistance: 4.0,
        temperature: None,
        cogging: None,
        ripple: None,
        saturation: None,
    }
}

/// Returns gear and link of the documentation's rig with another drive.
fn mechanism_of(hardware: &Hardware) -> Mechanism {
    Mechanism {
        ratio: hardware.gear_ratio,
        bodies: vec![Body {
            mass: 1.0,
            distance: 0.3,
            angle: 0.0,
            inertia: 0.03,
        }],
        gravity: [0.0, 0.0, -9.81],
        tilt: None,
        friction: Friction {
            coulomb: 0.3,
            asymmetry: 0.0,
            viscous: 0.2,
            weakening: Some(WEAKENING),
            presliding: PRESLIDING,
            load: None,
            position: None,
            drag: None,
        },
        warmup: None,
        elasticity: None,
        backlash: None,
        eccentricity: None,
        spring: None,
        end_stops: Some(EndStops {
            range: [-1.5 * PI, 1.5 * PI],
            stiffness: 2.0e4,
            damping: 20.0,
        }),
        torque_offset: None,
        disturbance: None,
    }
}

/// Returns the sensors of the documentation's rig with another encoder.
fn sensors_of(hardware: &Hardware) -> Sensors {
    Sensors {
        encoder: Encoder {
            counts_per_turn: hardware.counts_per_turn,
            zero: -FRAC_PI_2,
            eccentricity: None,
            unequal_lines: None,
            timed: true,
        },
        link_encoder: None,
        current: Channel {
            noise: Some(0.02),
            offset: 0.03,
            gain_error: 0.0,
            lag: None,
        },
        supply: Channel {
            noise: Some(0.02),
            offset: 0.0,
            gain_error: 0.0,
            lag: None,
        },
        temperature: Channel {
            noise: Some(0.1),
            offset: 0.0,
            gain_error: 0.0,
            lag: None,
        },
        current_delay: None,
        scaling: Scaling::default(),
    }
}

impl PlantConfig {
    /// Returns the true six parameters from masses and geometry, for the joint's own angle ([`Equivalent::about`]
    /// converts them to the encoder's zero). They apply to a cold rig without payload. They exclude effects that the
    /// six cannot express (optional effects, velocity weakening, presliding).
    pub fn equivalent(&self) -> Equivalent {
        let ratio = self.mechanism.ratio;
        let load = self.load();
        let (gravity_cos, gravity_sin) = load.gravity(self.gravity());
        let motor = self.motor.friction.seen_through(ratio);
        let link = self.mechanism.friction;
        Equivalent {
            inertia: load.inertia + ratio * ratio * self.motor.rotor_inertia,
            gravity_cos,
            gravity_sin,
            viscous: motor.viscous + link.viscous,
            coulomb: motor.coulomb + link.coulomb,
            offset: motor.asymmetry * motor.coulomb
                + link.asymmetry * link.coulomb
                + self.mechanism.torque_offset.unwrap_or(0.0),
        }
    }

    /// Returns the joint-side breakaway torque of the unloaded joint in the positive and the negative direction, N·m.
    /// Both are positive and exclude gravity and offset.
    pub fn breakaway(&self) -> [f64; 2] {
        let motor = self
            .motor
            .friction
            .seen_through(self.mechanism.ratio)
            .breakaway();
        let link = self.mechanism.friction.breakaway();
        [motor[0] + link[0], motor[1] + link[1]]
    }

    /// Returns the one-link rig of the documentation with another drive and encoder: a geared 24 V motor and a 1 kg
    /// arm. It starts hanging at rest, where its incremental counter is 0. Link and friction at the joint are equal for
    /// every drive.
    pub fn with_hardware(hardware: &Hardware) -> Self {
        Self {
            tick: 1.0e-4,
            substeps: 10,
            initial_position: -FRAC_PI_2,
            held: false,
            ambient: 25.0,
            motor: motor_of(hardware),
            bridge: Bridge {
                supply: 24.0,
                supply_resistance: 0.0,
                diode_drop: 0.8,
                dead_time: None,
            },
            mechanism: mechanism_of(hardware),
            sensors: sensors_of(hardware),
        }
    }

    pub(crate) fn load(&self) -> Load {
        self.mechanism
            .bodies
            .iter()
            .fold(Load::default(), |load, body| load.add(body))
    }

    pub(crate) fn gravity(&self) -> [f64; 3] {
        self.mechanism.tilt.map_or(self.mechanism.gravity, |tilt| {
            tilt.apply(self.mechanism.gravity)
        })
    }
}

impl Default for PlantConfig {
    /// The one-link rig of the documentation: [`PlantConfig::with_hardware`] with its own drive.
    fn default() -> Self {
        Self::with_hardware(&Hardware::default())
    }
}
