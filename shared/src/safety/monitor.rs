//! The checks of every control tick.
//!
//! Each looks at measured values only, never at what the controller believes, so that a wrong model of the link
//! cannot hide a fault. Leaves out: everything that hardware must catch within a tick (short circuits go
//! to the timer's break input and arrive here as [`Fault::Driver`]).

use super::fault::Fault;
use super::limit::Limits;
use super::voltage::{self, VoltageModel, VoltageState};

/// Thresholds that do not come with [`Limits`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorConfig {
    /// Control period, s.
    pub period: f32,
    /// Supply range, V.
    pub supply: [f32; 2],
    /// Highest temperature, °C.
    pub temperature: f32,
    /// Hard current limit over `Limits::peak_current`.
    pub current_margin: f32,
    /// Hard speed limit over `Limits::velocity`.
    pub velocity_margin: f32,
    /// How far beyond the position limits the link may be, rad.
    pub position_margin: f32,
    /// Largest plausible encoder step in a tick, counts.
    pub largest_step: i32,
    /// Ticks in a row that a single-sample check must fail, so that one disturbed sample stops nothing.
    pub persistence: u16,
    /// By which the encoder is found to have lost the motor.
    pub voltage: VoltageModel,
    /// Ticks with one and the same current code, while the duty varied, that mean a stuck converter.
    pub stuck_ticks: u32,
    /// Duty variation within `stuck_ticks` that a live converter must have answered.
    pub stuck_duty: f32,
    /// Thermal time constant of the winding behind the i²t limit, s.
    pub thermal_time: f32,
}

/// Share of the thermal rating below which an overloaded motor counts as cooled: 0.7 thermal times without
/// current.
const COOLED: f32 = 0.5;
/// Ticks within which the noise of a live converter changes its code.
const QUIET: u32 = 10;

/// What the checks look at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// Break input.
    pub driver_fault: bool,
    /// A comparator has found too much current.
    pub comparator: bool,
    /// The previous tick overran.
    pub overrun: bool,
    /// Converter code of the current.
    pub current_code: u16,
    /// Whether that code is at a rail.
    pub current_at_rail: bool,
    /// Motor current, A.
    pub current: f32,
    /// Supply, V.
    pub supply: f32,
    /// Temperature, °C.
    pub temperature: f32,
    /// Encoder step of this tick, counts.
    pub encoder_step: i32,
    /// Nothing drives one of the encoder's wires.
    pub encoder_open: bool,
    /// Joint position, rad.
    pub position: f32,
    /// Joint velocity, rad/s.
    pub velocity: f32,
    /// Duty cycle that acts now, −1 to 1.
    pub duty: f32,
    /// What the bridge loses of the voltage, as far as it is known, V.
    pub lost_voltage: f32,
    /// Whether the bridge drives.
    pub driving: bool,
}

/// Counters behind the checks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MonitorState {
    over_current: u16,
    at_rail: u16,
    bad_supply: u16,
    hot: u16,
    over_speed: u16,
    voltage: VoltageState,
    same_code: u32,
    last_code: u16,
    duty_low: f32,
    duty_high: f32,
    /// Filtered square of the current, A².
    pub heat: f32,
    /// The heat has passed its limit and is not yet well below it again.
    pub overloaded: bool,
}

/// Counts up while `failing`; true once `persistence` ticks in a row failed.
fn persists(counter: &mut u16, failing: bool, persistence: u16) -> bool {
    *counter = if failing {
        counter.saturating_add(1)
    } else {
        0
    };
    *counter >= persistence
}

// A comparison with NaN is false: written as `!(value <= limit)`, a NaN is a fault.
/// One tick of all checks: the first fault found, with the value that was out of range.
pub fn step(
    config: &MonitorConfig,
    limits: &Limits<f32>,
    state: &mut MonitorState,
    now: &Readings,
) -> Option<(Fault, f32)> {
    let magnitude = now.current.abs();
    let n = config.persistence;
    // With the bridge off the winding is open: what a broken converter then reads heats nothing.
    let heating = if now.driving {
        now.current * now.current
    } else {
        0.0
    };
    state.heat += (heating - state.heat) * (config.period / config.thermal_time);
    let rating = limits.continuous_current * limits.continuous_current;
    // The cause acts until the motor has cooled: an instant after the bridge is off it is just below its limit.
    state.overloaded = !(state.heat
        <= if state.overloaded {
            COOLED * rating
        } else {
            rating
        });

    // Every counter is brought up to date before any is judged: an early return must not stop the others.
    let over_current = persists(
        &mut state.over_current,
        !(magnitude <= limits.peak_current * config.current_margin),
        n,
    );
    let at_rail = persists(&mut state.at_rail, now.current_at_rail, n);
    let bad_supply = persists(
        &mut state.bad_supply,
        !(config.supply[0] <= now.supply && now.supply <= config.supply[1]),
        n,
    );
    let hot = persists(&mut state.hot, !(now.temperature <= config.temperature), n);
    let over_speed = persists(
        &mut state.over_speed,
        !(now.velocity.abs() <= limits.velocity * config.velocity_margin),
        n,
    );
    // With the bridge off the voltage over the motor is nobody's.
    let lost = if now.driving {
        let applied = now.duty * now.supply - now.lost_voltage;
        voltage::step(
            &config.voltage,
            &mut state.voltage,
            applied,
            now.current,
            now.encoder_step,
        )
    } else {
        state.voltage = VoltageState::default();
        false
    };
    let stuck = converter_is_stuck(config, state, now);
    // A current that stands still is no witness against the encoder, until it has been found not to be stuck.
    let suspect = (QUIET..config.stuck_ticks).contains(&state.same_code);
    let outside = now.driving
        && !(limits.position_low - config.position_margin <= now.position
            && now.position <= limits.position_high + config.position_margin);

    let jumped = now.encoder_step.unsigned_abs() > config.largest_step.unsigned_abs();
    let lost = now.encoder_open || lost && !suspect;
    let late = now.overrun && now.driving;
    // Nearly always nothing is wrong: the list costs more to make than to see that it is empty.
    let any = now.driver_fault
        | at_rail
        | stuck
        | over_current
        | now.comparator
        | jumped
        | lost
        | over_speed
        | outside
        | bad_supply
        | hot
        | state.overloaded
        | late;
    if !any {
        return None;
    }
    let faults = [
        (now.driver_fault, Fault::Driver, 0.0),
        // Before the over-current: a code at the rail is no measurement, though it reads as a large current.
        (
            at_rail || stuck,
            Fault::AdcStuck,
            f32::from(now.current_code),
        ),
        (
            over_current || now.comparator,
            Fault::OverCurrent,
            now.current,
        ),
        (jumped, Fault::EncoderJump, now.encoder_step as f32),
        (lost, Fault::EncoderLost, state.voltage.unexplained),
        (over_speed, Fault::OverSpeed, now.velocity),
        (outside, Fault::Position, now.position),
        (bad_supply, Fault::Supply, now.supply),
        (hot, Fault::Temperature, now.temperature),
        (state.overloaded, Fault::Overload, state.heat),
        (late, Fault::Deadline, 0.0),
    ];
    faults
        .into_iter()
        .find(|(failing, _, _)| *failing)
        .map(|(_, fault, value)| match fault {
            // Worked out only where it is told: a square root a tick is too dear.
            Fault::Overload => (fault, libm::sqrtf(value)),
            _ => (fault, value),
        })
}

/// A converter that is alive follows the duty; one that is stuck keeps its code whatever is applied.
fn converter_is_stuck(config: &MonitorConfig, state: &mut MonitorState, now: &Readings) -> bool {
    if !now.driving || now.current_code != state.last_code {
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
