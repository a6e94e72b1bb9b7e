//! The board around the chip: half bridges on TIM1, the emulated rig behind them, its sensors on the pins.
//!
//! The rig moves in control periods of 0.1 ms. What the bridge did within one is averaged, so a bridge that goes
//! off in the middle of a period acts to a period's resolution. Between two periods the shaft turns on at its
//! last speed for the encoder, which so counts at the instant it is read.

use rig_firmware::sample::Command;
use rig_host::plant::{Plant, PlantConfig, Truth};
use rig_shared::units::Duty;

use crate::ripple::Ripple;
use crate::time::{Instant, from_seconds, to_seconds};

/// What the two half bridges do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// Mean of the first minus the second, −1 to 1 of the supply.
    pub duty: f64,
    /// The driver's enable input is high.
    pub enabled: bool,
}

/// Faults on the board; what is wrong with the rig itself goes through [`Plant::faults_mut`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoardFaults {
    /// The encoder's channel A is cut: its input stays low.
    pub channel_a_cut: bool,
    /// Channel B likewise.
    pub channel_b_cut: bool,
    /// The index likewise.
    pub index_cut: bool,
    /// Codes that the converter gives whatever is on its pins: current, supply, temperature.
    pub stuck: [Option<u16>; 3],
    /// The driver reports a fault: its output pulls the break input low and its bridge is off.
    pub driver: bool,
    /// The fault line is pulled low, but the driver does not switch off by itself.
    pub fault_line: bool,
    /// The chip's own supply, V, where it is not its 3.3. Too low for the processor is nothing that is modelled.
    pub logic_supply: Option<f64>,
    /// The crystal does not swing.
    pub crystal_dead: bool,
}

/// The encoder's index has passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Index {
    /// In the positive direction.
    pub upwards: bool,
    /// Counts since then.
    pub since: u32,
}

/// What came on the encoder's wires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edges {
    /// Edges counted up less edges counted down.
    pub counts: i64,
    /// When the last one came, where any did.
    pub last: Option<Instant>,
    /// The index, where it passed.
    pub index: Option<Index>,
}

/// The board.
pub struct Board {
    plant: Plant,
    /// What is broken.
    pub faults: BoardFaults,
    period: u64,
    next: Instant,
    last: Instant,
    aligned: bool,
    bridge: Bridge,
    since: Instant,
    /// Integrals over the period under way: duty while on, and time on.
    duty_time: f64,
    on_time: f64,
    codes: [u16; 3],
    truth: Truth,
    counts_per_radian: f64,
    turn: i64,
    /// The rig's own count at its last sampling instant, unwrapped, and the register that it came from.
    sampled: i64,
    register: u16,
    true_count: i64,
    seen_count: i64,
    /// When the encoder was last looked at.
    looked: Instant,
    /// Times of every change of the driver's enable input.
    pub enable_edges: Vec<(Instant, bool)>,
    /// What the half bridges did when they were last enabled.
    pub first_duty: f64,
}

impl Board {
    /// A board with this rig, at rest. `seed` is for the rig's noise.
    pub fn new(config: PlantConfig, seed: u64) -> Self {
        let encoder = config.sensors.encoder;
        let counts_per_radian = encoder.counts_per_turn / core::f64::consts::TAU;
        let turn = encoder.counts_per_turn.round() as i64;
        let period = from_seconds(config.tick);
        let mut plant = Plant::new(config, seed);
        let sample = plant.advance(Command::default());
        let truth = plant.truth();
        Self {
            plant,
            faults: BoardFaults::default(),
            period,
            next: period,
            last: 0,
            aligned: false,
            bridge: Bridge::default(),
            since: 0,
            duty_time: 0.0,
            on_time: 0.0,
            codes: [sample.current.0, sample.supply.0, sample.temperature.0],
            truth,
            counts_per_radian,
            turn,
            sampled: i64::from(sample.encoder.0),
            register: sample.encoder.0,
            true_count: i64::from(sample.encoder.0),
            seen_count: 0,
            looked: 0,
            enable_edges: Vec::new(),
            first_duty: 0.0,
        }
    }

    /// The rig.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The rig, to injure it.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// What the half bridges do now.
    pub fn bridge(&self) -> Bridge {
        self.bridge
    }

    /// When the rig moves on next.
    pub fn due(&self) -> Instant {
        self.next
    }

    /// Whether the break input's pin is high.
    pub fn fault_pin(&self) -> bool {
        !(self.faults.driver || self.faults.fault_line)
    }

    /// The half bridges change at `now`.
    pub fn set_bridge(&mut self, now: Instant, bridge: Bridge) {
        if bridge == self.bridge {
            return;
        }
        self.integrate(now);
        if bridge.enabled != self.bridge.enabled {
            self.enable_edges.push((now, bridge.enabled));
            if bridge.enabled {
                self.first_duty = bridge.duty;
            }
        }
        self.bridge = bridge;
    }

    fn integrate(&mut self, now: Instant) {
        let time = (now - self.since) as f64;
        if self.bridge.enabled {
            self.on_time += time;
            self.duty_time += time * self.bridge.duty;
        }
        self.since = now;
    }

    /// The converter's trigger at `now`: the first one sets the phase of the rig's periods. The rig stands
    /// until then, as its bridge is off.
    pub fn align(&mut self, now: Instant) {
        if !self.aligned {
            self.aligned = true;
            self.next = now;
        }
    }

    /// The rig moves on by one period, to `now`.
    pub fn advance(&mut self, now: Instant) {
        self.integrate(now);
        let on = 2.0 * self.on_time >= self.period as f64;
        let duty = if on {
            self.duty_time / self.on_time
        } else {
            0.0
        };
        self.duty_time = 0.0;
        self.on_time = 0.0;
        let command = Command {
            duty: Duty(duty as f32),
            bridge: on,
        };
        let driver = self.faults.driver;
        self.plant.faults_mut().driver = driver;
        self.plant.order(command);
        let sample = self.plant.advance(command);
        self.codes = [sample.current.0, sample.supply.0, sample.temperature.0];
        let step = sample.encoder.0.wrapping_sub(self.register).cast_signed();
        self.register = sample.encoder.0;
        self.sampled += i64::from(step);
        self.truth = self.plant.truth();
        self.last = now;
        self.next = now + self.period;
    }

    /// Code of the analogue input: 0 current, 1 supply, 2 temperature.
    pub fn code(&self, input: usize) -> u16 {
        let stuck = self.faults.stuck.get(input).copied().flatten();
        stuck.unwrap_or_else(|| self.codes.get(input).copied().unwrap_or(0))
    }

    /// What the current varies by within a pulse now.
    pub fn ripple(&self) -> Ripple {
        if !self.bridge.enabled {
            return Ripple::default();
        }
        let config = self.plant.config();
        let motor = &config.motor;
        let drop = motor.resistance * self.truth.current
            + motor.torque_constant * self.truth.motor_velocity;
        Ripple {
            braking: -drop / motor.inductance,
            duty: self.bridge.duty.abs().min(1.0),
            codes_per_ampere: 1.0 / f64::from(config.sensors.scaling.current_per_code),
        }
    }

    /// What an encoder without steps would read at `now`, counts, not wrapped.
    fn reading(&self, now: Instant) -> f64 {
        let ahead = self.truth.motor_velocity * to_seconds(now - self.last);
        let config = self.plant.config();
        let encoder = config.sensors.encoder;
        // How far into the count that was sampled: by the encoder's own zero, or edges would come twice.
        let reading = encoder.reading(self.truth.motor_position, config.mechanism.ratio);
        let phase = reading.rem_euclid(1.0);
        self.sampled as f64 + phase + ahead * self.counts_per_radian
    }

    /// When the edge before `now` came, the count having changed since the last look: by the last speed, and not before
    /// that look.
    fn edge(&self, now: Instant, reading: f64, upwards: bool) -> Instant {
        let within = reading.rem_euclid(1.0);
        let since = if upwards { within } else { 1.0 - within };
        let speed = (self.truth.motor_velocity * self.counts_per_radian).abs();
        let longest = to_seconds(now - self.looked);
        // No speed: it has only just come to rest.
        let age = if speed * longest > since {
            since / speed
        } else {
            longest
        };
        now - from_seconds(age)
    }

    /// Counts that the timer sees up to `now` since the last call. The index stands where the true count is a multiple of
    /// a turn.
    ///
    /// With one channel cut, the other's edges count to and fro: the timer sees a step and takes it back.
    pub fn edges(&mut self, now: Instant) -> Edges {
        let reading = self.reading(now);
        let count = reading.floor() as i64;
        let before = self.true_count;
        let last = (count != before).then(|| self.edge(now, reading, count > before));
        self.looked = now;
        self.true_count = count;
        let passed = count.div_euclid(self.turn) != before.div_euclid(self.turn);
        let upwards = count > before;
        let within = count.rem_euclid(self.turn);
        let since = if upwards {
            within
        } else {
            self.turn - 1 - within
        };
        let broken = self.faults.channel_a_cut || self.faults.channel_b_cut;
        let index = (passed && !self.faults.index_cut).then_some(Index {
            upwards,
            // With a channel cut nothing worth counting comes after it either.
            since: if broken { 0 } else { since as u32 },
        });
        // Quadrature: A is high in phases 1 and 2, B in phases 2 and 3.
        let seen = match (self.faults.channel_a_cut, self.faults.channel_b_cut) {
            (false, false) => {
                return Edges {
                    counts: count - before,
                    last,
                    index,
                };
            }
            (true, true) => {
                return Edges {
                    counts: 0,
                    last: None,
                    index,
                };
            }
            (true, false) => i64::from(matches!(count.rem_euclid(4), 2 | 3)),
            (false, true) => i64::from(matches!(count.rem_euclid(4), 1 | 2)),
        };
        let step = seen - self.seen_count;
        self.seen_count = seen;
        Edges {
            counts: step,
            last: last.filter(|_| step != 0),
            index,
        }
    }
}
