//! Recordings of the rig under a position loop.
//!
//! The controller is a PD controller on the encoder reading with feed-forward of nominal gravity and inertia. It
//! converts torque to voltage with the nominal resistance and back-EMF. It has no current loop, so noise of the current
//! sensor does not act on the torque. Only the supply limits the voltage: with a limit on the commanded torque, dead
//! time would consume the whole command.

use core::f64::consts::TAU;

use rig_firmware::sample::{Command, Sample};
use rig_shared::safety::Mode;
use rig_shared::units::Duty;

use super::reference::RATE;
use super::rig::TICK_RATE;
use rig_data::{Block, JointColumns};
use rig_model::robot::Drive;
use rig_plant::{Plant, PlantConfig};

/// Natural frequency of the position loop, Hz.
const BANDWIDTH: f64 = 8.0;
/// Damping ratio of the position loop.
const DAMPING: f64 = 0.9;
/// Cut-off of the first-order filter on the differentiated encoder reading, Hz.
const SPEED_FILTER: f64 = 120.0;

/// Nominal values for the design of the controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nominal {
    /// Inertia including the rotor, kg·m².
    pub(super) inertia: f64,
    /// Gravity torque at 90° from hanging, N·m.
    pub(super) gravity: f64,
}

/// Disturbance torque on the link during a part of one recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrusion {
    /// Highest torque, N·m.
    pub torque: f64,
    /// Start and end, s.
    pub interval: [f64; 2],
}

impl Intrusion {
    fn at(&self, t: f64) -> f64 {
        let [from, to] = self.interval;
        if t <= from || t >= to {
            return 0.0;
        }
        // A hand shakes the link: a few swings with smooth start and end.
        let place = (t - from) / (to - from);
        self.torque * (0.5 * TAU * place).sin() * (9.0 * TAU * place).sin().powi(2)
    }
}

/// Condition of the drive during a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Manner {
    /// Controlled from the first sample to the last.
    Driven,
    /// Drive off from this sample on; the recorded mode shows it.
    CoastingFrom(usize),
    /// Motor shaft clamped.
    Clamped,
}

/// Rotor inertia that represents a clamped shaft, kg·m².
const CLAMP: f64 = 1e6;

struct Loop {
    drive: Drive,
    nominal: Nominal,
    counts: f64,
    supply: f64,
    position: i64,
    last_code: u16,
    speed: f64,
    scaling: rig_firmware::sample::Scaling,
}

impl Loop {
    /// Reads encoder and current: q in rad, i in A.
    fn read(&mut self, sample: &Sample) -> (f64, f64) {
        let code = sample.encoder.0;
        let moved = i64::from(code.wrapping_sub(self.last_code) as i16);
        self.last_code = code;
        self.position += moved;
        let angle = TAU / (self.counts * self.drive.gear_ratio);
        let keep = (-TAU * SPEED_FILTER / RATE).exp();
        self.speed = keep * self.speed + (1.0 - keep) * moved as f64 * angle * RATE;
        let code = f64::from(sample.current.0) - f64::from(self.scaling.current_zero);
        (
            self.position as f64 * angle,
            code * f64::from(self.scaling.current_per_code),
        )
    }

    /// Computes the duty for a reference position, velocity and acceleration.
    fn duty(&self, q: f64, [reference, velocity, acceleration]: [f64; 3]) -> f64 {
        let natural = TAU * BANDWIDTH;
        let nominal = &self.nominal;
        let torque = nominal.inertia
            * (acceleration
                + natural * natural * (reference - q)
                + 2.0 * DAMPING * natural * (velocity - self.speed))
            + nominal.gravity * reference.sin();
        let constant = self.drive.torque_constant * self.drive.gear_ratio;
        let resistance = self.drive.resistance.unwrap_or(0.0);
        let voltage = resistance * torque / constant + constant * self.speed;
        (voltage / self.supply).clamp(-1.0, 1.0)
    }
}

/// Runs the rig along `reference` and records t, q, torque (current times the nominal torque constant), reference and
/// applied voltage (of the control period before the sample). Records the encoder on the link, too, if there is one.
pub(super) fn record(
    mut config: PlantConfig,
    drive: &Drive,
    nominal: Nominal,
    reference: &[f64],
    seed: u64,
    intrusion: Option<Intrusion>,
    manner: Manner,
) -> Block {
    let off = match manner {
        Manner::CoastingFrom(sample) => Some(sample),
        Manner::Driven | Manner::Clamped => None,
    };
    if manner == Manner::Clamped {
        config.motor.rotor_inertia = CLAMP;
    }
    let mut control = Loop {
        drive: drive.clone(),
        nominal,
        counts: config.sensors.encoder.counts_per_turn,
        supply: config.bridge.supply,
        position: 0,
        last_code: 0,
        speed: 0.0,
        scaling: config.sensors.scaling,
    };
    let ticks = (TICK_RATE / RATE).round() as usize;
    let constant = drive.torque_constant * drive.gear_ratio;
    let mut plant = Plant::new(config, seed);
    let mut command = Command {
        duty: Duty(0.0),
        bridge: true,
    };
    let mut block = Block::default();
    let mut joint = JointColumns::default();
    let (mut references, mut voltages) = (Vec::new(), Vec::new());
    let mut links = Vec::new();
    for (k, &position) in reference.iter().enumerate() {
        let t = k as f64 / RATE;
        if let Some(intrusion) = intrusion {
            plant.faults_mut().external_torque = intrusion.at(t);
        }
        let mut sample = plant.advance(command);
        for _ in 1..ticks {
            sample = plant.advance(command);
        }
        let (q, current) = control.read(&sample);
        block.t.push(t);
        joint.q.push(q);
        joint.tau.push(constant * current);
        links.extend(plant.link_angle());
        // With the drive off, the reference is the position.
        references.push(if command.bridge { position } else { q });
        voltages.push(f64::from(command.duty.0) * control.supply);

        command.bridge = off.is_none_or(|off| k + 1 < off);
        command.duty = Duty(if command.bridge {
            control.duty(q, wanted(reference, k)) as f32
        } else {
            0.0
        });
    }
    if let Some(off) = off {
        block.extra = vec![("mode".into(), modes(off, reference.len()))];
    }
    joint.reference = Some(references);
    joint.voltage = Some(voltages);
    joint.link = (!links.is_empty()).then_some(links);
    block.joints.push(joint);
    block
}

/// Returns position, velocity and acceleration of a reference at sample `k`; rad, rad/s, rad/s².
fn wanted(reference: &[f64], k: usize) -> [f64; 3] {
    let position = reference[k];
    let before = reference.get(k.wrapping_sub(1)).copied();
    let after = reference.get(k + 1).copied();
    let (before, after) = (before.unwrap_or(position), after.unwrap_or(position));
    [
        position,
        0.5 * (after - before) * RATE,
        (after - 2.0 * position + before) * RATE * RATE,
    ]
}

/// Returns the recorded mode of `samples` samples with the drive off from sample `off` on.
fn modes(off: usize, samples: usize) -> Vec<f64> {
    let mode = |k: usize| match k < off {
        true => Mode::Running,
        false => Mode::Disarmed,
    };
    (0..samples).map(|k| f64::from(mode(k) as u8)).collect()
}

/// Records `samples` samples of the hanging rig with its drive off, without reference and voltage.
pub(super) fn drive_off(config: PlantConfig, drive: &Drive, samples: usize, seed: u64) -> Block {
    let scaling = config.sensors.scaling;
    let ticks = (TICK_RATE / RATE).round() as usize;
    let constant = drive.torque_constant * drive.gear_ratio;
    let mut plant = Plant::new(config, seed);
    let off = Command {
        duty: Duty(0.0),
        bridge: false,
    };
    let mut block = Block::default();
    let mut joint = JointColumns::default();
    for k in 0..samples {
        let mut sample = plant.advance(off);
        for _ in 1..ticks {
            sample = plant.advance(off);
        }
        let code = f64::from(sample.current.0) - f64::from(scaling.current_zero);
        block.t.push(k as f64 / RATE);
        // The rig hangs at the position where it was switched on.
        joint.q.push(0.0);
        joint
            .tau
            .push(constant * code * f64::from(scaling.current_per_code));
    }
    block.joints.push(joint);
    block
}
