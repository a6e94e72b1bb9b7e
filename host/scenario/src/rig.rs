//! The rig of the scenarios and the description that its owner has.
//!
//! A 24 V geared arm, as large as the reference rig of the catalogue: ratio 50, reflected rotor 0.05 kg·m², link
//! 0.15 kg·m², gravity 3.4 N·m, viscous 0.25 N·m·s/rad and Coulomb friction 0.8 N·m, three quarters of both before the gear.

use std::f64::consts::FRAC_PI_2;

use super::dice::Dice;
use super::error::ScenarioError;
use rig_model::robot::{JointFriction, ONE_LINK_TEMPLATE, Robot};
use rig_plant::effect::disturbance::Disturbance;
use rig_plant::{Body, Friction, LinkEncoder, PlantConfig, Presliding};

/// Ticks of the rig per second, Hz. One tick is also the resolution of a delay.
pub(super) const TICK_RATE: f64 = 10_000.0;
/// Integration substeps per tick. A test compares the results with those of ten substeps.
pub(super) const SUBSTEPS: u32 = 2;
/// Presliding stroke of a rig without the presliding effect, rad: below one count of the encoder.
const STROKE: f64 = 2.0e-5;
/// Share of friction that acts before the gear.
const BEFORE_GEAR: f64 = 0.75;
/// Hanging position of the link in the plant's angle, rad.
const HANGING: f64 = -FRAC_PI_2;
/// Largest relative deviation of a rig's parameters from the reference.
const SPREAD: f64 = 0.1;

/// The optional encoder on the link: absolute, 17 bits, half a count of noise, with an arbitrary zero.
pub(super) const LINK_ENCODER: LinkEncoder = LinkEncoder {
    counts_per_turn: 131_072.0,
    zero: HANGING + 0.2,
    noise: Some(2.4e-5),
    eccentricity: None,
};

/// Kind of rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rig {
    /// A geared link in a vertical plane.
    #[default]
    OneLink,
}

/// Noise of the sensors and disturbance torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Noise of one current sample, A rms.
    pub current: f64,
    /// Coloured disturbance torque on the joint, N·m rms.
    pub disturbance: f64,
    /// Correlation time of the disturbance, s.
    pub correlation: f64,
    /// Encoder counts per motor turn.
    pub counts: f64,
}

impl Noise {
    /// Medium noise: 0.05 A per sample, about 0.1 N·m at 2.5 N·m/A.
    pub const MEDIUM: Self = Self {
        current: 0.05,
        disturbance: 0.03,
        correlation: 0.05,
        counts: 4096.0,
    };
    /// Low noise: a good current sensor.
    pub const LOW: Self = Self {
        current: 0.02,
        ..Self::MEDIUM
    };
    /// High noise: a poor current sensor.
    pub const HIGH: Self = Self {
        current: 0.2,
        ..Self::MEDIUM
    };
    /// No noise and 16 times finer counts, to measure the residual of an effect alone.
    pub(super) const NONE: Self = Self {
        current: 0.0,
        disturbance: 0.0,
        correlation: 0.05,
        counts: 65536.0,
    };
    /// The three levels of the benchmark.
    pub const LEVELS: [(&str, Self); 3] = [
        ("low", Self::LOW),
        ("medium", Self::MEDIUM),
        ("high", Self::HIGH),
    ];
}

/// Returns a rig near the reference without hidden effects.
pub(super) fn healthy(seed: u64, noise: &Noise) -> PlantConfig {
    let mut dice = Dice::new(seed, 0);
    let mut near = |value: f64| value * dice.uniform(1.0 - SPREAD, 1.0 + SPREAD);
    let mut config = PlantConfig {
        tick: 1.0 / TICK_RATE,
        substeps: SUBSTEPS,
        initial_position: HANGING,
        ..PlantConfig::default()
    };

    let ratio = 50.0;
    let motor = &mut config.motor;
    motor.torque_constant = near(0.05);
    motor.resistance = near(0.6);
    motor.inductance = near(0.5e-3);
    motor.rotor_inertia = near(2.0e-5);
    let (coulomb, viscous) = (near(0.8), near(0.25));
    let presliding = Presliding {
        stroke: STROKE,
        damping_time: 1.0e-3,
        lag: 1.0e-3,
    };
    let link = Friction {
        coulomb: (1.0 - BEFORE_GEAR) * coulomb,
        viscous: (1.0 - BEFORE_GEAR) * viscous,
        asymmetry: 0.0,
        weakening: None,
        presliding,
        load: None,
        position: None,
        drag: None,
    };
    motor.friction = Friction {
        coulomb: BEFORE_GEAR * coulomb / ratio,
        viscous: BEFORE_GEAR * viscous / (ratio * ratio),
        presliding: Presliding {
            stroke: STROKE * ratio,
            ..presliding
        },
        ..link
    };

    let mechanism = &mut config.mechanism;
    mechanism.ratio = ratio;
    mechanism.friction = link;
    mechanism.bodies = vec![Body {
        mass: near(1.155),
        distance: near(0.3),
        angle: 0.0,
        inertia: near(0.046),
    }];
    mechanism.disturbance = (noise.disturbance > 0.0).then_some(Disturbance {
        std: noise.disturbance,
        correlation_time: noise.correlation,
    });

    let sensors = &mut config.sensors;
    sensors.encoder.counts_per_turn = noise.counts;
    sensors.encoder.zero = HANGING;
    sensors.current.noise = (noise.current > 0.0).then_some(noise.current);
    sensors.current.offset = 0.0;
    config
}

/// Returns the description that the owner of the rig has: parameters with three digits, angle from the hanging
/// position. `error` is the relative standard deviation of the errors in its values.
///
/// # Errors
/// The template cannot be read.
pub(super) fn description(
    config: &PlantConfig,
    error: f64,
    seed: u64,
) -> Result<Robot, ScenarioError> {
    let unreadable = |what: &dyn std::fmt::Display| ScenarioError(what.to_string());
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())
        .map_err(|error| unreadable(&error))?;
    let mut dice = Dice::new(seed, 1);
    let mut written = |value: f64| three_digits(value * (1.0 + error * dice.normal()).abs());
    let equivalent = config.equivalent();
    let ratio = config.mechanism.ratio;
    let rotor = config.motor.rotor_inertia;
    let load = equivalent.inertia - ratio * ratio * rotor;
    let mass: f64 = config.mechanism.bodies.iter().map(|b| b.mass).sum();
    let moment: f64 = config
        .mechanism
        .bodies
        .iter()
        .map(|b| b.mass * b.distance)
        .sum();
    let Some(joint) = robot.joints.first_mut() else {
        return Err(unreadable(&"the template has no joint"));
    };
    joint.theta = HANGING;
    if let Some(inertial) = &mut joint.inertial {
        inertial.mass = written(mass);
        inertial.first_moment = [written(moment), 0.0, 0.0];
        inertial.inertia[5] = written(load);
    }
    if let Some(limits) = &mut joint.limits {
        limits.position = [-1.7, 1.7];
    }
    joint.friction = Some(JointFriction {
        coulomb: written(equivalent.coulomb),
        viscous: written(equivalent.viscous),
        offset: 0.0,
    });
    if let Some(drive) = &mut joint.drive {
        drive.gear_ratio = ratio;
        drive.rotor_inertia = written(rotor);
        // Exact, because an error of the torque constant would scale all torques and parameters by one factor.
        drive.torque_constant = three_digits(config.motor.torque_constant);
        drive.resistance = Some(three_digits(config.motor.resistance));
        drive.inductance = Some(three_digits(config.motor.inductance));
        drive.encoder_counts_per_rev = Some(config.sensors.encoder.counts_per_turn);
    }
    Ok(robot)
}

fn three_digits(value: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let unit = 10f64.powf(value.abs().log10().floor() - 2.0);
    // Dividing by the whole inverse gives 0.799 instead of 0.7990000000000001.
    if unit < 1.0 {
        let inverse = (1.0 / unit).round();
        (value * inverse).round() / inverse
    } else {
        (value / unit).round() * unit
    }
}
