//! Requests of the host: when they are allowed, and when they are refused.

use micromath::F32Ext;
use rig_shared::control::{adaptive, current};
use rig_shared::safety::{Fault, Limits, Mode};
use rig_shared::trajectory::{Extremes, PreparedTrajectory};
use rig_shared::wire::message::{Bounded, Refusal, RequestBody};

use crate::bound::{at_least, at_most};
use crate::config::Config;
use crate::prechecked_request::{PrecheckedRequest, Prepared};
use crate::state::{Calibration, Run, State};
use crate::step::brake;
use crate::urgent_request::UrgentBody;
use crate::validation;

/// Control ticks over which the current is averaged before the rig is armed, against noise: 1.6 ms at 10 kHz.
const IDLE_TICKS: usize = 16;

/// Executes a request, or refuses it without any change.
///
/// Requests about the session itself (`Hello`, streams, snapshot, capture) belong to the
/// [`TickSession`](crate::tick_session::TickSession) and are accepted here without effect.
///
/// Not inlined because it is rare; the chip's fast memory is for code that runs in every tick.
///
/// # Errors
/// The [`Refusal`] that is sent to the host.
#[inline(never)]
pub fn execute(
    config: &Config,
    state: &mut State,
    prechecked: &PrecheckedRequest,
) -> Result<(), Refusal> {
    let body = &prechecked.request.body;
    match body {
        RequestBody::Hello
        | RequestBody::KeepAlive
        | RequestBody::StartStream
        | RequestBody::StopStream
        | RequestBody::GetSnapshot
        | RequestBody::Capture(_)
        | RequestBody::GetCapture => Ok(()),
        RequestBody::Disarm => execute_urgent(state, UrgentBody::Disarm),
        RequestBody::Stop => execute_urgent(state, UrgentBody::Stop),
        // No action that depends on every tick may start while the flash is being written.
        _ if state.storing => Err(Refusal::Busy),
        RequestBody::Store => store(state),
        RequestBody::Arm => arm(config, state),
        RequestBody::Start => start(config, state),
        RequestBody::ClearFault => clear_fault(config, state),
        RequestBody::SetPosition(position) => set_position(state, *position),
        RequestBody::SetLimits(_) if state.mode.drives() => Err(Refusal::WrongMode),
        _ => {
            // Active checks must not change during a motion, nor laws that drive it.
            refuse_in_motion(state)?;
            replace(
                state,
                body,
                prechecked.prepared.as_ref().map_err(|refusal| *refusal)?,
            )
        }
    }
}

/// Executes an urgent request, or refuses it without any change.
///
/// # Errors
/// The [`Refusal`] that is sent to the host.
pub fn execute_urgent(state: &mut State, body: UrgentBody) -> Result<(), Refusal> {
    match body {
        UrgentBody::Disarm => {
            if state.mode.drives() {
                state.mode = Mode::Disarmed;
            }
            state.motor_brake = None;
            Ok(())
        }
        UrgentBody::Stop => match state.mode {
            Mode::Running => {
                brake(state);
                Ok(())
            }
            Mode::Holding | Mode::Stopping => Ok(()),
            _ => Err(mode_refusal(state)),
        },
    }
}

/// Replaces settings by prechecked ones.
fn replace(state: &mut State, body: &RequestBody, prepared: &Prepared) -> Result<(), Refusal> {
    match (body, prepared) {
        (RequestBody::SetTrajectory(trajectory), Prepared::Trajectory(extremes, prepared)) => {
            check_limits(extremes, &state.settings.limits, None)?;
            state.trajectory = Some((
                PreparedTrajectory::new(trajectory.clone(), *prepared),
                *extremes,
            ));
            return Ok(());
        }
        (RequestBody::SetEffects(_), Prepared::Effects(compensation)) => {
            state.replace_effects(compensation);
            return Ok(());
        }
        (RequestBody::SetEstimator(settings), Prepared::Estimator(estimator)) => {
            state.settings.estimator = *settings;
            state.replace_estimator(estimator);
        }
        (RequestBody::SetGains(gains), _) => {
            validation::loops(gains, &state.settings.model)?;
            state.settings.gains = *gains;
        }
        (RequestBody::SetControl(kind), _) => state.settings.control = *kind,
        (RequestBody::SetModel(model), _) => {
            validation::loops(&state.settings.gains, model)?;
            state.settings.model = *model;
        }
        (RequestBody::SetFriction(friction), _) => state.settings.friction = *friction,
        (RequestBody::SetPrecompensation(precompensation), _) => {
            state.settings.precompensation = *precompensation;
        }
        (RequestBody::SetLimits(limits), _) => state.settings.limits = *limits,
        // The result belongs to another request.
        _ => return Err(Refusal::BadValue),
    }
    state.derived_outdated = true;
    Ok(())
}

fn refuse_in_motion(state: &State) -> Result<(), Refusal> {
    if matches!(state.mode, Mode::Running | Mode::Stopping) {
        Err(Refusal::WrongMode)
    } else {
        Ok(())
    }
}

/// Returns why the present mode refuses the request: a latched fault has its own refusal.
fn mode_refusal(state: &State) -> Refusal {
    match state.mode {
        Mode::Fault => Refusal::FaultLatched,
        _ => Refusal::WrongMode,
    }
}

/// Stores the settings, only while the bridge is off and nothing moves.
fn store(state: &mut State) -> Result<(), Refusal> {
    if state.mode != Mode::Disarmed {
        return Err(mode_refusal(state));
    }
    state.storing = true;
    Ok(())
}

fn arm(config: &Config, state: &mut State) -> Result<(), Refusal> {
    match state.mode {
        Mode::Disarmed => {
            if let Some(part) = state.failed_test {
                return Err(Refusal::SelfTestFailed(part));
            }
            if !(state.stop_switch).has_settled(state.tick, state.derived.period) {
                return Err(Refusal::StopSwitchOpen);
            }
            let idle = state.mean_current(IDLE_TICKS);
            at_most(Bounded::IdleCurrent, idle.abs(), config.largest_offset)?;
            validation::arming(&state.settings.limits, state.position, state.velocity)?;
            state.run = Run {
                base: state.position,
                bridge_ready_tick: state.tick + u64::from(config.wake_ticks),
                ..Run::default()
            };
            state.current_loop = current::State::default();
            state.effects.interrupt();
            state.law.adaptive = adaptive::State::new(state.settings.model);
            state.mode = Mode::Holding;
            Ok(())
        }
        _ => Err(mode_refusal(state)),
    }
}

fn start(config: &Config, state: &mut State) -> Result<(), Refusal> {
    if state.mode != Mode::Holding {
        return Err(mode_refusal(state));
    }
    let (trajectory, extremes) = state.trajectory.as_ref().ok_or(Refusal::NoTrajectory)?;
    check_limits(extremes, &state.settings.limits, Some(state.run.base))?;
    let rate = u64::from(config.rates.control_hz);
    state.run.length = (trajectory.duration_micros().saturating_mul(rate)).div_ceil(1_000_000);
    // Waits for a bridge that is not yet ready.
    state.run.start = state.tick.max(state.run.bridge_ready_tick);
    state.mode = Mode::Running;
    Ok(())
}

/// Shifts the origin of the counts so that the link is at `position` now, to the nearest count.
fn set_position(state: &mut State, position: f32) -> Result<(), Refusal> {
    if state.mode != Mode::Disarmed {
        return Err(mode_refusal(state));
    }
    let counts = position / state.derived.radians_per_count;
    // From 2²³ counts on, x ± ½, which rounding needs, is not an f32.
    let largest = 8_388_607.0 * state.derived.radians_per_count.abs();
    at_most(Bounded::Home, position.abs(), largest)?;
    let shift = F32Ext::round(counts) as i64 - state.counts;
    state.origin = state.origin.map(|origin| origin - shift);
    state.counts += shift;
    state.position = state.counts as f32 * state.derived.radians_per_count;
    state.reference.position = state.position;
    state.position_known = true;
    // Open windows hold counts from the old origin.
    state.telemetry.position += shift * i64::from(state.telemetry.ticks);
    state.estimation.position += shift * i64::from(state.estimation.ticks);
    state.previous_window = None;
    if shift != 0 {
        // gc and gs belong to the old angle.
        state.restart_estimator();
    }
    Ok(())
}

fn clear_fault(config: &Config, state: &mut State) -> Result<(), Refusal> {
    if state.mode != Mode::Fault {
        return Ok(());
    }
    if state.fault_cause_active {
        return Err(Refusal::CauseActing);
    }
    // An implausible offset is measured again: the cause may have been a motor turned by hand.
    let offset = state
        .latch
        .first()
        .is_some_and(|record| record.fault == Fault::CurrentOffset);
    // After a fault during the measurement, the measurement must be completed.
    let offset = offset || state.calibration.ticks < config.calibration_ticks;
    state.latch.clear();
    state.motor_brake = None;
    state.snapshot.release();
    if offset {
        state.calibration = Calibration {
            zero_code: config.scaling.current_zero,
            ..Calibration::default()
        };
        state.mode = Mode::Calibrating;
    } else {
        state.mode = Mode::Disarmed;
    }
    Ok(())
}

/// Checks a trajectory against the limits: speed and acceleration always, position only if the base point is known.
#[inline(never)]
fn check_limits(
    extremes: &Extremes<f32>,
    limits: &Limits<f32>,
    base: Option<f32>,
) -> Result<(), Refusal> {
    // Rounding of the peak must not refuse a motion designed to touch its limit.
    const TOLERANCE: f32 = 1.0 + 1e-6;
    for (quantity, value, limit) in [
        (Bounded::MotionSpeed, extremes.velocity, limits.velocity),
        (
            Bounded::MotionAcceleration,
            extremes.acceleration,
            limits.acceleration,
        ),
    ] {
        if value > limit * TOLERANCE || !value.is_finite() {
            at_most(quantity, value, limit)?;
        }
    }
    if let Some(base) = base {
        let (low, high) = (base + extremes.lowest, base + extremes.highest);
        at_least(Bounded::MotionPosition, low, limits.position_low)?;
        at_most(Bounded::MotionPosition, high, limits.position_high)?;
    }
    Ok(())
}
