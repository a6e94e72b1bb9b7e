//! The board around the chip: half bridges on TIM1, the emulated rig behind them, its sensors on the pins.
//!
//! The rig moves in control periods of 0.1 ms. The output of the bridge is averaged over a period, so switching off in
//! the middle acts with the resolution of a period. Between two periods the shaft turns at its last speed, so the
//! encoder counts at the instant of reading.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};
use rig_firmware::sample::Command;
use rig_plant::{Plant, PlantConfig, Truth};
use rig_shared::units::Duty;

use crate::amplifier::Amplifier;
use crate::ripple::Ripple;
use crate::time::{Instant, from_seconds, to_seconds};

/// The chip's supply, V.
const NOMINAL: f64 = 3.3;

/// State of the two half bridges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// Mean of the first minus the second, −1 to 1 of the supply.
    pub duty: f64,
    /// True if the driver's enable input is high, and its inputs are not both low (motor open).
    pub enabled: bool,
    /// True if the driver's enable input is high.
    pub enable: bool,
}

/// Longest time from the enable input to the outputs (DRV8874, SLVSF66, t_WAKE), s.
const WAKE: f64 = 1e-3;

/// Propagation and dead time of the bridge, and delay of an amplifier with 400 kHz of bandwidth, s: estimates for a DRV8874
/// and an INA240.
pub(crate) const BRIDGE_DELAY: f64 = 0.6e-6;
const AMPLIFIER_DELAY: f64 = 0.4e-6;

/// Time from the shunt to the output of a comparator, s: an amplifier with 400 kHz of bandwidth, and some tens of ns of the
/// comparator (DS12288: 17 ns typical). An estimate.
const COMPARATOR_DELAY: f64 = AMPLIFIER_DELAY + 0.1e-6;

/// Faults on the board; [`Plant::faults_mut`] has the faults of the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoardFaults {
    /// The encoder's channel A is cut: the chip's own pull sets its input.
    pub channel_a_cut: bool,
    /// Channel B is cut.
    pub channel_b_cut: bool,
    /// The index is cut.
    pub index_cut: bool,
    /// The index comes once at a wrong place. Cleared when it comes.
    pub false_index: bool,
    /// Edges that the wires lose once, while the shaft turns: whole lines of four. Cleared when they are lost.
    pub lost_edges: i64,
    /// Both channels change once at the same time. Cleared when they do.
    pub skewed: bool,
    /// The motor's wires touch: current while the bridge drives, A.
    pub short: Option<f64>,
    /// Codes of the converter, independent of its pins: current, supply, temperature.
    pub stuck: [Option<u16>; 3],
    /// The driver reports a fault: its output pulls the break input low and switches its bridge off.
    pub driver: bool,
    /// The fault line is pulled low, but the driver does not switch off by itself.
    pub fault_line: bool,
    /// The chip's own supply, V, if not 3.3: reference of converter and current amplifier. Brown-out is not modelled.
    pub logic_supply: Option<f64>,
    /// The crystal does not oscillate.
    pub crystal_dead: bool,
    /// The comparators detect nothing.
    pub comparators_dead: bool,
    /// The wire of the current sense to PB0 is open.
    pub second_sense_open: bool,
    /// The converter never becomes ready.
    pub converter_dead: bool,
    /// The converter's trigger does not come.
    pub trigger_lost: bool,
    /// The serial line accepts no byte.
    pub line_blocked: bool,
}

/// Passage of the encoder's index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Index {
    /// True in the positive direction.
    pub upwards: bool,
    /// Counts since then.
    pub since: u32,
}

/// Signals on the encoder's wires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edges {
    /// Edges counted up minus edges counted down.
    pub counts: i64,
    /// Time of the last edge, if any.
    pub last: Option<Instant>,
    /// The index, if it passed.
    pub index: Option<Index>,
    /// Both channels changed at once.
    pub skewed: bool,
}

/// The board.
pub struct Board {
    plant: Plant,
    /// Present faults.
    pub faults: BoardFaults,
    period: u64,
    next: Instant,
    last: Instant,
    aligned: bool,
    bridge: Bridge,
    since: Instant,
    /// Integrals over the present period: duty while on, and time on.
    duty_time: f64,
    on_time: f64,
    codes: [u16; 3],
    truth: Truth,
    counts_per_radian: f64,
    turn: i64,
    /// The rig's own count at its last sampling instant, unwrapped, and the register value behind it.
    sampled: i64,
    register: u16,
    true_count: i64,
    /// Last levels of A and B at the chip.
    levels: [bool; 2],
    /// Time from which the bridge's outputs follow its enable.
    awake: Instant,
    /// Time of the last reading of the encoder.
    looked: Instant,
    /// Times at which the bridge was switched on or off.
    pub enable_edges: Vec<(Instant, bool)>,
    /// Duty of the half bridges when last switched on.
    pub first_duty: f64,
    /// Time from an edge at the bridge's inputs to the current sense at the converter, s.
    pub sense_delay: f64,
    /// Amplifier of the current, if its error after an edge of the bridge counts.
    pub amplifier: Option<Amplifier>,
    /// Time from the shunt to the output of a comparator, s.
    pub comparator_delay: f64,
    /// Largest error of the place at which the encoder makes an edge, counts: another one each time.
    pub edge_jitter: f64,
    /// A closed stop switch connects PB14 to ground. Otherwise nothing drives it.
    pub stop_switch_closed: bool,
    /// The strap at PB15 connects it to ground.
    pub stop_strap: bool,
    /// Chance for the jitter.
    chance: Pcg64Mcg,
}

impl Board {
    /// Returns a board with this rig, at rest. `seed` is for the rig's noise.
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
            sense_delay: BRIDGE_DELAY + AMPLIFIER_DELAY,
            amplifier: None,
            comparator_delay: COMPARATOR_DELAY,
            edge_jitter: 0.0,
            stop_switch_closed: false,
            stop_strap: false,
            chance: Pcg64Mcg::seed_from_u64(seed ^ 0x0E0D_E500),
        }
    }

    /// Returns a number from 0 to 1 by chance.
    fn draw(&mut self) -> f64 {
        f64::from(self.chance.next_u32()) / 2_f64.powi(32)
    }

    /// Returns the rig.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns the rig, to set faults.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// Returns the present state of the half bridges.
    pub fn bridge(&self) -> Bridge {
        self.bridge
    }

    /// Returns the time from which the bridge's outputs follow its enable.
    pub fn awake(&self) -> Instant {
        self.awake
    }

    /// Returns the next instant at which the rig moves.
    pub fn due(&self) -> Instant {
        self.next
    }

    /// Returns true if the break input's pin is high at `now`. A bridge that sleeps or wakes holds it low: parts of this
    /// family differ, and this is the worst.
    pub fn fault_pin(&self, now: Instant) -> bool {
        let awake = self.bridge.enable && now >= self.awake;
        awake && !(self.faults.driver || self.faults.fault_line)
    }

    /// Changes the half bridges at `now`.
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

    /// Handles the converter's trigger at `now`: the first one sets the phase of the rig's periods. The rig stands
    /// until then, because its bridge is off.
    pub fn align(&mut self, now: Instant) {
        if !self.aligned {
            self.aligned = true;
            self.next = now;
        }
    }

    /// Moves the rig by one period, to `now`.
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

    /// Returns the code of an analogue input: 0 current, 1 supply, 2 temperature.
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

    /// Returns the chip's supply over the nominal one.
    fn reference(&self) -> f64 {
        self.faults.logic_supply.unwrap_or(NOMINAL) / NOMINAL
    }

    /// Returns the level of an input in codes of the converter. Its reference is the chip's supply, which moves `zero`.
    fn level(&self, input: usize, zero: f64) -> f64 {
        let nominal = f64::from(self.codes.get(input).copied().unwrap_or(0));
        zero + (nominal - zero) / self.reference()
    }

    /// Returns the current sense in codes of the converter, without limits and without the ripple within a pulse.
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

    /// Returns the lowest and the highest current sense within a pulse, in codes of the converter, without limits.
    pub fn sense_extremes(&self) -> [f64; 2] {
        let mean = self.sense();
        let ripple = self.ripple();
        let codes = ripple.codes_per_ampere / self.reference();
        ripple.extremes().map(|current| mean + codes * current)
    }

    /// Returns the code of the chip's reference: 1500 at nominal supply, 1.2085 V (DS12288, V_REFINT: 1.182 to 1.232).
    pub fn reference_code(&self) -> u16 {
        (1500.0 / self.reference()).round() as u16
    }

    /// Returns the levels of the encoder's channels at the chip.
    pub fn levels(&self) -> [bool; 2] {
        self.levels
    }

    /// Returns the present ripple of the current within a pulse.
    pub fn ripple(&self) -> Ripple {
        // A stuck converter does not see it either.
        if !self.bridge.enabled || self.faults.stuck[0].is_some() {
            return Ripple::default();
        }
        let config = self.plant.config();
        let motor = &config.motor;
        let drop = motor.resistance * self.truth.current
            + motor.torque_constant * self.truth.motor_velocity;
        Ripple {
            delay: self.sense_delay,
            braking: -drop / motor.inductance,
            duty: self.bridge.duty.clamp(-1.0, 1.0),
            supply: config.bridge.supply,
            amplifier: self.amplifier,
            codes_per_ampere: 1.0 / f64::from(config.sensors.scaling.current_per_code),
        }
    }

    /// Returns the reading of an encoder without steps at `now`, counts, not wrapped.
    fn reading(&self, now: Instant) -> f64 {
        let ahead = self.truth.motor_velocity * to_seconds(now - self.last);
        let config = self.plant.config();
        let encoder = config.sensors.encoder;
        // Position within the sampled count, from the encoder's own zero; otherwise edges would come twice.
        let reading = encoder.reading(self.truth.motor_position, config.mechanism.ratio);
        let phase = reading.rem_euclid(1.0);
        self.sampled as f64 + phase + ahead * self.counts_per_radian
    }

    /// Returns the time of the edge before `now`, if the count has changed since the last reading: from the last speed,
    /// not before that reading.
    fn edge(&mut self, now: Instant, reading: f64, upwards: bool) -> Instant {
        let within = reading.rem_euclid(1.0);
        let since = if upwards { within } else { 1.0 - within };
        let jitter = if self.edge_jitter > 0.0 {
            self.edge_jitter * (2.0 * self.draw() - 1.0)
        } else {
            0.0
        };
        let since = (since + jitter).max(0.0);
        let speed = (self.truth.motor_velocity * self.counts_per_radian).abs();
        let longest = to_seconds(now - self.looked);
        // Zero speed: it has just come to rest.
        let age = if speed * longest > since {
            since / speed
        } else {
            longest
        };
        now - from_seconds(age)
    }

    /// Returns the counts that the timer sees from the last call to `now`. Its inputs pull a cut wire high or low. The
    /// index is at multiples of a turn of the true count.
    ///
    /// With one channel cut, the other's edges count up and down: the timer sees a step and its reverse.
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
            // With a cut channel, counts after the index are not valid.
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
            let lost = if count > before {
                core::mem::take(&mut self.faults.lost_edges)
            } else {
                0
            };
            return Edges {
                counts: count - before - lost,
                last,
                index,
                skewed,
            };
        }
        // Two states on: both channels have changed, and the direction is unknown.
        let counts = [0, 1, 0, -1].get(step as usize).copied().unwrap_or(0);
        Edges {
            counts,
            last: (counts != 0).then_some(last.unwrap_or(now)),
            index,
            skewed: skewed || step == 2,
        }
    }
}
