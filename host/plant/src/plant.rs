//! The emulated rig: one control tick at a time.

use std::collections::VecDeque;

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rig_firmware::sample::{Command, EDGE_CLOCK_HZ, Sample};
use rig_shared::safety::monitor::Breaks;
use rig_shared::units::AdcCode;

use super::body::{Body, Load};
use super::config::PlantConfig;
use super::fault::Faults;
use super::integrate::{Dynamics, Held};
use super::sensors::{self, Converter, EdgeClock, LinkReader};
use super::truth::Truth;

/// The emulated rig.
#[derive(Clone, Debug)]
pub struct Plant {
    config: PlantConfig,
    dynamics: Dynamics,
    faults: Faults,
    /// Command in force since the last sampling instant.
    active: Command,
    /// True if the bridge has been on.
    driven: bool,
    ticks: u64,
    load: Load,
    payload: Option<Body>,
    gravity: [f64; 3],
    disturbance: f64,
    winding_rise: f64,
    gear_rise: f64,
    held_count: i64,
    edges: EdgeClock,
    late_current: VecDeque<f64>,
    current: Converter,
    supply: Converter,
    temperature: Converter,
    link: Option<LinkReader>,
    disturbance_rng: Pcg64Mcg,
}

impl Plant {
    /// Creates a rig at rest at its initial position, bridge off. Equal configurations and seeds give equal samples.
    pub fn new(config: PlantConfig, seed: u64) -> Self {
        let scaling = config.sensors.scaling;
        let tick = config.tick;
        let channel = |channel, zero: f32, per_code: f32, purpose| {
            Converter::new(
                channel,
                f64::from(zero),
                f64::from(per_code),
                tick,
                sensors::stream(seed, purpose),
            )
        };
        let dynamics = Dynamics::new(&config);
        Self {
            current: channel(
                config.sensors.current,
                scaling.current_zero,
                scaling.current_per_code,
                0,
            ),
            supply: channel(config.sensors.supply, 0.0, scaling.supply_per_code, 1),
            temperature: channel(
                config.sensors.temperature,
                -scaling.temperature_at_zero / scaling.temperature_per_code,
                scaling.temperature_per_code,
                2,
            ),
            disturbance_rng: sensors::stream(seed, 3),
            link: (config.sensors.link_encoder)
                .map(|encoder| LinkReader::new(encoder, sensors::stream(seed, 4))),
            late_current: VecDeque::from(vec![0.0; config.sensors.current_delay.unwrap_or(0)]),
            held_count: config
                .sensors
                .encoder
                .count(dynamics.motor_angle(), config.mechanism.ratio),
            edges: EdgeClock::new(
                config
                    .sensors
                    .encoder
                    .reading(dynamics.motor_angle(), config.mechanism.ratio),
            ),
            load: config.load(),
            gravity: config.gravity(),
            dynamics,
            faults: Faults::default(),
            active: Command::default(),
            driven: false,
            ticks: 0,
            payload: None,
            disturbance: 0.0,
            winding_rise: 0.0,
            gear_rise: 0.0,
            config,
        }
    }

    /// Returns the configuration of the rig.
    pub fn config(&self) -> &PlantConfig {
        &self.config
    }

    /// Returns the faults in force from the next tick on.
    pub fn faults_mut(&mut self) -> &mut Faults {
        &mut self.faults
    }

    /// Replaces the command in force since the last sampling instant, for a bridge that takes commands between
    /// instants.
    pub fn order(&mut self, command: Command) {
        self.active = command;
    }

    /// Runs one control tick: the rig moves under the previous command, is sampled, and takes `command` for the next
    /// tick.
    pub fn advance(&mut self, command: Command) -> Sample {
        let held = self.hold();
        self.driven |= self.active.bridge;
        if self.driven || !self.config.held {
            self.dynamics.tick(&self.config, &held);
        }
        self.ticks += 1;
        self.warm();
        self.active = command;
        self.sample()
    }

    /// Computes the values that are constant between two sampling instants.
    fn hold(&mut self) -> Held {
        if self.faults.payload != self.payload {
            let before = self
                .dynamics
                .body_energy(self.load.inertia, self.load.gravity(self.gravity));
            self.payload = self.faults.payload;
            self.load = self
                .payload
                .iter()
                .fold(self.config.load(), |load, body| load.add(body));
            let after = self
                .dynamics
                .body_energy(self.load.inertia, self.load.gravity(self.gravity));
            self.dynamics.receive(after - before);
        }
        if let Some(disturbance) = self.config.mechanism.disturbance {
            let normal: f64 = StandardNormal.sample(&mut self.disturbance_rng);
            self.disturbance = disturbance.next(self.disturbance, self.config.tick, normal);
        }
        let duty = f64::from(self.active.duty.0);
        let (resistance_scale, torque_scale) = self
            .config
            .motor
            .temperature
            .map_or((1.0, 1.0), |t| t.scales(self.winding_rise));
        let (coulomb_scale, viscous_scale) = self
            .config
            .mechanism
            .warmup
            .map_or((1.0, 1.0), |w| w.scales(self.gear_rise));
        let mechanism = &self.config.mechanism;
        Held {
            // A bridge cannot exceed its supply; a NaN command gives zero.
            duty: if duty.is_nan() {
                0.0
            } else {
                duty.clamp(-1.0, 1.0)
            },
            on: self.active.bridge && !self.faults.driver,
            supply: self.faults.supply.unwrap_or(self.config.bridge.supply),
            resistance: self.config.motor.resistance * resistance_scale,
            torque_constant: self.config.motor.torque_constant * mechanism.ratio * torque_scale,
            load_inertia: self.load.inertia,
            gravity: self.load.gravity(self.gravity),
            external: self.faults.external_torque + self.disturbance
                - mechanism.torque_offset.unwrap_or(0.0),
            coulomb_scale,
            viscous_scale,
        }
    }

    fn warm(&mut self) {
        let tick = self.config.tick;
        let motor = &self.config.motor;
        let heat = self.dynamics.take_heat();
        let keep = 1.0 - tick / (motor.heat_capacity * motor.thermal_resistance);
        self.winding_rise = keep * self.winding_rise + heat.winding / motor.heat_capacity;
        if let Some(warmup) = self.config.mechanism.warmup {
            self.gear_rise = warmup.next(self.gear_rise, heat.friction, tick);
        }
    }

    fn sample(&mut self) -> Sample {
        let encoder = self.config.sensors.encoder;
        let age = if self.faults.encoder_cut {
            None
        } else {
            let reading = encoder.reading(self.dynamics.motor_angle(), self.config.mechanism.ratio);
            self.held_count = reading.floor() as i64;
            let age = self.edges.tick(reading);
            encoder.timed.then_some(age)
        };
        let mut current = self.dynamics.current();
        if !self.late_current.is_empty() {
            self.late_current.push_back(current);
            current = self.late_current.pop_front().unwrap_or(current);
        }
        // Every converter runs even if stuck, so that its noise sequence does not change.
        let current = self.current.convert(current);
        let supply = self.supply.convert(self.dynamics.bus());
        let temperature = self
            .temperature
            .convert(self.config.ambient + self.winding_rise);
        let faults = &self.faults;
        Sample {
            encoder: sensors::register(self.held_count + i64::from(faults.encoder_jump)),
            // The cast saturates after 25 s.
            edge_age: age.map(|ticks| (ticks * self.config.tick * f64::from(EDGE_CLOCK_HZ)) as u32),
            current: faults.current_stuck.map_or(current, AdcCode),
            supply: faults.supply_stuck.map_or(supply, AdcCode),
            temperature: faults.temperature_stuck.map_or(temperature, AdcCode),
            breaks: if faults.driver {
                Breaks::DRIVER
            } else {
                Breaks::default()
            },
            late_ticks: u8::from(faults.overrun),
            stop_switch_open: faults.stop_switch_open,
            // The plant has no board.
            encoder_wrong: None,
            encoder_open: false,
            stack_left: None,
        }
    }

    /// Returns the reading of the link encoder at the last sampling instant, rad; `None` if the rig has none.
    pub fn link_angle(&mut self) -> Option<f64> {
        let angle = self.truth().position;
        self.link.as_mut().map(|link| link.read(angle))
    }

    /// Returns the true state at the last sampling instant.
    pub fn truth(&self) -> Truth {
        Truth {
            time: self.ticks as f64 * self.config.tick,
            winding_temperature: self.config.ambient + self.winding_rise,
            gear_temperature: self.config.ambient + self.gear_rise,
            ..self.dynamics.truth(
                &self.config,
                self.load.inertia,
                self.load.gravity(self.gravity),
            )
        }
    }
}
