//! Gain of recursive least squares with directional forgetting.
//!
//! Information R = P⁻¹ (measurement variance 1) is forgotten only where the sample brings new information: R ← R +
//! ε·φφᵀ, ε = λ − (1−λ)/ζ, ζ = φᵀPφ, gain K = Pφ/(1+ζ) (Kulhavý 1987, "Restricted exponential forgetting in real-time
//! identification", Automatica 23; Bittanti, Bolzern & Campi 1990, "Convergence and exponential convergence of
//! identification algorithms with directional forgetting factor", Automatica 26). R changes along φφᵀ only, so
//! directions that a motion does not excite keep their information exactly. Among the directional schemes (cf. Cao &
//! Schwartz 2000, Automatica 36) this one is invariant to scaling: in whitened coordinates one sample forgets the share
//! 1−λ of one direction, for any direction. With n directions excited each is therefore forgotten at (1−λ)/n. With 1−λ
//! = N·dt/memory, as [`Config::new`] sets it, the weight of old data is 1/e after `memory` if all N are excited, and
//! after memory·n/N if n are.
//!
//! Bounds: D ≥ `floor` keeps the gain alert without forgetting; a rank-one increase is cut where a variance would pass
//! `ceiling`.

use super::ud::UdFactor;
use crate::scalar::Real;

/// Smallest variance in a factor of P, as a share of the prior's (1): the square of 10⁻⁵ of the band.
const FLOOR: f64 = 1e-10;
/// Smallest leverage of a sample that is used, as a share of the leverage at which its own forgetting would settle.
const INFORMATION_SHARE: f64 = 0.01;
/// Relative distance from its fixed point within which leverage counts as settled. P is then left alone, so that
/// rounding errors do not accumulate during days of the same regressor.
const DEADBAND_SHARE: f64 = 1e-3;
/// Smallest leverage that is used without forgetting. A sample below it changes nothing in `f32`.
const MIN_LEVERAGE: f64 = 1e-9;

/// Constants of the update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config<T> {
    /// 1 − λ.
    forget: T,
    gate: T,
    deadband: T,
    ceiling: T,
    floor: T,
}

impl<T: Real<Mask = bool>> Config<T> {
    /// `share` = update interval/memory (0: nothing is forgotten), `directions` = N, `ceiling` = largest variance of a
    /// scaled parameter (its prior's).
    pub fn new(share: T, directions: usize, ceiling: T) -> Self {
        let forget = (share * T::from_f64(directions as f64)).clamp_to(T::ZERO, T::from_f64(0.5));
        Self {
            forget,
            gate: (forget * T::from_f64(INFORMATION_SHARE)).max(T::from_f64(MIN_LEVERAGE)),
            deadband: forget * T::from_f64(DEADBAND_SHARE),
            ceiling,
            floor: T::from_f64(FLOOR) * ceiling,
        }
    }
}

/// Returns the gain for the row `phi` and updates P. Returns `None` and keeps P if the row carries too little
/// information for its noise or is not finite. Cost at N = 6: about 200 operations.
#[inline]
pub fn gain<T: Real<Mask = bool>, const N: usize>(
    config: &Config<T>,
    p: &mut UdFactor<T, N>,
    phi: &[T; N],
) -> Option<[T; N]> {
    let (product, leverage) = p.multiply(phi);
    let max_leverage = T::from_f64(1e15);
    if !(config.gate.le(leverage) && leverage.lt(max_leverage)) {
        return None;
    }
    let lambda = T::ONE - config.forget;
    // ε·ζ: positive if the sample brings more information than is forgotten.
    let net = lambda * leverage - config.forget;
    if config.deadband.lt(net) {
        p.decrease(phi, leverage / net, config.floor);
    } else if net.lt(-config.deadband) {
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
