//! The on-line estimator of the one-link model: filtered differential model, gate, update, report.
//!
//! A row must be *valid* (the filter's start and presliding are over: [`filtered`]) and *informative* (leverage against
//! noise). Memory and forgetting count valid, informative samples only, so that standing still forgets nothing.
//!
//! Cost of a step, counted by the test `operations_are_as_stated`: at most 788 sums and products, 18 divisions, one
//! sine and cosine (628 and 15 on average). The most expensive step closes a residual block.
//!
//! Leaves out: delay between torque and motion, friction beyond Coulomb and viscous; both show in `residual_rms`.

use super::recursive;
use super::report::{Report, Update};
use super::settings::{EstimatorSettings, SettingsFault};
use crate::link::PARAMETER_COUNT;
use crate::model::filtered;
use crate::scalar::Real;

/// Length of a residual block, s. Many times the filter's memory (27 ms at 30 Hz) and a typical correlation of current
/// noise, and short enough that the twenty-four blocks before any trust last six seconds.
const BLOCK_SECONDS: f64 = 0.25;
/// Assumed noise as a share of the torque range of the band.
const NOISE_SHARE: f64 = 0.01;
/// Inputs beyond this (rad, rad/s, N·m) are refused: squares of filtered values stay finite in `f32`.
const MAX_INPUT: f64 = 1e6;

/// Constants of the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T> {
    filter: filtered::Config<T>,
    estimator: recursive::Config<T, PARAMETER_COUNT>,
}

/// State of the estimator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T: Real<Mask = bool>> {
    filter: filtered::State<T>,
    estimator: recursive::State<T, PARAMETER_COUNT>,
}

/// The on-line estimator. Call [`OneLinkEstimator::step`] at a fixed rate, [`OneLinkEstimator::report`] for results.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneLinkEstimator<T: Real<Mask = bool>> {
    config: Config<T>,
    state: State<T>,
}

impl<T: Real<Mask = bool>> Config<T> {
    /// `update_rate_hz`: calls of [`step`] per second, at least ten times the bandwidth.
    pub fn new(settings: &EstimatorSettings<T>, update_rate_hz: T) -> Result<Self, SettingsFault> {
        settings.check(update_rate_hz)?;
        let mut square = T::ZERO;
        for i in [1, 2, 4, 5] {
            square += (T::from_f64(0.5) * (settings.upper[i] - settings.lower[i])).squared();
        }
        let range = if T::ZERO.lt(square) {
            square.sqrt()
        } else {
            T::ONE
        };
        // Counted by comparison, because a `Real` has no conversion to an integer.
        let wanted = update_rate_hz * T::from_f64(BLOCK_SECONDS);
        let mut block = 1_u32;
        while block < 1 << 20 && T::from_f64(f64::from(block)).lt(wanted) {
            block += 1;
        }
        Ok(Self {
            filter: filtered::Config::new(
                settings.bandwidth,
                update_rate_hz,
                settings.slip_velocity,
            ),
            estimator: recursive::Config::new(
                settings.kind,
                &settings.lower,
                &settings.upper,
                range * T::from_f64(NOISE_SHARE),
                T::ONE / (settings.memory * update_rate_hz),
                block,
            ),
        })
    }

    /// Replaces the adaptation gain matrix Γ of the gradient update: see [`recursive::Config::with_adaptation`].
    pub fn with_adaptation(mut self, gain: &[[T; PARAMETER_COUNT]; PARAMETER_COUNT]) -> Self {
        self.estimator = self.estimator.with_adaptation(gain);
        self
    }
}

/// Processes one sample: position (rad, best reduced to a turn), velocity (rad/s), joint torque (N·m).
///
/// Values that are not finite or beyond the range of any rig are refused before the filter.
#[inline]
pub fn step<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &mut State<T>,
    q: T,
    qd: T,
    tau: T,
) -> Update {
    let largest = T::from_f64(MAX_INPUT);
    if !(q.abs().le(largest) && qd.abs().le(largest) && tau.abs().le(largest)) {
        return Update::Invalid;
    }
    let filtered = filtered::step(&config.filter, &mut state.filter, q, qd, tau);
    if !filtered.valid {
        return if filtered.fast {
            Update::Masked
        } else {
            Update::Slow
        };
    }
    recursive::update(
        &config.estimator,
        &mut state.estimator,
        &filtered.row,
        filtered.torque,
    )
}

/// Returns the current results, in the order of the parameter names.
pub fn report<T: Real<Mask = bool>>(
    config: &Config<T>,
    state: &State<T>,
) -> Report<T, PARAMETER_COUNT> {
    recursive::report(&config.estimator, &state.estimator)
}

impl<T: Real<Mask = bool>> OneLinkEstimator<T> {
    /// Returns an estimator that starts from the band.
    pub fn new(settings: &EstimatorSettings<T>, update_rate_hz: T) -> Result<Self, SettingsFault> {
        Ok(Self {
            config: Config::new(settings, update_rate_hz)?,
            state: State::default(),
        })
    }

    /// Replaces the constants and keeps the estimate: call [`restart`](Self::restart) before the next step.
    pub fn reconfigure(&mut self, config: &Config<T>) {
        self.config = *config;
    }

    /// See [`step`].
    #[inline]
    pub fn step(&mut self, q: T, qd: T, tau: T) -> Update {
        step(&self.config, &mut self.state, q, qd, tau)
    }

    /// Restarts the filter after a gap in the samples and keeps the estimate.
    pub fn interrupt(&mut self) {
        self.state.filter = filtered::State::default();
    }

    /// Resets the estimate and the filter. Not inlined: it is seldom called.
    #[inline(never)]
    pub fn restart(&mut self) {
        self.state = State::default();
    }

    /// See [`report`]. Not inlined: it is seldom called.
    #[inline(never)]
    pub fn report(&self) -> Report<T, PARAMETER_COUNT> {
        report(&self.config, &self.state)
    }

    /// Returns how often the parameters jumped.
    pub fn changes(&self) -> u32 {
        self.state.estimator.changes()
    }
}
