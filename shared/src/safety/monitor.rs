//! The checks of every control tick.
//!
//! The checks use measured values only and no estimates of the controller, so that a wrong link model cannot hide a
//! fault. Leaves out: everything that hardware must catch within a tick. Short circuits go to the timer's break inputs
//! and arrive here as [`Breaks`].

use super::fault::Fault;
use super::limit::Limits;
use super::voltage::{self, VoltageModel, VoltageState};

/// Thresholds that are not in [`Limits`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorConfig {
    /// Control period, s.
    pub period: f32,
    /// Supply range, V.
    pub supply: [f32; 2],
    /// Highest temperature, °C.
    pub temperature: f32,
    /// Ratio of the hard current limit to `Limits::peak_current`.
    pub current_margin: f32,
    /// Ratio of the hard speed limit to `Limits::velocity`.
    pub velocity_margin: f32,
    /// Allowed travel beyond the position limits, rad.
    pub position_margin: f32,
    /// Largest plausible encoder step in a tick, counts.
    pub largest_step: i32,
    /// Consecutive failing ticks before a single-sample check counts, so that one disturbed sample stops nothing.
    pub persistence: u16,
    /// Model to detect an encoder that has lost the motor.
    pub voltage: VoltageModel,
    /// Ticks with the same current code, while the duty varied, after which the converter is stuck.
    pub stuck_ticks: u32,
    /// Smallest variation of the duty within `stuck_ticks` that a live converter answers.
    pub stuck_duty: f32,
    /// Thermal time constant of the winding behind the i²t limit, s.
    pub thermal_time: f32,
    /// Control period over the thermal time: a division in each tick is too expensive.
    pub heat_forget: f32,
    /// Ticks after a late one within which another is a fault.
    pub late_window: u32,
}

/// Share of the thermal rating below which an overloaded motor counts as cooled: 0.7 thermal times without current.
const COOLED_SHARE: f32 = 0.5;
/// Ticks within which the noise of a live converter changes its code.
const CODE_NOISE_TICKS: u32 = 10;

/// What has switched the bridge's outputs off without the program, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Breaks(pub u8);

impl Breaks {
    /// The driver's fault line.
    pub const DRIVER: Self = Self(1);
    /// The comparators: over-current.
    pub const OVER_CURRENT: Self = Self(2);
    /// A fault inside the chip: lock-up, flash word, supply, clock.
    pub const CHIP: Self = Self(4);

    /// Returns the causes in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns true if any of these causes has acted.
    pub const fn has_any(self, causes: Self) -> bool {
        self.0 & causes.0 != 0
    }
}

/// Inputs of the checks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// What has switched the outputs off.
    pub breaks: Breaks,
    /// Ticks that were missed or finished late since the last one.
    pub late_ticks: u8,
    /// Converter code of the current.
    pub current_code: u16,
    /// True if that code is at a rail.
    pub current_at_rail: bool,
    /// Motor current, A.
    pub current: f32,
    /// Supply, V.
    pub supply: f32,
    /// Temperature, °C.
    pub temperature: f32,
    /// Encoder step of this tick, counts.
    pub encoder_step: i32,
    /// True if an encoder wire is open.
    pub encoder_open: bool,
    /// Joint position, rad.
    pub position: f32,
    /// Joint velocity, rad/s.
    pub velocity: f32,
    /// Duty cycle that acts now, −1 to 1.
    pub duty: f32,
    /// Known voltage loss of the bridge, V.
    pub lost_voltage: f32,
    /// True if the bridge drives.
    pub driving: bool,
    /// True if the motor brakes after a fault: the bridge is on too.
    pub braking: bool,
}

/// Counters behind the checks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MonitorState {
    /// Consecutive failing ticks of each of the [`Persistent`] checks.
    failures: [u16; PERSISTENT],
    /// True if one of them is above 0.
    failing: bool,
    voltage: VoltageState,
    same_code: u32,
    last_code: u16,
    duty_low: f32,
    duty_high: f32,
    /// Ticks for which the last late one still counts.
    late_left: u32,
    /// Filtered square of the current, A².
    pub heat: f32,
    /// True from the moment the heat exceeds its limit until the motor has cooled.
    pub overloaded: bool,
}

impl MonitorState {
    /// Returns true if the converter of the current may be stuck: its code has not changed for longer than noise allows.
    pub fn converter_is_suspect(&self) -> bool {
        self.same_code >= CODE_NOISE_TICKS
    }
}

/// Number of checks that must fail in several ticks.
const PERSISTENT: usize = 5;

/// Result of the checks that must fail in several ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Persistent {
    over_current: bool,
    at_rail: bool,
    bad_supply: bool,
    hot: bool,
    over_speed: bool,
}

impl Persistent {
    /// Returns which checks fail in this tick.
    // A comparison with NaN is false: written as `!(value <= limit)`, a NaN is a fault.
    #[inline(always)]
    fn of(config: &MonitorConfig, limits: &Limits<f32>, now: &Readings) -> Self {
        let current_limit = limits.peak_current * config.current_margin;
        let velocity_limit = limits.velocity * config.velocity_margin;
        Self {
            over_current: !(now.current.abs() <= current_limit),
            at_rail: now.current_at_rail,
            bad_supply: !(config.supply[0] <= now.supply && now.supply <= config.supply[1]),
            hot: !(now.temperature <= config.temperature),
            over_speed: !(now.velocity.abs() <= velocity_limit),
        }
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.over_current || self.at_rail || self.bad_supply || self.hot || self.over_speed
    }
}

/// Counts consecutive failures; returns which checks have failed for [`MonitorConfig::persistence`] ticks. Not inlined because
/// it is rare.
#[inline(never)]
fn count_failures(
    config: &MonitorConfig,
    limits: &Limits<f32>,
    state: &mut MonitorState,
    now: &Readings,
) -> Persistent {
    let failing = Persistent::of(config, limits, now);
    let checks = [
        failing.over_current,
        failing.at_rail,
        failing.bad_supply,
        failing.hot,
        failing.over_speed,
    ];
    for (count, failing) in state.failures.iter_mut().zip(checks) {
        *count = if failing { count.saturating_add(1) } else { 0 };
    }
    state.failing = failing.any();
    let [over_current, at_rail, bad_supply, hot, over_speed] =
        state.failures.map(|count| count >= config.persistence);
    Persistent {
        over_current,
        at_rail,
        bad_supply,
        hot,
        over_speed,
    }
}

/// Returns true if the position is beyond its range while the bridge drives.
#[inline(always)]
fn is_outside(config: &MonitorConfig, limits: &Limits<f32>, now: &Readings) -> bool {
    now.driving
        && !(limits.position_low - config.position_margin <= now.position
            && now.position <= limits.position_high + config.position_margin)
}

/// Returns true if the encoder counted more in a tick than the motor can turn.
#[inline(always)]
fn has_jumped(config: &MonitorConfig, now: &Readings) -> bool {
    now.encoder_step.unsigned_abs() > config.largest_step.unsigned_abs()
}

/// Results of the checks that have a state of their own.
#[derive(Clone, Copy)]
struct Found {
    persistent: Persistent,
    stuck: bool,
    lost: bool,
    late: bool,
}

/// Runs all checks of one tick. Returns the first fault found, with the value that was out of range.
pub fn step(
    config: &MonitorConfig,
    limits: &Limits<f32>,
    state: &mut MonitorState,
    now: &Readings,
) -> Option<(Fault, f32)> {
    let bridge_on = now.driving || now.braking;
    update_heat(config, limits, state, now.current, bridge_on);
    // All counters are updated before any is judged: an early return must not stop the others.
    // The copies for what is rare: a reference to `now` would have it stored in memory in every tick.
    let persistent = if state.failing || Persistent::of(config, limits, now).any() {
        let now = *now;
        count_failures(config, limits, state, &now)
    } else {
        Persistent::default()
    };
    let unexplained = voltage_is_unexplained(config, state, now);
    let stuck = converter_is_stuck(config, state, now, bridge_on);
    // A constant current does not count against the encoder until the converter is known not to be stuck.
    let converter_suspect = (CODE_NOISE_TICKS..config.stuck_ticks).contains(&state.same_code);
    let found = Found {
        persistent,
        stuck,
        lost: now.encoder_open || unexplained && !converter_suspect,
        late: is_late_again(config, state, now),
    };
    let failed = persistent.any()
        || found.stuck
        || found.lost
        || found.late
        || now.breaks != Breaks::default()
        || state.overloaded
        || has_jumped(config, now)
        || is_outside(config, limits, now);
    // A fault is rare, and building the list costs more than this test.
    if failed {
        let (now, found) = (*now, found);
        first_fault(config, limits, state, &now, &found)
    } else {
        None
    }
}

/// Returns the first of the faults that were found, with the value that was out of range. Not inlined because it is rare.
#[inline(never)]
fn first_fault(
    config: &MonitorConfig,
    limits: &Limits<f32>,
    state: &MonitorState,
    now: &Readings,
    found: &Found,
) -> Option<(Fault, f32)> {
    let persistent = &found.persistent;
    let code = f32::from(now.current_code);
    let faults = [
        (
            now.breaks.has_any(Breaks::DRIVER.union(Breaks::CHIP)),
            Fault::Driver,
            f32::from(now.breaks.0),
        ),
        // Before over-current: a code at the rail is no measurement, although it reads as a large current.
        (persistent.at_rail || found.stuck, Fault::AdcStuck, code),
        (
            persistent.over_current || now.breaks.has_any(Breaks::OVER_CURRENT),
            Fault::OverCurrent,
            now.current,
        ),
        // Before all that lets the rig brake, which needs the supply.
        (persistent.bad_supply, Fault::Supply, now.supply),
        (
            has_jumped(config, now),
            Fault::EncoderJump,
            now.encoder_step as f32,
        ),
        (found.lost, Fault::EncoderLost, state.voltage.unexplained),
        (persistent.over_speed, Fault::OverSpeed, now.velocity),
        (
            is_outside(config, limits, now),
            Fault::Position,
            now.position,
        ),
        (persistent.hot, Fault::Temperature, now.temperature),
        (state.overloaded, Fault::Overload, state.heat),
        (found.late, Fault::Deadline, 0.0),
    ];
    let (_, fault, value) = faults.into_iter().find(|(failing, _, _)| *failing)?;
    Some(match fault {
        // Computed only for a report: a square root in each tick is too expensive.
        Fault::Overload => (fault, libm::sqrtf(value)),
        _ => (fault, value),
    })
}

/// Returns true if control ticks were late beyond what the loops tolerate: two at once, or one within `late_window` after
/// another. A single one doubles one period, which is far below the loops' time constants.
#[inline(always)]
fn is_late_again(config: &MonitorConfig, state: &mut MonitorState, now: &Readings) -> bool {
    if now.late_ticks == 0 {
        if state.late_left > 0 {
            state.late_left -= 1;
        }
        return false;
    }
    let again = now.late_ticks > 1 || state.late_left > 0;
    state.late_left = config.late_window;
    again && now.driving
}

/// Updates the heat of the winding, and whether the motor is overloaded.
#[inline(always)]
fn update_heat(
    config: &MonitorConfig,
    limits: &Limits<f32>,
    state: &mut MonitorState,
    current: f32,
    bridge_on: bool,
) {
    // With the bridge off the winding is open, so a current reading of a broken converter heats nothing.
    let heating = if bridge_on { current * current } else { 0.0 };
    state.heat += (heating - state.heat) * config.heat_forget;
    let rating = limits.continuous_current * limits.continuous_current;
    // The overload lasts until the motor has cooled: just after the bridge is off the heat is barely below its limit.
    state.overloaded = !(state.heat
        <= if state.overloaded {
            COOLED_SHARE * rating
        } else {
            rating
        });
}

/// Returns true if motion and current do not explain the voltage, as without an encoder. With the bridge off the voltage
/// over the motor is undefined.
#[inline(always)]
fn voltage_is_unexplained(
    config: &MonitorConfig,
    state: &mut MonitorState,
    now: &Readings,
) -> bool {
    if !now.driving {
        state.voltage = VoltageState::default();
        return false;
    }
    let applied = now.duty * now.supply - now.lost_voltage;
    voltage::step(
        &config.voltage,
        &mut state.voltage,
        applied,
        now.current,
        now.encoder_step,
    )
}

/// Returns true if the converter is stuck: a live one follows the duty, a stuck one keeps its code. The bridge must be on,
/// to drive or to brake.
fn converter_is_stuck(
    config: &MonitorConfig,
    state: &mut MonitorState,
    now: &Readings,
    bridge_on: bool,
) -> bool {
    if !bridge_on || now.current_code != state.last_code {
        state.last_code = now.current_code;
        state.same_code = 0;
        state.duty_low = now.duty;
        state.duty_high = now.duty;
        return false;
    }
    state.same_code = state.same_code.saturating_add(1);
    state.duty_low = state.duty_low.min(now.duty);
    state.duty_high = state.duty_high.max(now.duty);
    state.same_code >= config.stuck_ticks && state.duty_high - state.duty_low > config.stuck_duty
}
