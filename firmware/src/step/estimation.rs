//! Inputs of the on-line estimator, and its reports.

use rig_shared::estimation::Learning;
use rig_shared::link::PARAMETER_COUNT;
use rig_shared::safety::{Limit, Mode};
use rig_shared::wire::message::Estimate;

use crate::config::Config;
use crate::state::State;
use crate::window::{Tick, Window};

/// Place of `off` among the parameters: [`rig_shared::link::PARAMETER_NAMES`].
const OFFSET_INDEX: usize = PARAMETER_COUNT - 1;

/// Feeds the on-line estimator when a window is full, and reports at its own, slower rate.
///
/// Velocity is the difference of two windows' mean positions. So position and torque are averaged over the same two
/// windows: all belong to the instant between them, and no column lags another.
pub(super) fn feed_estimator(config: &Config, state: &mut State, tick: &Tick) -> Option<Estimate> {
    // In the tick after an update, because the update has a high load.
    let report_due = core::mem::take(&mut state.report_due);
    accumulate(config, state, tick);
    report_due.then(|| estimate_report(state))
}

/// Fills a window; updates the estimator when it is full.
fn accumulate(config: &Config, state: &mut State, tick: &Tick) {
    // Half a window later than the telemetry's, so that one tick never completes both. It starts at an odd tick, so
    // that windows of an even number of ticks end in even ticks, in which no effect is turned or evaluated.
    if state.tick < u64::from((config.rates.estimator_decimation / 2) | 1) {
        return;
    }
    let window = state
        .estimation
        .push(tick, config.rates.estimator_decimation);
    let Some(window) = window else { return };
    if state.restart_due {
        state.restart_due = false;
        state.previous_window = None;
        state.estimator.restart();
        state.rows.restart();
        return;
    }
    // With the bridge off a hand may move the link, after a fault the readings are in doubt, and a current that has not
    // settled is biased: none of them is information on the rig's parameters. The filter starts anew after them, because
    // its memory would keep their bias.
    let drives = state.mode.drives();
    let outcome = if !drives || window.limits.has(Limit::Unsettled) {
        state.previous_window = None;
        state.estimator.interrupt();
        if drives {
            Learning::CurrentUnsettled
        } else {
            Learning::BridgeOff
        }
    } else if let Some(previous) = state.previous_window.replace(window) {
        update_estimate(config, state, &previous, &window)
    } else {
        Learning::FilterSettling
    };
    state.rows.count(outcome);
    if state.mode == Mode::Calibrating {
        return;
    }
    state.updates_since_report += 1;
    if state.updates_since_report < config.rates.estimate_report_decimation {
        return;
    }
    state.updates_since_report = 0;
    state.report_due = true;
}

/// Runs one update from two consecutive windows; returns what became of the row.
///
/// Not inlined: one tick in ten runs it, and `firmware/fast_code.list` ranks it apart from the rest of the tick.
#[inline(never)]
fn update_estimate(
    config: &Config,
    state: &mut State,
    previous: &Window,
    window: &Window,
) -> Learning {
    let ticks = f32::from(config.rates.estimator_decimation);
    let per_count = state.derived.radians_per_count / ticks;
    let errors = [previous, window].map(|w| w.mean(w.position_error));
    // The difference is computed in integers: exact at any position.
    let qd = ((window.position - previous.position) as f32 * per_count - (errors[1] - errors[0]))
        / state.derived.estimator_period;
    let q =
        0.5 * ((window.position + previous.position) as f32 * per_count - (errors[0] + errors[1]));
    let current = 0.5 * (window.mean(window.current) + previous.mean(previous.current));
    // Torque explained by effects is removed; otherwise the model's parameters would absorb it.
    let explained = 0.5 * (window.mean(window.explained) + previous.mean(previous.explained));
    let torque = (current - state.current_error) * state.derived.torque_per_ampere - explained;
    state.estimator.step(q, qd, torque).into()
}

/// Returns the estimate in wire format.
fn estimate_report(state: &mut State) -> Estimate {
    let report = state.estimator.report();
    let (rows, learning) = state.rows.report();
    let mut estimate = Estimate {
        tick: state.tick,
        value: [0.0; PARAMETER_COUNT],
        std: [0.0; PARAMETER_COUNT],
        trusted: [false; PARAMETER_COUNT],
        residual_rms: report.residual_rms,
        rows,
        learning,
    };
    estimate.value = report.value;
    estimate.std = report.std;
    // The current offset was measured from finitely many samples. Its error is a constant torque that no motion shows,
    // and enters only `off`.
    let measured = state.calibration.std * state.derived.torque_per_ampere;
    estimate.std[OFFSET_INDEX] =
        libm::sqrtf(estimate.std[OFFSET_INDEX] * estimate.std[OFFSET_INDEX] + measured * measured);
    estimate.trusted = report.trusted;
    estimate
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::nameplate::one_link;
    use rig_shared::safety::LimitSet;

    /// Returns the state after four seconds of a motion under a consistent current, in which some ticks have another
    /// current, A, and a mark if `marked`.
    fn moved(other: f32, marked: bool, mode: Mode) -> State {
        let (config, settings) = one_link();
        let mut state = State::new(&config, settings).unwrap();
        state.mode = mode;
        for k in 0..40_000_u32 {
            state.tick = u64::from(k);
            let t = 1e-4 * k as f32;
            let (sin, cos) = (5.0 * t).sin_cos();
            let (q, qd, qdd) = (0.6 * sin, 3.0 * cos, -15.0 * sin);
            let torque = 0.2 * qdd + 2.9 * q.cos() + 0.3 * qd + 0.4 * qd.signum();
            let disturbed = k % 1000 < 7;
            let mut limits = LimitSet::default();
            limits.set(Limit::Unsettled, disturbed && marked);
            let current = torque / state.derived.torque_per_ampere;
            let tick = Tick {
                position: (q / state.derived.radians_per_count) as i64,
                current: if disturbed { current + other } else { current },
                limits,
                ..Tick::default()
            };
            accumulate(&config, &mut state, &tick);
        }
        state
    }

    fn learnt(other: f32, marked: bool) -> rig_shared::estimation::OneLinkEstimator<f32> {
        let estimator = moved(other, marked, Mode::Running).estimator;
        assert_ne!(estimator.report().value, [0.0; PARAMETER_COUNT]);
        estimator
    }

    /// Each window counts once. Windows with a mark are left out with those in which the filter starts anew, and all are
    /// while the bridge is off.
    #[test]
    fn every_window_is_counted_by_what_became_of_it() {
        let windows = (40_000 - 5) / 10;
        let counts = |mut state: State| {
            let (rows, learning) = state.rows.report();
            let sum = rows.used + rows.masked + rows.uninformative;
            assert_eq!(sum, windows);
            (rows, learning)
        };
        let (sound, learning) = counts(moved(0.0, false, Mode::Running));
        assert_eq!(learning, Learning::Active);
        let (marked, _) = counts(moved(0.0, true, Mode::Running));
        // Marked ticks come forty times, and the filter has a memory of 27 windows.
        assert!(
            marked.masked > sound.masked + 20 * 40,
            "{sound:?} {marked:?}"
        );
        let (off, learning) = counts(moved(0.0, false, Mode::Disarmed));
        assert_eq!(learning, Learning::BridgeOff);
        assert_eq!(off.masked, windows);
    }

    /// What the current of a marked tick is, makes no difference to the estimator in any bit. Without the mark it does.
    #[test]
    fn a_current_that_has_not_settled_is_not_learnt_from() {
        assert_eq!(learnt(0.0, true), learnt(1.0, true));
        assert_ne!(learnt(0.0, false), learnt(1.0, false));
        assert_ne!(learnt(0.0, true), learnt(0.0, false));
    }
}
