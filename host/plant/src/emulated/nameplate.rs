//! Converts a robot description to the configuration of the firmware.

use core::f64::consts::FRAC_PI_2;

use rig_firmware::config::{Config, Encoder, Rates, Settings};
use rig_firmware::nameplate::SENSE_SETTLING_NS;
use rig_firmware::report_sender::greeting;
use rig_shared::compensation::{EFFECTS, Effects};
use rig_shared::control::{ControlKind, Gains};
use rig_shared::drive::Drive;
use rig_shared::estimation::EstimatorSettings;
use rig_shared::friction::Friction;
use rig_shared::link::LinkParameters;
use rig_shared::multibody::{gravity_vector, inertia_matrix};
use rig_shared::precompensation::PrecompensationSettings;
use rig_shared::safety::Limits;
use rig_shared::wire::message::Greeting;
use thiserror::Error;

use crate::Hardware;
use rig_model::robot::{Joint, JointKind, Robot};
use rig_model::simulate::{Model, SimulateError};

/// Natural frequency of the position loop, Hz: the current loop, ten times as fast, stays below a twentieth of the 10
/// kHz control rate.
const POSITION_BANDWIDTH: f64 = 6.0;
/// Bandwidth of the velocity observer, Hz: far above the position loop, so that its phase lag has no effect.
const OBSERVER_BANDWIDTH: f32 = 200.0;
/// Speed below which the measured velocity does not determine the direction, rad/s.
const DIRECTION_THRESHOLD: f32 = 0.01;

/// Speed above which the on-line estimator assumes only Coulomb and viscous friction, rad/s. Friction of geared servo
/// drives decreases with speed up to some 0.05 to 0.1 rad/s at the joint. The parameters fc and fv would absorb the
/// tail. If half of the excess vanishes at 0.025 rad/s, 1.5 % of it remains at 0.2 rad/s; at 0.05 rad/s a fifth
/// remains. An excitation at 1 to 3 rad/s loses a tenth of its samples by this threshold.
const SLIP_VELOCITY: f32 = 0.2;

/// Reason why a description does not define a one-link rig.
#[derive(Debug, Error)]
pub enum NameplateError {
    /// A number of joints other than one.
    #[error(
        "the one-link rig has one joint, but \"{robot}\" has {joints}: give the description of a one-link rig (`rig init one-link` writes one)."
    )]
    JointCount {
        /// Name of the robot.
        robot: String,
        /// Joints it has.
        joints: usize,
    },
    /// More effects than a rig can compensate.
    #[error(
        "{robot} has {effects} effects, but the rig compensates at most {EFFECTS}; leave the smallest out."
    )]
    TooManyEffects {
        /// Name of the robot.
        robot: String,
        /// Effects it has.
        effects: usize,
    },
    /// An effect that the rig refuses.
    #[error("{robot}: the rig does not take an effect: {what}.")]
    UnusableEffect {
        /// Name of the robot.
        robot: String,
        /// The effect and the reason.
        what: String,
    },
    /// Effects that the rig cannot compensate.
    #[error(
        "{robot} has effects that the rig cannot compensate: {}; leave them out with --leave-out.", left_out.join("; ")
    )]
    NotCompensable {
        /// Name of the robot.
        robot: String,
        /// Effects and reasons: a sentence each.
        left_out: Vec<String>,
    },
    /// A joint that is not revolute.
    #[error("joint \"{0}\" is prismatic: the rig's link turns, so its kind must be \"revolute\".")]
    Prismatic(String),
    /// A drive without a single constant gear ratio.
    #[error(
        "the drive of joint \"{joint}\" {what}: the firmware of the one-link rig knows one gear ratio only; give drive.gear_ratio a finite value other than 0, and no drive.screw or drive.couples."
    )]
    Drive {
        /// Name of the joint.
        joint: String,
        /// The obstacle.
        what: String,
    },
    /// A missing value that the firmware needs.
    #[error("joint \"{joint}\" has no {what}: the firmware needs it to run the rig.")]
    Missing {
        /// Name of the joint.
        joint: String,
        /// Name and key of the missing value.
        what: &'static str,
    },
    /// Hardware other than that the rig's firmware was built for.
    #[error(
        "the firmware of the rig was built for {what} = {rig}, but joint \"{joint}\" of the description has {described}: every position or torque would be wrong by this ratio. Correct the description if the rig is right; otherwise build the firmware for this drive (docs/firmware.md)."
    )]
    OtherHardware {
        /// Name of the joint.
        joint: String,
        /// Key of the value.
        what: &'static str,
        /// The rig's value.
        rig: f32,
        /// The described value.
        described: f32,
    },
    /// An error of the feed-forward model.
    #[error(transparent)]
    Model(#[from] SimulateError),
}

/// Values for the firmware at its start: fixed configuration, and settings that the host may replace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nameplate {
    /// Fixed while the rig runs.
    pub config: Config,
    /// Replaceable over the wire.
    pub settings: Settings,
}

impl Nameplate {
    /// Builds the nameplate of a one-link rig.
    ///
    /// # Errors
    /// [`NameplateError`] naming the missing value.
    pub fn from_robot(robot: &Robot) -> Result<Self, NameplateError> {
        let [joint] = robot.joints.as_slice() else {
            return Err(NameplateError::JointCount {
                robot: robot.name.clone(),
                joints: robot.joints.len(),
            });
        };
        if joint.kind == JointKind::Prismatic {
            return Err(NameplateError::Prismatic(joint.name.clone()));
        }
        let drive = joint
            .drive
            .as_ref()
            .ok_or_else(|| NameplateError::Missing {
                joint: joint.name.clone(),
                what: "[joint.drive]",
            })?;
        let unfit = |what: String| NameplateError::Drive {
            joint: joint.name.clone(),
            what,
        };
        if drive.screw.is_some() {
            return Err(unfit("turns by a screw, at a changing ratio".into()));
        }
        if drive.couples.values().any(|ratio| *ratio != 0.0) {
            return Err(unfit("is coupled to a joint".into()));
        }
        if drive.gear_ratio == 0.0 || !drive.gear_ratio.is_finite() {
            return Err(unfit(format!("has gear_ratio = {}", drive.gear_ratio)));
        }
        let rates = Rates::default();
        let hardware = hardware_of(robot)?;
        let limits = limits(joint, drive)?;
        let model = link_parameters(robot)?;
        let parts = Drive {
            gear_ratio: hardware.gear_ratio as f32,
            rotor_inertia: hardware.rotor_inertia as f32,
            torque_constant: hardware.torque_constant as f32,
            resistance: hardware.resistance as f32,
            inductance: hardware.inductance as f32,
        };
        let encoder = Encoder {
            counts_per_motor_turn: hardware.counts_per_turn as u32,
            observer_bandwidth: OBSERVER_BANDWIDTH,
            index_levels: 0b00,
        };
        let config = Config::new(rates, parts, encoder, &limits, SENSE_SETTLING_NS);
        let gains = Gains::design(f64::from(model.inertia), POSITION_BANDWIDTH, 1.0);
        let settings = Settings {
            control: ControlKind::ProportionalDerivative,
            gains: Gains {
                proportional: gains.proportional as f32,
                derivative: gains.derivative as f32,
                adaptation: gains.adaptation as f32,
                // A twentieth of the control rate is the maximum with the one-period delay.
                current_bandwidth: rates.control_hz as f32 / 20.0,
            },
            model,
            friction: friction(joint),
            precompensation: PrecompensationSettings {
                enabled: false,
                gain: 0.95,
                gain_at_rest: 0.8,
                velocity_threshold: DIRECTION_THRESHOLD,
            },
            effects: Effects::default(),
            limits,
            estimator: estimator(&model, &limits),
        };
        Ok(Self { config, settings })
    }
}

/// Compares a description with the hardware that a rig's firmware was built for.
///
/// # Errors
/// [`NameplateError::OtherHardware`], or as [`Nameplate::from_robot`].
pub fn check_hardware(robot: &Robot, greeting: &Greeting) -> Result<(), NameplateError> {
    let own = self::greeting(&Nameplate::from_robot(robot)?.config);
    let values = |of: &Greeting| {
        [
            ("encoder_counts_per_rev", of.counts_per_motor_turn as f32),
            ("gear_ratio", of.gear_ratio),
            ("torque_constant", of.torque_constant),
        ]
    };
    let pairs = values(greeting).into_iter().zip(values(&own));
    let mut pairs = pairs.map(|((what, rig), (_, described))| (what, rig, described));
    // The firmware's build reads the same text to the same digits.
    let differ =
        |(_, rig, described): &(_, f32, f32)| !((rig - described).abs() <= 1e-6 * rig.abs());
    match pairs.find(differ) {
        None => Ok(()),
        Some((what, rig, described)) => Err(NameplateError::OtherHardware {
            joint: robot
                .joints
                .first()
                .map_or_else(String::new, |j| j.name.clone()),
            what,
            rig,
            described,
        }),
    }
}

/// Returns the described drive and encoder of the first joint, for the emulated rig.
///
/// # Errors
/// [`NameplateError::Missing`] naming the missing value.
pub fn hardware_of(robot: &Robot) -> Result<Hardware, NameplateError> {
    let joint = robot.joints.first().ok_or(NameplateError::JointCount {
        robot: robot.name.clone(),
        joints: 0,
    })?;
    let missing = |what| NameplateError::Missing {
        joint: joint.name.clone(),
        what,
    };
    let stated = |value: Option<f64>, what| value.ok_or_else(|| missing(what));
    let drive = joint
        .drive
        .as_ref()
        .ok_or_else(|| missing("[joint.drive]"))?;
    // A torque constant of 0 means unknown.
    let constant = Some(drive.torque_constant).filter(|constant| *constant != 0.0);
    Ok(Hardware {
        gear_ratio: drive.gear_ratio,
        counts_per_turn: stated(drive.encoder_counts_per_rev, "drive.encoder_counts_per_rev")?
            .trunc(),
        torque_constant: stated(constant, "drive.torque_constant")?,
        resistance: stated(drive.resistance, "drive.resistance")?,
        inductance: stated(drive.inductance, "drive.inductance")?,
        rotor_inertia: drive.rotor_inertia,
    })
}

/// Returns the six one-link parameters of a description.
///
/// # Errors
/// [`NameplateError::Model`] if the description defines no chain, [`NameplateError::Missing`] without inertia.
pub fn link_parameters(robot: &Robot) -> Result<LinkParameters<f32>, NameplateError> {
    let model = Model::from_robot(robot)?;
    let mut inertia = [0.0];
    let (mut at_zero, mut at_quarter) = ([0.0], [0.0]);
    let numbers = |result: Result<(), rig_shared::multibody::MultibodyError>| {
        result.map_err(|error| NameplateError::Model(SimulateError::Multibody(error)))
    };
    numbers(inertia_matrix(
        &model.chain,
        &model.parameters,
        &[0.0],
        &mut inertia,
    ))?;
    numbers(gravity_vector(
        &model.chain,
        &model.parameters,
        &[0.0],
        &mut at_zero,
    ))?;
    numbers(gravity_vector(
        &model.chain,
        &model.parameters,
        &[FRAC_PI_2],
        &mut at_quarter,
    ))?;
    if inertia[0].is_nan() || inertia[0] <= 0.0 {
        let joint = robot
            .joints
            .first()
            .map(|joint| joint.name.clone())
            .unwrap_or_default();
        return Err(NameplateError::Missing {
            joint,
            what: "[joint.inertial] or drive.rotor_inertia",
        });
    }
    let [.., viscous, coulomb, offset] = model.parameters[0];
    Ok(LinkParameters {
        inertia: inertia[0] as f32,
        gravity_cos: at_zero[0] as f32,
        gravity_sin: at_quarter[0] as f32,
        viscous: viscous as f32,
        coulomb: coulomb as f32,
        offset: offset as f32,
    })
}

fn limits(joint: &Joint, drive: &rig_model::robot::Drive) -> Result<Limits<f32>, NameplateError> {
    let missing = |what| NameplateError::Missing {
        joint: joint.name.clone(),
        what,
    };
    let limits = joint
        .limits
        .as_ref()
        .ok_or_else(|| missing("[joint.limits]"))?;
    let torque = limits.torque.ok_or_else(|| missing("limits.torque"))?;
    let peak = torque / (drive.torque_constant * drive.gear_ratio).abs();
    Ok(Limits {
        position_low: limits.position[0] as f32,
        position_high: limits.position[1] as f32,
        velocity: limits
            .known_velocity()
            .ok_or_else(|| missing("limits.velocity"))? as f32,
        acceleration: limits
            .acceleration
            .ok_or_else(|| missing("limits.acceleration"))? as f32,
        torque: torque as f32,
        // The description has one torque; a small motor withstands about half of its peak current continuously.
        continuous_current: (0.5 * peak) as f32,
        peak_current: peak as f32,
    })
}

fn friction(joint: &Joint) -> Friction<f32> {
    let prior = joint.friction.clone().unwrap_or_default();
    Friction {
        coulomb: prior.coulomb as f32,
        viscous: prior.viscous as f32,
        ..Friction::default()
    }
}

/// Returns bounds wide enough for any error of the description, narrow enough to detect a divergent estimate.
fn estimator(model: &LinkParameters<f32>, limits: &Limits<f32>) -> EstimatorSettings<f32> {
    let torque = limits.torque;
    let lower = [
        0.1 * model.inertia,
        -torque,
        -torque,
        0.0,
        0.0,
        -0.5 * torque,
    ];
    let upper = [
        10.0 * model.inertia,
        torque,
        torque,
        torque / limits.velocity * 4.0,
        0.5 * torque,
        0.5 * torque,
    ];
    EstimatorSettings {
        slip_velocity: SLIP_VELOCITY,
        ..EstimatorSettings::for_band(lower, upper)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rig_firmware::nameplate::one_link;
    use rig_model::robot::ONE_LINK_TEMPLATE;
    use std::path::Path;

    #[test]
    fn a_drive_without_one_ratio_is_refused() {
        let robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
        let arm =
            Robot::from_toml(rig_model::robot::IRP6_TEMPLATE, Path::new("irp6.toml")).unwrap();
        let screw = arm
            .joints
            .iter()
            .find_map(|j| j.drive.as_ref()?.screw.clone())
            .unwrap();
        let refused = |change: &dyn Fn(&mut rig_model::robot::Drive)| {
            let mut robot = robot.clone();
            change(robot.joints[0].drive.as_mut().unwrap());
            Nameplate::from_robot(&robot).unwrap_err().to_string()
        };
        let by_screw = refused(&|d| {
            d.gear_ratio = 0.0;
            d.screw = Some(screw.clone());
        });
        assert!(
            by_screw.contains("screw, at a changing ratio"),
            "{by_screw}"
        );
        let by_ratio = refused(&|d| d.gear_ratio = 0.0);
        assert!(by_ratio.contains("gear_ratio = 0"), "{by_ratio}");
    }

    /// The firmware counts with its own drive: another description makes wrong positions or torques.
    #[test]
    fn a_description_of_another_drive_is_refused_by_value() {
        let robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
        let (config, _) = one_link();
        let greeting = greeting(&config);
        check_hardware(&robot, &greeting).unwrap();
        let refused = |change: &dyn Fn(&mut rig_model::robot::Drive)| {
            let mut robot = robot.clone();
            change(robot.joints[0].drive.as_mut().unwrap());
            check_hardware(&robot, &greeting).unwrap_err().to_string()
        };
        let gear = refused(&|d| d.gear_ratio = 100.0);
        assert!(
            gear.contains("gear_ratio = 50") && gear.contains("has 100"),
            "{gear}"
        );
        assert!(refused(&|d| d.gear_ratio = -50.0).contains("has -50"));
        assert!(refused(&|d| d.encoder_counts_per_rev = Some(4096.0)).contains("has 4096"));
        assert!(refused(&|d| d.torque_constant *= 1.01).contains("torque_constant = 0.05"));
    }

    /// With the template, the emulated rig equals that of the documentation bit by bit.
    #[test]
    fn the_templates_drive_is_the_emulated_rigs_own() {
        use crate::{Hardware, PlantConfig};
        let robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
        let hardware = hardware_of(&robot).unwrap();
        assert_eq!(hardware, Hardware::default());
        for seed in 0..20 {
            assert_eq!(
                PlantConfig::laboratory_with(&hardware, seed),
                PlantConfig::laboratory(seed)
            );
        }
        // Another drive: the same link and friction at the joint.
        let own = PlantConfig::laboratory(3).equivalent();
        for gear_ratio in [-50.0, 7.5, 160.0] {
            let other = Hardware {
                gear_ratio,
                rotor_inertia: 2.0e-5 * (50.0 / gear_ratio) * (50.0 / gear_ratio),
                ..hardware
            };
            let other = PlantConfig::laboratory_with(&other, 3).equivalent();
            for (a, b) in own.to_array().into_iter().zip(other.to_array()).take(5) {
                assert!((a - b).abs() < 1e-9, "{gear_ratio}: {own:?} {other:?}");
            }
        }
    }

    #[test]
    fn values_of_the_drive_that_are_missing_are_named() {
        let template = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
        let missing = |change: &dyn Fn(&mut rig_model::robot::Drive)| {
            let mut robot = template.clone();
            change(robot.joints[0].drive.as_mut().unwrap());
            hardware_of(&robot).unwrap_err().to_string()
        };
        assert!(missing(&|d| d.torque_constant = 0.0).contains("drive.torque_constant"));
        assert!(missing(&|d| d.resistance = None).contains("drive.resistance"));
        assert!(
            missing(&|d| d.encoder_counts_per_rev = None).contains("drive.encoder_counts_per_rev")
        );
    }

    /// The board and the emulated rig must start equally: otherwise their recordings would differ.
    #[test]
    fn the_board_is_told_what_the_template_says() {
        let robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap();
        let told = Nameplate::from_robot(&robot).unwrap();
        let (config, mut settings) = one_link();
        assert_eq!(config, told.config);
        // The axis in the description is tilted by a rounded π/2.
        assert!((settings.model.gravity_sin - told.settings.model.gravity_sin).abs() < 1e-12);
        settings.model.gravity_sin = told.settings.model.gravity_sin;
        for (board, host) in [
            (
                settings.gains.proportional,
                told.settings.gains.proportional,
            ),
            (settings.gains.derivative, told.settings.gains.derivative),
            (settings.gains.adaptation, told.settings.gains.adaptation),
        ] {
            assert!((board - host).abs() <= 1e-6 * host, "{board} {host}");
        }
        settings.gains = told.settings.gains;
        assert_eq!(settings, told.settings);
    }
}
