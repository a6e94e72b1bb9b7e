//! Gain of the normalised gradient update with an adaptation gain matrix.
//!
//! θ ← θ + Γφ·e/(1 + φᵀΓφ), Γ symmetric positive definite (Ioannou & Sun 1996, "Robust Adaptive Control",
//! sec. 4.3; Slotine & Li 1991, sec. 8.7). The normalisation bounds a step for any size of φ.

use crate::scalar::Real;

/// Returns the gain for the row `phi`; `None` if it is zero or not finite. Cost at N = 6: 90 operations.
#[inline]
pub fn gain<T: Real<Mask = bool>, const N: usize>(
    adaptation: &[[T; N]; N],
    phi: &[T; N],
) -> Option<[T; N]> {
    let mut k = [T::ZERO; N];
    let mut leverage = T::ZERO;
    for i in 0..N {
        for j in 0..N {
            k[i] += adaptation[i][j] * phi[j];
        }
        leverage += k[i] * phi[i];
    }
    if !(T::ZERO.lt(leverage) && leverage.lt(T::from_f64(1e15))) {
        return None;
    }
    let inverse = T::ONE / (T::ONE + leverage);
    for i in 0..N {
        k[i] *= inverse;
    }
    Some(k)
}
