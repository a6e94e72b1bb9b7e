//! Effects beyond the standard model in the control tick: their inputs and the use of their outputs.

use rig_shared::compensation::{self, Inputs, PositionError};
use rig_shared::trajectory::Reference;

use crate::config::Config;
use crate::state::State;

/// Period of evaluating a law, ticks; a power of two. More evaluations exceed the tick's budget in some motions.
const LAW_PERIOD_TICKS: u64 = 4;

/// Returns the inputs of the effects before the readings are corrected.
#[inline(always)]
pub(crate) fn inputs(config: &Config, state: &State) -> Inputs<f32> {
    let per_count = state.derived.motor_radians_per_count;
    let turn = config.encoder.counts_per_motor_turn as i32;
    // Exact to a count as long as the counts are below 2³¹.
    let counts = state.counts as i32;
    // An odd tick: the estimator's update, the most expensive work of a tick, comes in even ones.
    let busy = state.tick & (LAW_PERIOD_TICKS - 1) != 1;
    let within = if busy {
        0
    } else {
        counts.checked_rem_euclid(turn).unwrap_or_default()
    };
    Inputs {
        reference: Reference::default(),
        position: state.position,
        velocity: state.velocity,
        gear_ratio: config.drive.gear_ratio,
        motor_angle: counts as f32 * per_count,
        angle_in_turn: within as f32 * per_count,
        position_known: state.position_known,
        busy,
        rotates_waves: state.tick & 1 != 0,
        drive_torque: state.drive_torque,
        load: 0.0,
        coulomb: state.settings.friction.coulomb,
        viscous: state.settings.friction.viscous,
        // To a tenth of a second, without the conversion of a 64-bit number.
        time: (state.tick >> 10) as u32 as f32 * (1024.0 * state.derived.period),
        temperature_rise: state.temperature_rise,
        period: LAW_PERIOD_TICKS as f32 * state.derived.period,
        torque_delay: state.derived.current.lag,
        delay_ticks: state.derived.lag.0,
        delay_fraction: state.derived.lag.1,
    }
}

/// Turns periodic effects with the link, and subtracts the encoder's error from position and velocity.
#[inline(always)]
pub(crate) fn correct(config: &Config, state: &mut State) {
    // New effects that are not yet in force would use the state of the old ones.
    if state.effects_changed || !state.compensation.has_waves() {
        state.position_error = 0.0;
        return;
    }
    let inputs = inputs(config, state);
    let PositionError { error, slope } = state.compensation.turn(&mut state.effects, &inputs);
    state.position -= error;
    state.velocity -= slope * state.velocity;
    state.position_error = error;
}

/// Returns the torques of the effects while the rig drives.
#[inline(always)]
pub(crate) fn torque(config: &Config, state: &mut State) -> compensation::Output<f32> {
    if state.effects_changed || !state.compensation.has_torque() {
        return compensation::Output::default();
    }
    let model = &state.settings.model;
    // The planned load, as for the friction law: feedback would add measurement noise.
    let load = if state.compensation.needs_load() {
        model.inertia * state.reference.acceleration + model.gravity_torque(state.position)
    } else {
        0.0
    };
    let inputs = Inputs {
        reference: state.reference,
        load,
        ..inputs(config, state)
    };
    state
        .compensation
        .torque(&state.settings.precompensation, &mut state.effects, &inputs)
}
