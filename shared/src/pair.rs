//! A number as the sum of two scalars: twice the digits of one, in the arithmetic that the microcontroller has hardware
//! for. Sums and products by Dekker (1971, "A floating-point technique for extending the available precision") and Knuth
//! (TAOCP 2, 4.2.2); some bits less than twice the digits, as the small parts are not renormalised everywhere.
//!
//! Left out: infinities and NaN, overflow within a product (above 10³⁴ in `f32`), lanes.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::Scalar;

/// high + low, low below half of the last digit of high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair<T> {
    high: T,
    low: T,
}

/// A sum without error.
#[inline(always)]
fn sum<T: Scalar>(a: T, b: T) -> Pair<T> {
    let high = a + b;
    let part = high - a;
    let low = (a - (high - part)) + (b - part);
    Pair { high, low }
}

/// A sum without error, where |a| ≥ |b|.
#[inline(always)]
fn ordered_sum<T: Scalar>(a: T, b: T) -> Pair<T> {
    let high = a + b;
    let low = b - (high - a);
    Pair { high, low }
}

/// Halves of a scalar's digits.
#[inline(always)]
fn split<T: Scalar>(a: T) -> (T, T) {
    let scaled = a * T::SPLITTER;
    let high = scaled - (scaled - a);
    (high, a - high)
}

/// A product without error.
#[inline(always)]
fn product<T: Scalar>(a: T, b: T) -> Pair<T> {
    let high = a * b;
    let ((a1, a2), (b1, b2)) = (split(a), split(b));
    let low = ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2;
    Pair { high, low }
}

impl<T: Scalar> Pair<T> {
    /// A scalar, exactly.
    #[inline(always)]
    pub(crate) fn new(value: T) -> Self {
        Self {
            high: value,
            low: T::ZERO,
        }
    }

    /// A whole number, exactly.
    #[inline(always)]
    pub(crate) fn from_u32(value: u32) -> Self {
        ordered_sum(
            T::from_u32(value >> 16) * T::from_u32(1 << 16),
            T::from_u32(value & 0xFFFF),
        )
    }

    /// A constant, as nearly as two scalars have it.
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        let high = T::from_f64(value);
        Self {
            high,
            low: T::from_f64(value - high.to_f64()),
        }
    }

    /// As one scalar.
    #[inline(always)]
    pub(crate) fn value(self) -> T {
        self.high
    }

    /// What is beside the nearest whole number, as one scalar. For less than 2²² in size.
    #[inline(always)]
    pub(crate) fn beside_whole(self) -> T {
        let rest = (self.high - self.high.rint()) + self.low;
        // The small part may have led over the half.
        rest - rest.rint()
    }

    #[inline(always)]
    fn scaled(self, power_of_two: T) -> Self {
        Self {
            high: self.high * power_of_two,
            low: self.low * power_of_two,
        }
    }

    /// Exponential function.
    #[inline(always)]
    pub(crate) fn exp(self) -> Self {
        let of = T::from_f64;
        let twos = (self.high * of(core::f64::consts::LOG2_E)).rint();
        let ln2 = Self::from_f64(core::f64::consts::LN_2);
        // Below 0.022: of the series all but its first two terms is small, and needs no second scalar.
        let rest = (self - ln2 * Self::new(twos)).scaled(of(1.0 / 16.0));
        let r = rest.high;
        let series = [
            1.0 / 5040.0,
            1.0 / 720.0,
            1.0 / 120.0,
            1.0 / 24.0,
            1.0 / 6.0,
            0.5,
        ];
        let tail = series
            .into_iter()
            .fold(of(1.0 / 40320.0), |sum, factor| sum * r + of(factor));
        let first = sum(T::ONE, r);
        let mut power = ordered_sum(first.high, first.low + rest.low + tail * r.squared());
        for _ in 0..4 {
            power = power * power;
        }
        let factor = T::select(twos.lt(T::ZERO), of(0.5), of(2.0));
        // More of them lead from any number to zero or infinity.
        let times = (twos.abs().to_f64() as u32).min(2200);
        for _ in 0..times {
            power = power.scaled(factor);
        }
        power
    }

    /// Natural logarithm of a number above zero: a scalar's, and one step of Newton's.
    #[inline(always)]
    pub(crate) fn ln(self) -> Self {
        let near = Self::new(self.high.ln());
        near + (self * (-near).exp() - Self::new(T::ONE))
    }
}

impl<T: Scalar> Add for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let high = sum(self.high, other.high);
        ordered_sum(high.high, high.low + (self.low + other.low))
    }
}

impl<T: Scalar> Neg for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl<T: Scalar> Sub for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<T: Scalar> Mul for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let high = product(self.high, other.high);
        let low = self.high * other.low + self.low * other.high;
        ordered_sum(high.high, high.low + low)
    }
}

impl<T: Scalar> Div for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::new(first);
        ordered_sum(first, rest.high / other.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(pair: Pair<f32>) -> f64 {
        f64::from(pair.high) + f64::from(pair.low)
    }

    #[test]
    fn two_singles_have_the_digits_of_a_double_nearly() {
        for k in 1..2000_u32 {
            let (a, b) = (k.wrapping_mul(2_654_435_761), k.wrapping_mul(40_503) + 7);
            let (x, y) = (Pair::<f32>::from_u32(a), Pair::<f32>::from_u32(b));
            let (a, b) = (f64::from(a), f64::from(b));
            assert_eq!((value(x), value(y)), (a, b));
            for (found, truth, bound) in [
                (x + y, a + b, 1e-13),
                (x * y, a * b, 1e-13),
                (x / y, a / b, 1e-13),
                (x.ln(), a.ln(), 1e-10),
            ] {
                let off = (value(found) / truth - 1.0).abs();
                assert!(off < bound, "{a} {b}: {off:e}");
            }
            // Where terms cancel the error is one of the terms.
            assert!((value(x - y) - (a - b)).abs() < 1e-13 * (a + b));
            let exponent = Pair::new(k as f32) / Pair::new(-200.0);
            let off = (value(exponent.exp()) / (f64::from(k) / -200.0).exp() - 1.0).abs();
            assert!(off < 1e-9, "{k}: {off:e}");
        }
    }

    #[test]
    fn beside_a_whole_number_is_what_is_left() {
        for (whole, rest) in [(0_u32, 0.25_f32), (4_000_000, -0.125), (70_001, 1e-4)] {
            let pair = Pair::from_u32(whole) + Pair::new(rest);
            assert!((pair.beside_whole() - rest).abs() < 1e-7 * rest.abs());
        }
    }
}
