//! What the host may change, when, and what it is refused.

use micromath::F32Ext;
use rig_shared::control::{adaptive, current};
use rig_shared::safety::{Fault, Limits, Mode};
use rig_shared::trajectory::{Course, Extremes};
use rig_shared::wire::message::{Refusal, RequestBody};

use crate::config::Config;
use crate::examined::{Examined, Finding};
use crate::state::{Calibration, Run, State};
use crate::step::brake;

/// Carries out a request, or says why not; nothing has changed then.
///
/// Requests about the conversation itself (`Hello`, streams, snapshot, capture) are the
/// [`Clerk`](crate::clerk::Clerk)'s and are accepted here without effect.
///
/// Not inlined: it is rare, and the chip's fast memory is for what runs in every tick.
///
/// # Errors
/// The [`Refusal`] that goes back to the host.
#[inline(never)]
pub fn carry_out(config: &Config, state: &mut State, examined: &Examined) -> Result<(), Refusal> {
    let body = &examined.request.body;
    match body {
        RequestBody::Hello
        | RequestBody::KeepAlive
        | RequestBody::StartStream
        | RequestBody::StopStream
        | RequestBody::GetSnapshot
        | RequestBody::Capture(_)
        | RequestBody::GetCapture => Ok(()),
        RequestBody::Disarm => {
            if state.mode.drives() {
                state.mode = Mode::Disarmed;
            }
            Ok(())
        }
        // While the flash is being written nothing may start that depends on every tick.
        _ if state.storing => Err(Refusal::Busy),
        RequestBody::Store => store(state),
        RequestBody::Arm => arm(config, state),
        RequestBody::Start => start(config, state),
        RequestBody::Stop => match state.mode {
            Mode::Running => {
                brake(state);
                Ok(())
            }
            Mode::Holding | Mode::Stopping => Ok(()),
            _ => Err(wrong_mode(state)),
        },
        RequestBody::ClearFault => clear_fault(config, state),
        RequestBody::SetPosition(position) => set_position(state, *position),
        RequestBody::SetLimits(_) if state.mode.drives() => Err(Refusal::WrongMode),
        _ => {
            // Checks that act may not be moved, nor laws that drive a motion.
            refuse_in_motion(state)?;
            replace(
                state,
                body,
                examined.finding.as_ref().map_err(|refusal| *refusal)?,
            )
        }
    }
}

/// Puts what has been examined in the place of what was.
fn replace(state: &mut State, body: &RequestBody, finding: &Finding) -> Result<(), Refusal> {
    match (body, finding) {
        (RequestBody::SetTrajectory(trajectory), Finding::Motion(extremes, prepared)) => {
            fits(extremes, &state.settings.limits, None)?;
            state.trajectory = Some((Course::new(trajectory.clone(), *prepared), *extremes));
            return Ok(());
        }
        (RequestBody::SetEffects(_), Finding::Effects(compensation)) => {
            state.replace_effects(compensation);
            return Ok(());
        }
        (RequestBody::SetEstimator(settings), Finding::Estimator(estimator)) => {
            state.settings.estimator = *settings;
            state.replace_estimator(estimator);
        }
        (RequestBody::SetGains(gains), _) => state.settings.gains = *gains,
        (RequestBody::SetControl(kind), _) => state.settings.control = *kind,
        (RequestBody::SetModel(model), _) => state.settings.model = *model,
        (RequestBody::SetFriction(friction), _) => state.settings.friction = *friction,
        (RequestBody::SetPrecompensation(precompensation), _) => {
            state.settings.precompensation = *precompensation;
        }
        (RequestBody::SetLimits(limits), _) => state.settings.limits = *limits,
        // What was found belongs to another request.
        _ => return Err(Refusal::BadValue),
    }
    state.stale = true;
    Ok(())
}

fn refuse_in_motion(state: &State) -> Result<(), Refusal> {
    if matches!(state.mode, Mode::Running | Mode::Stopping) {
        Err(Refusal::WrongMode)
    } else {
        Ok(())
    }
}

/// Why the present mode does not allow what is asked: a latched fault has its own remedy.
fn wrong_mode(state: &State) -> Refusal {
    match state.mode {
        Mode::Fault => Refusal::FaultLatched,
        _ => Refusal::WrongMode,
    }
}

/// Only while the bridge is off and nothing moves.
fn store(state: &mut State) -> Result<(), Refusal> {
    if state.mode != Mode::Disarmed {
        return Err(wrong_mode(state));
    }
    state.storing = true;
    Ok(())
}

fn arm(config: &Config, state: &mut State) -> Result<(), Refusal> {
    match state.mode {
        Mode::Disarmed => {
            state.run = Run {
                base: state.position,
                awake: state.tick + u64::from(config.wake_ticks),
                ..Run::default()
            };
            state.current_loop = current::State::default();
            state.effects.interrupt();
            state.law.adaptive = adaptive::State::new(state.settings.model);
            state.mode = Mode::Holding;
            Ok(())
        }
        _ => Err(wrong_mode(state)),
    }
}

fn start(config: &Config, state: &mut State) -> Result<(), Refusal> {
    if state.mode != Mode::Holding {
        return Err(wrong_mode(state));
    }
    let (trajectory, extremes) = state.trajectory.as_ref().ok_or(Refusal::NoTrajectory)?;
    fits(extremes, &state.settings.limits, Some(state.run.base))?;
    let rate = u64::from(config.rates.control_hz);
    state.run.length = (trajectory.duration_micros().saturating_mul(rate)).div_ceil(1_000_000);
    // A bridge that is not yet awake is waited for.
    state.run.start = state.tick.max(state.run.awake);
    state.mode = Mode::Running;
    Ok(())
}

/// Shifts the origin of the counts so that the link stands at `position` now, to the nearest count.
fn set_position(state: &mut State, position: f32) -> Result<(), Refusal> {
    if state.mode != Mode::Disarmed {
        return Err(wrong_mode(state));
    }
    let counts = position / state.derived.radians_per_count;
    // From 2²³ counts on x ± ½, by which it is rounded, is no f32.
    if counts.is_nan() || counts.abs() >= 8_388_608.0 {
        return Err(Refusal::BadValue);
    }
    let shift = F32Ext::round(counts) as i64 - state.counts;
    state.origin = state.origin.map(|origin| origin - shift);
    state.counts += shift;
    state.position = state.counts as f32 * state.derived.radians_per_count;
    state.reference.position = state.position;
    state.placed = true;
    // Windows that are open hold counts from the old origin.
    state.telemetry.position += shift * i64::from(state.telemetry.ticks);
    state.estimation.position += shift * i64::from(state.estimation.ticks);
    state.previous = None;
    if shift != 0 {
        // gc and gs belong to the angle that they were learnt for.
        state.restart_estimator();
    }
    Ok(())
}

fn clear_fault(config: &Config, state: &mut State) -> Result<(), Refusal> {
    if state.mode != Mode::Fault {
        return Ok(());
    }
    if state.cause_acting {
        return Err(Refusal::CauseActing);
    }
    // An implausible offset is measured again: it may have been a motor turned by hand.
    let offset = state
        .latch
        .first()
        .is_some_and(|record| record.fault == Fault::CurrentOffset);
    // A fault that came in the middle of the measurement leaves it to be done.
    let offset = offset || state.calibration.ticks < config.calibration_ticks;
    state.latch.clear();
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

/// Whether a trajectory keeps to the limits: speed and acceleration always, position once it is known
/// about which point it will run. Written so that NaN is refused.
fn fits(extremes: &Extremes<f32>, limits: &Limits<f32>, base: Option<f32>) -> Result<(), Refusal> {
    // Rounding of the peak itself must not refuse a motion designed to touch its limit.
    const SLACK: f32 = 1.0 + 1e-6;
    let moves = extremes.velocity <= limits.velocity * SLACK
        && extremes.acceleration <= limits.acceleration * SLACK;
    let stays = base.is_none_or(|base| {
        limits.position_low <= base + extremes.lowest
            && base + extremes.highest <= limits.position_high
    });
    if moves && stays {
        Ok(())
    } else {
        Err(Refusal::OutsideLimits)
    }
}
