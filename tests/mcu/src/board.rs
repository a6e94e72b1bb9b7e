//! The board around the chip: half bridges on TIM1, the emulated rig behind them, its sensors on the pins.
//!
//! The rig moves in control periods of 0.1 ms. What the bridge did within one is averaged, so a bridge that goes
//! off in the middle of a period acts to a period's resolution. Between two periods the shaft turns on at its
//! last speed for the encoder, which so counts at the instant it is read.

use rig_firmware::sample::Command;
use rig_plant::{Plant, PlantConfig, Truth};
use rig_shared::units::Duty;

use crate::ripple::Ripple;
use crate::time::{Instant, from_seconds, to_seconds};

/// The chip's supply, V.
const NOMINAL: f64 = 3.3;

/// What the two half bridges do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// Mean of the first minus the second, −1 to 1 of the supply.
    pub duty: f64,
    /// The driver's enable input is high, and its inputs are not both low, which leaves the motor open.
    pub enabled: bool,
    /// The driver's enable input is high.
    pub enable: bool,
}

/// From the enable input to the outputs, at most (DRV8874, SLVSF66, t_WAKE), s.
const WAKE: f64 = 1e-3;

/// Faults on the board; what is wrong with the rig itself goes through [`Plant::faults_mut`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoardFaults {
    /// The encoder's channel A is cut: its input is where the chip's own pull takes it.
    pub channel_a_cut: bool,
    /// Channel B likewise.
    pub channel_b_cut: bool,
    /// The index likewise.
    pub index_cut: bool,
    /// The index comes once where it should not. Taken when it does.
    pub false_index: bool,
    /// Both channels change once at the same time. Taken when they do.
    pub skewed: bool,
    /// The motor's wires touch: while the bridge drives, so much flows, A.
    pub short: Option<f64>,
    /// Codes that the converter gives whatever is on its pins: current, supply, temperature.
    pub stuck: [Option<u16>; 3],
    /// The driver reports a fault: its output pulls the break input low and its bridge is off.
    pub driver: bool,
    /// The fault line is pulled low, but the driver does not switch off by itself.
    pub fault_line: bool,
    /// The chip's own supply, V, where it is not its 3.3: the converter's reference, and the current amplifier's. Too low for the processor is nothing that is modelled.
    pub logic_supply: Option<f64>,
    /// The crystal does not swing.
    pub crystal_dead: bool,
    /// The comparators find nothing.
    pub comparators_dead: bool,
    /// The converter's trigger does not come.
    pub trigger_lost: bool,
    /// The serial line takes no byte.
    pub line_blocked: bool,
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
    /// Both channels changed at once.
    pub skewed: bool,
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
    /// Levels of A and B as the chip last had them.
    levels: [bool; 2],
    /// When the bridge's outputs follow its enable.
    awake: Instant,
    /// When the encoder was last looked at.
    looked: Instant,
    /// Times at which the bridge came on or went off.
    pub enable_edges: Vec<(Instant, bool)>,
    /// What the half bridges did when they last came on.
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
            levels: [false; 2],
            awake: 0,
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
        }
        if bridge.enable && !self.bridge.enable {
            self.awake = now + from_seconds(WAKE);
        }
        self.bridge = bridge;
    }

    fn integrate(&mut self, now: Instant) {
        if self.bridge.enabled && now > self.awake {
            if self.since <= self.awake {
                self.first_duty = self.bridge.duty;
            }
            let time = (now - self.since.max(self.awake)) as f64;
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
        stuck.unwrap_or_else(|| {
            let level = match input {
                0 => self.sense(),
                _ => self.level(input, 0.0),
            };
            level.round().clamp(0.0, 4095.0) as u16
        })
    }

    /// The chip's supply over the nominal one.
    fn reference(&self) -> f64 {
        self.faults.logic_supply.unwrap_or(NOMINAL) / NOMINAL
    }

    /// What is on an input, in codes of the converter, whose reference is the chip's supply: `zero` moves with that.
    fn level(&self, input: usize, zero: f64) -> f64 {
        let nominal = f64::from(self.codes.get(input).copied().unwrap_or(0));
        zero + (nominal - zero) / self.reference()
    }

    /// What is on the current sense, in codes of the converter, without limits; the ripple within a pulse is left out.
    pub fn sense(&self) -> f64 {
        let scaling = self.plant.config().sensors.scaling;
        let zero = f64::from(scaling.current_zero);
        match self.faults.short {
            Some(current) if self.bridge.enabled => {
                zero + current / f64::from(scaling.current_per_code) / self.reference()
            }
            _ => self.level(0, zero),
        }
    }

    /// What the chip's own reference reads: 1500 at the nominal supply, which is 1.2085 V (DS12288, V_REFINT: 1.182 to 1.232).
    pub fn reference_code(&self) -> u16 {
        (1500.0 / self.reference()).round() as u16
    }

    /// Levels of the encoder's channels at the chip.
    pub fn levels(&self) -> [bool; 2] {
        self.levels
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

    /// Counts that the timer sees up to `now` since the last call, whose inputs pull a wire that is cut high or low. The index
    /// stands where the true count is a multiple of a turn.
    ///
    /// With one channel cut, the other's edges count to and fro: the timer sees a step and takes it back.
    pub fn edges(&mut self, now: Instant, pulls: [bool; 2]) -> Edges {
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
        let cut = [self.faults.channel_a_cut, self.faults.channel_b_cut];
        let broken = cut.contains(&true);
        let mut index = (passed && !self.faults.index_cut).then_some(Index {
            upwards,
            // With a channel cut nothing worth counting comes after it either.
            since: if broken { 0 } else { since as u32 },
        });
        if core::mem::take(&mut self.faults.false_index) {
            index = Some(Index { upwards, since: 0 });
        }
        let phase = count.rem_euclid(4) as usize;
        // Quadrature: A is high in phases 1 and 2, B in phases 2 and 3.
        let driven = [matches!(phase, 1 | 2), matches!(phase, 2 | 3)];
        let levels = [0, 1].map(|k| if cut[k] { pulls[k] } else { driven[k] });
        let state = |[a, b]: [bool; 2]| i64::from(b) * 2 + i64::from(a != b);
        let step = (state(levels) - state(self.levels)).rem_euclid(4);
        self.levels = levels;
        let skewed = core::mem::take(&mut self.faults.skewed);
        if !broken {
            return Edges {
                counts: count - before,
                last,
                index,
                skewed,
            };
        }
        // Two states on: both have changed, and nobody knows which way.
        let counts = [0, 1, 0, -1].get(step as usize).copied().unwrap_or(0);
        Edges {
            counts,
            last: (counts != 0).then_some(last.unwrap_or(now)),
            index,
            skewed: skewed || step == 2,
        }
    }
}
