//! The scalar type of every formula of this crate.
//!
//! One source serves `f32` on the microcontroller, `f64` on the desktop and [`Lanes`](crate::lanes::Lanes) of samples
//! in batches. Formulas therefore have no `if` on a value: comparisons return a [`Mask`], and [`Real::select`] selects
//! one of two results that were both computed.
//!
//! # The functions behind `f32`
//!
//! Largest errors against `f64`, measured over the range that the rig uses (test `f32_errors_are_as_stated`):
//!
//! | function | range | micromath 2.1 | libm 0.2 | measure | taken |
//! | --- | --- | --- | --- | --- | --- |
//! | sin, cos | −2π to 2π | 1.1·10⁻³ | 3.0·10⁻⁸ | absolute | `sincos.rs` of this crate, 8.4·10⁻⁸ and 9.2·10⁻⁸: a regressor column off by 10⁻³ biases its parameter, and libm works in `f64`, for which the microcontroller has no hardware |
//! | sqrt | 10⁻⁶ to 100 | 6.1·10⁻² | 6.0·10⁻⁸ | relative | libm |
//! | exp | −20 to 0 | 1.2·10⁻³ | 4.6·10⁻⁸ | absolute | libm: 10⁻³ is harmless in a Stribeck law, but filter poles exp(−ωT) ≈ 0.99 use the same function, and there it is a tenth of the time constant |
//! | tanh | −10 to 10 | 1.1·10⁻³ | 8.1·10⁻⁸ | absolute | `hyperbolic.rs` of this crate, 8.1·10⁻⁸: in half the time of libm's (micromath has none; 1 − 2/(exp 2x + 1) with its exp) |
//! | powf 1.5 | 10⁻³ to 10 | 1.7·10⁻¹ | 6.7·10⁻⁸ | relative | libm |
//!
//! From micromath the firmware therefore uses only rounding to whole numbers, which is exact below 2²³ (test
//! `micromath_rounds_exactly`).

use core::fmt::Debug;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

/// The result of comparing two scalars: one truth value per lane.
pub trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// Returns true if every lane is true.
    fn all(self) -> bool;
    /// Returns true if any lane is true.
    fn any(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn all(self) -> bool {
        self
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

/// A real number, or several of them in lanes.
pub trait Real:
    Copy
    + Debug
    + Default
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
{
    /// Result of a comparison.
    type Mask: Mask;
    /// Zero in every lane.
    const ZERO: Self;
    /// One in every lane.
    const ONE: Self;

    /// Returns the nearest representable value, the same in every lane.
    fn from_f64(value: f64) -> Self;
    /// Returns the nearest representable value of a whole number, the same in every lane.
    #[inline(always)]
    fn from_u32(value: u32) -> Self {
        Self::from_f64(f64::from(value))
    }
    /// Sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// Square root; NaN below zero.
    fn sqrt(self) -> Self;
    /// Exponential function.
    fn exp(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// `self` to a real power, for `self` ≥ 0.
    fn powf(self, exponent: Self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `self < other`, lane by lane; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`, lane by lane; false where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is true, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The smaller of two values.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    /// The larger of two values.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    /// `self` limited to `low ..= high`.
    #[inline(always)]
    fn clamp_to(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// −1, 0 or 1 by the sign; 0 for both zeros, as a friction law needs it (unlike `f64::signum`).
    #[inline(always)]
    fn sgn(self) -> Self {
        let positive = Self::select(Self::ZERO.lt(self), Self::ONE, Self::ZERO);
        Self::select(self.lt(Self::ZERO), -Self::ONE, positive)
    }
    /// The square.
    #[inline(always)]
    fn squared(self) -> Self {
        self * self
    }
    /// Sine of an angle in radians.
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// Cosine of an angle in radians.
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
}

/// A [`Real`] that is a single number, as used by a controller or a trajectory of one rig.
pub trait Scalar: Real<Mask = bool> {
    /// Returns the exact value in double precision.
    fn to_f64(self) -> f64;
}

impl Scalar for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

impl Scalar for f32 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    type Mask = bool;
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        libm::exp(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        libm::tanh(self)
    }
    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        libm::pow(self, exponent)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

/// The functions behind `f32`, by their measured error (see the test `f32_errors_are_as_stated`).
impl Real for f32 {
    type Mask = bool;
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    // Without a conversion through f64, for which the microcontroller has no hardware.
    #[inline(always)]
    fn from_u32(value: u32) -> Self {
        value as f32
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        crate::sincos::sincosf(self)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        libm::expf(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        crate::hyperbolic::tanhf(self)
    }
    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        libm::powf(self, exponent)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use micromath::F32Ext;

    /// Returns the largest absolute and relative error over an even grid.
    fn largest(
        low: f64,
        high: f64,
        f: impl Fn(f32) -> f32,
        exact: impl Fn(f64) -> f64,
    ) -> (f64, f64) {
        let count = 200_000;
        let (mut absolute, mut relative) = (0.0_f64, 0.0_f64);
        for k in 0..=count {
            let x = (low + (high - low) * f64::from(k) / f64::from(count)) as f32;
            let expected = exact(f64::from(x));
            let error = (f64::from(f(x)) - expected).abs();
            assert!(error.is_finite(), "at {x}");
            absolute = absolute.max(error);
            if expected != 0.0 {
                relative = relative.max(error / expected.abs());
            }
        }
        (absolute, relative)
    }

    /// Checks both directions: fails if the stated error is too small, or more than a tenth too large.
    fn assert_stated(name: &str, measured: f64, stated: f64) {
        assert!(
            measured <= stated && measured > 0.9 * stated,
            "{name}: stated {stated:e}, measured {measured:e}"
        );
    }

    #[test]
    fn micromath_rounds_exactly() {
        for k in (0..4000).chain(8_388_607 - 4000..=8_388_607) {
            for whole in [k as f32, -(k as f32)] {
                assert_eq!(F32Ext::round(whole), whole);
                assert_eq!(F32Ext::ceil(whole), whole);
            }
        }
        for (x, rounded, up) in [
            (1.4, 1.0, 2.0),
            (-1.4, -1.0, -1.0),
            (2.6, 3.0, 3.0),
            (-2.6, -3.0, -2.0),
        ] {
            assert_eq!((F32Ext::round(x), F32Ext::ceil(x)), (rounded, up));
        }
    }

    #[test]
    fn f32_errors_are_as_stated() {
        use core::f64::consts::TAU;
        let tanh = |x: f32| 1.0 - 2.0 / (F32Ext::exp(2.0 * x) + 1.0);
        for (name, measured, stated) in [
            (
                "micromath sin",
                largest(-TAU, TAU, F32Ext::sin, libm::sin).0,
                1.1e-3,
            ),
            (
                "micromath cos",
                largest(-TAU, TAU, F32Ext::cos, libm::cos).0,
                1.1e-3,
            ),
            (
                "libm sin",
                largest(-TAU, TAU, libm::sinf, libm::sin).0,
                3.0e-8,
            ),
            ("sin", largest(-TAU, TAU, Real::sin, libm::sin).0, 8.4e-8),
            ("cos", largest(-TAU, TAU, Real::cos, libm::cos).0, 9.2e-8),
            (
                "micromath sqrt",
                largest(1e-6, 100.0, F32Ext::sqrt, libm::sqrt).1,
                6.1e-2,
            ),
            (
                "sqrt",
                largest(1e-6, 100.0, Real::sqrt, libm::sqrt).1,
                6.0e-8,
            ),
            (
                "micromath exp",
                largest(-20.0, 0.0, F32Ext::exp, libm::exp).0,
                1.2e-3,
            ),
            ("exp", largest(-20.0, 0.0, Real::exp, libm::exp).0, 4.6e-8),
            (
                "micromath tanh",
                largest(-10.0, 10.0, tanh, libm::tanh).0,
                1.1e-3,
            ),
            (
                "tanh",
                largest(-10.0, 10.0, Real::tanh, libm::tanh).0,
                8.1e-8,
            ),
            (
                "micromath powf",
                largest(1e-3, 10.0, |x| F32Ext::powf(x, 1.5), |x| libm::pow(x, 1.5)).1,
                1.7e-1,
            ),
            (
                "powf",
                largest(1e-3, 10.0, |x| Real::powf(x, 1.5), |x| libm::pow(x, 1.5)).1,
                6.7e-8,
            ),
        ] {
            assert_stated(name, measured, stated);
        }
    }
}
