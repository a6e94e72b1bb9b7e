//! A recursive estimator of N parameters inside a plausibility band.
//!
//! Parameters are scaled to their band, θ = centre + half·x with x in −1 … 1, and torques to a unit of assumed noise. P
//! starts at the identity: the band's half-width is the prior standard deviation. So `f32` is well conditioned for any
//! units of the parameters. The sums x are compensated (Kahan 1965), because an update late in a run is far below the
//! last bit of x.
//!
//! Published values are always projected onto the band. A parameter outside its band is not trusted, and neither for
//! [`BOUND_HOLD_BLOCKS`] blocks after. The gradient update itself is projected. Least squares is not: its first dozens
//! of rows overshoot. Cutting x there would keep an error that P no longer covers (measured: coverage of the 95 %
//! interval of J fell to 36 %).

use super::report::{Report, Update};
use super::settings::{EstimatorKind, finite};
use super::ud::UdFactor;
use super::uncertainty::{self, Block, Uncertainty};
use super::{gradient, least_squares};
use crate::scalar::Real;

/// Blocks during which a parameter is not trusted after it was at its band's edge.
pub const BOUND_HOLD_BLOCKS: u32 = 10;
/// Largest standard deviation of a trusted parameter, as a share of its band's width.
pub const TRUSTED_SHARE_OF_BAND: f64 = 0.05;
/// Half-widths from the band's centre at which least squares is cut: far beyond any overshoot.
const MAX_NORMALISED: f64 = 1e3;
/// Step of the gradient update relative to one forgetting of least squares. It is faster, because the gradient's
/// directions converge at different speeds by their excitation.
const GRADIENT_SPEED: f64 = 10.0;

/// Constants of the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T, const N: usize> {
    kind: EstimatorKind,
    least_squares: least_squares::Config<T>,
    adaptation: [[T; N]; N],
    residuals: uncertainty::Config<T>,
    centre: [T; N],
    half: [T; N],
    band: [[T; N]; 2],
    scale: [T; N],
    unit: T,
    bound_hold: u32,
}

impl<T: Real<Mask = bool>, const N: usize> Config<T, N> {
    /// `noise`: assumed standard deviation of the measurement (its unit, > 0; affects only how fast the prior loses its
    /// weight). `share`: update interval over memory, 0 to forget nothing. `block`: updates in a residual block, longer
    /// than the correlation of the residual. A parameter with an empty band stays at its centre and is never trusted.
    pub fn new(
        kind: EstimatorKind,
        lower: &[T; N],
        upper: &[T; N],
        noise: T,
        share: T,
        block: u32,
    ) -> Self {
        let half_factor = T::from_f64(0.5);
        let mut config = Self {
            kind,
            least_squares: least_squares::Config::new(share, N, T::ONE),
            adaptation: [[T::ZERO; N]; N],
            residuals: uncertainty::Config::new(
                block,
                T::ONE / (share * T::from_f64(f64::from(block.max(1)))).max(T::from_f64(1e-9)),
            ),
            centre: [T::ZERO; N],
            half: [T::ZERO; N],
            band: [*lower, *upper],
            scale: [T::ZERO; N],
            unit: noise,
            bound_hold: block.max(1).saturating_mul(BOUND_HOLD_BLOCKS),
        };
        let step = share * T::from_f64(GRADIENT_SPEED * N as f64);
        for i in 0..N {
            config.centre[i] = half_factor * (lower[i] + upper[i]);
            config.half[i] = (half_factor * (upper[i] - lower[i])).max(T::ZERO);
            config.scale[i] = config.half[i] / noise;
            // In units of the band: a row as large as the assumed torque range moves by `step`.
            config.adaptation[i][i] = step * T::from_f64(1e-4);
        }
        config
    }

    /// Replaces the adaptation gain matrix Γ of the gradient update, given in the parameters' units over
    /// torque: Δθ = Γφ·e/(1 + φᵀΓφ). Must be symmetric and positive definite.
    pub fn with_adaptation(mut self, gain: &[[T; N]; N]) -> Self {
        for i in 0..N {
            for j in 0..N {
                let scale = self.scale[i] * self.scale[j] * self.unit * self.unit;
                let inverse = if T::ZERO.lt(scale) {
                    T::ONE / scale
                } else {
                    T::ZERO
                };
                self.adaptation[i][j] = gain[i][j] * inverse * self.unit * self.unit;
            }
        }
        self
    }
}

/// State of the estimator. Without `WATCHES` the parameters are constant, and it never restarts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T, const N: usize, const WATCHES: bool = true> {
    x: [T; N],
    carry: [T; N],
    p: UdFactor<T, N>,
    uncertainty: Uncertainty<T, N, WATCHES>,
    at_bound: [u32; N],
    changes: u32,
}

impl<T: Real<Mask = bool>, const N: usize> Default for State<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real<Mask = bool>, const N: usize> State<T, N, false> {
    /// Returns the initial state for parameters that are constant.
    pub fn of_constant_parameters() -> Self {
        Self::new()
    }
}

impl<T: Real<Mask = bool>, const N: usize, const WATCHES: bool> State<T, N, WATCHES> {
    fn new() -> Self {
        Self {
            x: [T::ZERO; N],
            carry: [T::ZERO; N],
            p: UdFactor::diagonal([T::ONE; N]),
            uncertainty: Uncertainty::new(T::ONE),
            at_bound: [0; N],
            changes: 0,
        }
    }

    /// Returns the diagonal of P in scaled units (prior: 1). It is not the variance of the estimate: see [`report`].
    pub fn gain_variances(&self) -> [T; N] {
        self.p.variances()
    }

    /// Returns how often the parameters jumped.
    pub fn changes(&self) -> u32 {
        self.changes
    }
}

/// Processes one measurement y = row·θ + noise. Input that is not finite changes nothing.
#[inline]
pub fn update<T: Real<Mask = bool>, const N: usize, const WATCHES: bool>(
    config: &Config<T, N>,
    state: &mut State<T, N, WATCHES>,
    row: &[T; N],
    y: T,
) -> Update {
    let mut phi = [T::ZERO; N];
    let mut centred = y;
    let mut predicted = T::ZERO;
    for i in 0..N {
        phi[i] = row[i] * config.scale[i];
        centred -= row[i] * config.centre[i];
        predicted += phi[i] * (state.x[i] - state.carry[i]);
    }
    let residual = centred / config.unit - predicted;
    let mut size = residual * residual;
    for i in 0..N {
        size += phi[i] * phi[i];
    }
    if !finite(size) {
        return Update::Invalid;
    }
    let gain = match config.kind {
        EstimatorKind::LeastSquares => {
            least_squares::gain(&config.least_squares, &mut state.p, &phi)
        }
        EstimatorKind::Gradient => gradient::gain(&config.adaptation, &phi),
    };
    let Some(k) = gain else {
        return Update::Uninformative;
    };
    let limit = match config.kind {
        EstimatorKind::LeastSquares => T::from_f64(MAX_NORMALISED),
        EstimatorKind::Gradient => T::ONE,
    };
    for i in 0..N {
        let step = k[i] * residual - state.carry[i];
        let moved = state.x[i] + step;
        state.carry[i] = (moved - state.x[i]) - step;
        state.x[i] = moved;
        if limit.lt(moved.abs()) {
            state.x[i] = moved.clamp_to(-limit, limit);
            state.carry[i] = T::ZERO;
        }
        let outside = T::ONE.le(moved.abs());
        state.at_bound[i] = if outside {
            config.bound_hold
        } else {
            state.at_bound[i].saturating_sub(1)
        };
    }
    match state
        .uncertainty
        .update(&config.residuals, &phi, &k, residual)
    {
        Block::Normal => Update::Used,
        Block::Changed => {
            state.p = UdFactor::diagonal([T::ONE; N]);
            state.uncertainty = Uncertainty::new(T::ONE);
            state.changes = state.changes.saturating_add(1);
            Update::Changed
        }
    }
}

/// Returns the current results.
pub fn report<T: Real<Mask = bool>, const N: usize, const WATCHES: bool>(
    config: &Config<T, N>,
    state: &State<T, N, WATCHES>,
) -> Report<T, N> {
    let mut out = Report {
        value: config.centre,
        std: config.half,
        trusted: [false; N],
        residual_rms: config.unit * state.uncertainty.mean_square().sqrt(),
    };
    let variances = state.uncertainty.variances();
    let share = T::from_f64(2.0 * TRUSTED_SHARE_OF_BAND);
    for i in 0..N {
        let value = config.centre[i] + config.half[i] * state.x[i].clamp_to(-T::ONE, T::ONE);
        // Rounding of centre ± half has been seen to fall outside the band.
        let [lower, upper] = [config.band[0][i], config.band[1][i]];
        if T::ZERO.lt(config.half[i]) {
            out.value[i] = value.clamp_to(lower, upper);
        }
        if let Some(v) = variances {
            let std = v[i].sqrt();
            out.std[i] = config.half[i] * std;
            out.trusted[i] = std.le(share)
                && state.at_bound[i] == 0
                && !state.uncertainty.has_alarm()
                && T::ZERO.lt(config.half[i]);
        }
    }
    out
}
