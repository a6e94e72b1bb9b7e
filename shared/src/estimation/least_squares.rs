//! Gain of recursive least squares with directional forgetting.
//!
//! Information R = P⁻¹ (measurement variance 1) is forgotten only where the sample brings new
//! information: R ← R + ε·φφᵀ, ε = λ − (1−λ)/ζ, ζ = φᵀPφ, gain K = Pφ/(1+ζ)
//! (Kulhavý 1987, "Restricted exponential forgetting in real-time identification", Automatica 23;
//! Bittanti, Bolzern & Campi 1990, "Convergence and exponential convergence of identification algorithms with
//! directional forgetting factor", Automatica 26). R changes along φφᵀ alone, so what a motion does not excite
//! is kept exactly. Among the directional schemes (cf. Cao & Schwartz 2000, Automatica 36) this one is invariant
//! to scaling: in whitened coordinates one sample forgets the share 1−λ of one direction, whichever it is.
//! With n directions excited each is therefore forgotten at (1−λ)/n; with 1−λ = N·dt/memory, as
//! [`Config::new`] sets it, old data weigh 1/e after `memory` where all N are excited, and after memory·n/N where n are.
//!
//! Bounds: D ≥ `floor` keeps the gain alert without forgetting; a rank-one increase is cut
//! where a variance would pass `ceiling`.

use super::ud::UdFactor;
use crate::scalar::Real;

/// Least variance kept in a factor of P, as a share of the prior's (1): the square of 10⁻⁵ of the band.
const FLOOR: f64 = 1e-10;
/// A sample whose leverage is below this share of what its own forgetting would settle at is not used.
const INFORMATION_SHARE: f64 = 0.01;
/// Leverage is taken as settled within this share of its fixed point; P is then left alone, so that
/// rounding does not add up during days of one and the same regressor.
const SETTLED_SHARE: f64 = 1e-3;
/// Without forgetting: least leverage used. A sample below it moves nothing in `f32`.
const LEAST_LEVERAGE: f64 = 1e-9;

/// Constants of the update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T> {
    /// 1 − λ.
    forget: T,
    gate: T,
    settled: T,
    ceiling: T,
    floor: T,
}

impl<T: Real<Mask = bool>> Config<T> {
    /// `share` = update interval/memory (0: nothing is forgotten), `directions` = N, `ceiling` the largest variance
    /// that a scaled parameter may have (its prior's).
    pub fn new(share: T, directions: usize, ceiling: T) -> Self {
        let forget = (share * T::from_f64(directions as f64)).clamp_to(T::ZERO, T::from_f64(0.5));
        Self {
            forget,
            gate: (forget * T::from_f64(INFORMATION_SHARE)).max(T::from_f64(LEAST_LEVERAGE)),
            settled: forget * T::from_f64(SETTLED_SHARE),
            ceiling,
            floor: T::from_f64(FLOOR) * ceiling,
        }
    }
}

/// Gain for the row `phi`, and P brought up to date; `None`, and P untouched, where the row carries no
/// information worth its noise or is not finite. Cost at N = 6: about 200 operations.
#[inline]
pub fn gain<T: Real<Mask = bool>, const N: usize>(
    config: &Config<T>,
    p: &mut UdFactor<T, N>,
    phi: &[T; N],
) -> Option<[T; N]> {
    let (product, leverage) = p.times(phi);
    let most = T::from_f64(1e15);
    if !(config.gate.le(leverage) && leverage.lt(most)) {
        return None;
    }
    let lambda = T::ONE - config.forget;
    // ε·ζ: positive where the sample brings more than is forgotten.
    let net = lambda * leverage - config.forget;
    if config.settled.lt(net) {
        p.decrease(phi, leverage / net, config.floor);
    } else if net.lt(-config.settled) {
        // P grows by c·Pφ·(Pφ)ᵀ with c = −ε/(1+εζ), cut at the ceiling.
        let mut c = -net / (leverage * lambda * (T::ONE + leverage));
        let variances = p.variances();
        for i in 0..N {
            let room = (config.ceiling - variances[i]).max(T::ZERO);
            let step = product[i] * product[i];
            if room.lt(c * step) {
                c = room / step;
            }
        }
        p.increase(product, c);
    }
    let inverse = T::ONE / (T::ONE + leverage);
    let mut k = product;
    for i in 0..N {
        k[i] *= inverse;
    }
    Some(k)
}
