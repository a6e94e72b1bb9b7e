//! Recordings of the emulated rig, whose two masses share no equation with this crate.

use std::f64::consts::{FRAC_PI_2, TAU};

use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_firmware::sample::Command;
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
use rig_plant::effect::transmission::{Backlash, Elasticity};
use rig_plant::{LinkEncoder, Plant, PlantConfig};
use rig_shared::units::Duty;

/// Rows per second.
pub(super) const RATE: f64 = 1000.0;
/// Control periods per row.
const TICKS: usize = 4;
/// Angle of the plant at which the encoders read 0: hanging.
const HANGING: f64 = -FRAC_PI_2;

/// A rig and how it is driven.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    pub config: PlantConfig,
    /// Natural frequency of the position loop, Hz.
    pub bandwidth: f64,
}

impl Rig {
    /// The rig of the documentation with an elastic gear: link 0.12 kg·m², motor 0.05 kg·m².
    pub(super) fn new(stiffness: f64, damping: f64) -> Self {
        let mut config = PlantConfig {
            tick: 1.0 / (RATE * TICKS as f64),
            substeps: 4,
            initial_position: HANGING,
            ..PlantConfig::default()
        };
        config.mechanism.elasticity = Some(Elasticity {
            stiffness,
            hardening: 0.0,
            damping,
        });
        config.mechanism.end_stops = None;
        config.bridge.supply = 48.0;
        config.sensors.encoder.zero = HANGING;
        config.sensors.current.offset = 0.0;
        config.sensors.link_encoder = Some(LinkEncoder {
            counts_per_turn: 1_048_576.0,
            zero: HANGING + 0.3,
            noise: Some(5e-6),
            eccentricity: None,
        });
        Self {
            config,
            bandwidth: 12.0,
        }
    }

    /// Plain Coulomb friction on motor and link: no weakening with the speed, almost no presliding.
    pub(super) fn with_plain_friction(mut self) -> Self {
        let ratio = self.config.mechanism.ratio;
        self.config.motor.friction.weakening = None;
        self.config.motor.friction.presliding.stroke = 2e-5 * ratio;
        self.config.mechanism.friction.weakening = None;
        self.config.mechanism.friction.presliding.stroke = 2e-5;
        self
    }

    pub(super) fn with_gap(mut self, gap: f64) -> Self {
        self.config.mechanism.backlash = Some(Backlash {
            gap,
            stiffness: 1e9,
            damping: 1e3,
        });
        self
    }

    /// The description of the rig: rigid.
    pub(super) fn robot(&self) -> Robot {
        let text = ONE_LINK_TEMPLATE.replace("theta = 0.0 ", "theta = -1.5707963267948966 ");
        Robot::from_toml(&text, "rig.toml".as_ref()).unwrap()
    }

    /// Runs the position loop along a reference (rad from hanging), with a torque on the link from outside, N·m.
    pub(super) fn run(
        &self,
        seconds: f64,
        reference: impl Fn(f64) -> f64,
        external: impl Fn(f64) -> f64,
        seed: u64,
    ) -> Block {
        let config = &self.config;
        let (motor, ratio) = (&config.motor, config.mechanism.ratio);
        let constant = motor.torque_constant * ratio;
        let scaling = config.sensors.scaling;
        let count = TAU / (config.sensors.encoder.counts_per_turn * ratio);
        let natural = TAU * self.bandwidth;
        let inertia = 0.17;
        let mut plant = Plant::new(config.clone(), seed);
        let mut command = Command {
            duty: Duty(0.0),
            bridge: true,
        };
        let (mut position, mut last, mut before, mut speed) = (0i64, 0u16, 0.0, 0.0);
        let mut joint = JointColumns::default();
        let (mut link, mut refs) = (Vec::new(), Vec::new());
        let mut block = Block {
            first_line: 2,
            ..Block::default()
        };
        let rows = (seconds * RATE) as usize;
        for row in 0..rows {
            let t = row as f64 / RATE;
            plant.faults_mut().external_torque = external(t);
            let mut sample = plant.advance(command);
            for _ in 1..TICKS {
                sample = plant.advance(command);
            }
            position += i64::from(sample.encoder.0.wrapping_sub(last) as i16);
            last = sample.encoder.0;
            let q = position as f64 * count;
            speed += 0.6 * ((q - before) * RATE - speed);
            before = q;
            let code = f64::from(sample.current.0) - f64::from(scaling.current_zero);
            let current = code * f64::from(scaling.current_per_code);
            let wanted = reference(t);
            let rate = (reference(t + 1e-4) - reference(t - 1e-4)) / 2e-4;
            let torque = inertia * natural * (natural * (wanted - q) + 1.4 * (rate - speed))
                + 2.94 * wanted.sin();
            let voltage = motor.resistance * torque / constant + constant * speed;
            command.duty = Duty((voltage / config.bridge.supply).clamp(-1.0, 1.0) as f32);
            block.t.push(t);
            joint.q.push(q);
            joint.tau.push(current * constant);
            link.push(plant.link_angle().unwrap_or(0.0));
            refs.push(wanted);
        }
        joint.link = Some(link);
        joint.reference = Some(refs);
        block.joints = vec![joint];
        block
    }
}

/// A recording of one block.
pub(super) fn recording(block: Block) -> InMemory {
    InMemory {
        label: "rig.csv".into(),
        blocks: vec![block],
    }
}

/// A chirp from rest to rest about `centre`, rad: amplitude in velocity is even, rad/s.
pub(super) fn chirp(
    seconds: f64,
    [low, high]: [f64; 2],
    speed: f64,
    centre: f64,
) -> impl Fn(f64) -> f64 {
    let start = 1.0;
    let length = seconds - 2.0;
    move |t: f64| {
        let at = (t - start).clamp(0.0, length);
        let phase = TAU * (low * at + 0.5 * (high - low) * at * at / length);
        let frequency = low + (high - low) * at / length;
        let edge = (at.min(length - at) / 0.5).clamp(0.0, 1.0);
        let fade = edge * edge * (3.0 - 2.0 * edge);
        centre + fade * speed / (TAU * frequency) * phase.sin()
    }
}
