//! Several samples side by side, so that one formula serves a batch.
//!
//! [`Lanes<N>`] is an array of `f64`, `Lanes<N, f32>` one of `f32`. Every operation is a loop over it, which the compiler turns into vector
//! instructions of the caller's width. Four or eight lanes of `f64` fit the desktop's registers, and twice as many of `f32`.
//!
//! [`Real::sin_cos`] is branch-free (Cody and Waite 1980: reduction by π/2 in three parts, then polynomials of degree
//! 13 and 14, for `f32` of 7 and 8). Its error is at most 2 units in the last place for |x| ≤ [`Element::ANGLE_LIMIT`]
//! (measured for `f64`: it differs from libm by at most 1, also at the doubles nearest to the multiples of π/2; for `f32`: 1.5 over all numbers from 10⁻⁴ on). Beyond
//! it the error grows, and from 2³¹ on (`f32`: 2²²) the result is invalid. The same bound holds with fused operations
//! ([`MulAdd`]), which the block kernels use if available. `exp`, `tanh` and `powf` take one lane at a time.

mod element;
mod mul_add;
mod sine;

use core::array;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

use crate::scalar::{Mask, Real};

pub use element::Element;
pub use mul_add::{MulAdd, Rounded};
pub(crate) use sine::sin_cos;

/// `N` real numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Lanes<const N: usize, T = f64>(pub [T; N]);

/// `N` truth values, with all bits set if true, so that comparisons and selections stay in vector registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct LaneMask<const N: usize, T: Element = f64>([T::Bits; N]);

impl<const N: usize, T: Element> LaneMask<N, T> {
    /// Returns the truth values as an array.
    #[inline(always)]
    pub fn to_array(self) -> [bool; N] {
        array::from_fn(|k| self.0[k] != T::Bits::default())
    }
}

impl<const N: usize, T: Element> Mask for LaneMask<N, T> {
    #[inline(always)]
    fn all(self) -> bool {
        self.0.iter().fold(!T::Bits::default(), |all, &m| all & m) != T::Bits::default()
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(T::Bits::default(), |any, &m| any | m) != T::Bits::default()
    }
}

impl<const N: usize, T: Element> BitAnd for LaneMask<N, T> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(array::from_fn(|k| self.0[k] & other.0[k]))
    }
}

impl<const N: usize, T: Element> BitOr for LaneMask<N, T> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(array::from_fn(|k| self.0[k] | other.0[k]))
    }
}

impl<const N: usize, T: Element> Not for LaneMask<N, T> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(array::from_fn(|k| !self.0[k]))
    }
}

impl<const N: usize, T: Element> Default for Lanes<N, T> {
    #[inline(always)]
    fn default() -> Self {
        Self([T::ZERO; N])
    }
}

impl<const N: usize, T: Element> Lanes<N, T> {
    /// The same value in every lane.
    #[inline(always)]
    pub const fn splat(value: T) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(T) -> T) -> Self {
        Self(array::from_fn(|k| f(self.0[k])))
    }
}

macro_rules! lane_operator {
    ($trait:ident $method:ident $assign_trait:ident $assign_method:ident $op:tt) => {
        impl<const N: usize, T: Element> $trait for Lanes<N, T> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(array::from_fn(|k| self.0[k] $op other.0[k]))
            }
        }
        impl<const N: usize, T: Element> $assign_trait for Lanes<N, T> {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = *self $op other;
            }
        }
    };
}

lane_operator!(Add add AddAssign add_assign +);
lane_operator!(Sub sub SubAssign sub_assign -);
lane_operator!(Mul mul MulAssign mul_assign *);
lane_operator!(Div div DivAssign div_assign /);

impl<const N: usize, T: Element> Neg for Lanes<N, T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl<const N: usize, T: Element> Real for Lanes<N, T> {
    type Mask = LaneMask<N, T>;
    const ZERO: Self = Self([T::ZERO; N]);
    const ONE: Self = Self([T::ONE; N]);

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self::splat(T::from_f64(value))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let mut sine = self;
        let mut cosine = self;
        for k in 0..N {
            let (s, c) = sin_cos::<T, Rounded>(self.0[k]);
            sine.0[k] = s;
            cosine.0[k] = c;
        }
        (sine, cosine)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(T::sqrt)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.map(T::exp)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        self.map(T::tanh)
    }
    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        Self(array::from_fn(|k| self.0[k].powf(exponent.0[k])))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(T::abs)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<N, T> {
        LaneMask(array::from_fn(|k| T::mask(self.0[k] < other.0[k])))
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<N, T> {
        LaneMask(array::from_fn(|k| T::mask(self.0[k] <= other.0[k])))
    }
    #[inline(always)]
    fn select(mask: LaneMask<N, T>, yes: Self, no: Self) -> Self {
        Self(array::from_fn(|k| T::pick(mask.0[k], yes.0[k], no.0[k])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Returns the distance in units in the last place of the expected value.
    fn ulps(value: f64, expected: f64) -> f64 {
        let next = f64::from_bits(expected.abs().to_bits() + 1);
        (value - expected).abs() / (next - expected.abs())
    }

    #[derive(Clone, Copy)]
    struct Fused;

    impl MulAdd<f64> for Fused {
        const FUSED: bool = true;

        fn mul_add(a: f64, b: f64, c: f64) -> f64 {
            a.mul_add(b, c)
        }
    }

    impl MulAdd<f32> for Fused {
        const FUSED: bool = true;

        fn mul_add(a: f32, b: f32, c: f32) -> f32 {
            a.mul_add(b, c)
        }
    }

    /// Returns the errors of the lanes and of the fused version.
    fn worst(angles: &[f64]) -> [f64; 2] {
        let mut worst = [0.0_f64; 2];
        for chunk in angles.chunks_exact(8) {
            let lanes = Lanes::<8>(array::from_fn(|k| chunk[k]));
            let (s, c) = lanes.sin_cos();
            for k in 0..8 {
                let (expected_s, expected_c) = libm::sincos(chunk[k]);
                for (worst, (s, c)) in worst
                    .iter_mut()
                    .zip([(s.0[k], c.0[k]), sin_cos::<f64, Fused>(chunk[k])])
                {
                    for error in [ulps(s, expected_s), ulps(c, expected_c)] {
                        assert!(error.is_finite(), "at {}", chunk[k]);
                        *worst = worst.max(error);
                    }
                }
            }
        }
        worst
    }

    #[test]
    fn sin_cos_errs_by_two_ulps_at_most_over_the_stated_range() {
        // The argument steps by an irrational amount so that all mantissas occur.
        let spread: Vec<f64> = (0..1_000_000)
            .map(|k| (f64::from(k) - 500_000.0) * 0.199_999_123_456_789)
            .collect();
        let near: Vec<f64> = (0..400_000)
            .map(|k| (f64::from(k) - 200_000.0) * 3.3e-5)
            .collect();
        // The hard cases: the doubles nearest to every multiple of π/2 in the range, where all digits cancel.
        let multiples: Vec<f64> = (-63_661..=63_661)
            .flat_map(|k| {
                let x = f64::from(k) * core::f64::consts::FRAC_PI_2;
                [x, f64::from_bits(x.to_bits().wrapping_add(1))]
            })
            .filter(|x| x.abs() <= f64::ANGLE_LIMIT && *x != 0.0)
            .collect();
        let tiny: Vec<f64> = (1..=960)
            .map(|k| 0.97 * libm::exp2(-f64::from(k)))
            .collect();
        for (name, angles) in [
            ("spread", spread),
            ("near", near),
            ("multiples", multiples),
            ("tiny", tiny),
        ] {
            let worst = worst(&angles);
            assert!(worst.iter().all(|w| *w <= 2.0), "{name}: {worst:?} ulp");
        }
    }

    /// Returns the distance in units in the last place of the expected value as an `f32`.
    fn ulps_single(value: f32, expected: f64) -> f64 {
        let near = (expected as f32).abs();
        let next = f32::from_bits(near.to_bits() + 1);
        (f64::from(value) - expected).abs() / f64::from(next - near)
    }

    #[test]
    fn sin_cos_of_f32_errs_by_two_ulps_at_most_over_the_stated_range() {
        // A 61st of all numbers from a thousandth on, and the hard cases: those nearest to the multiples of π/2.
        let spread = (1e-3_f32.to_bits()..=f32::ANGLE_LIMIT.to_bits()).step_by(61);
        let multiples = (1..=254).flat_map(|k| {
            let nearest = (f64::from(k) * core::f64::consts::FRAC_PI_2) as f32;
            nearest.to_bits() - 3..=nearest.to_bits() + 3
        });
        let tiny = (1..120).map(|k| (0.97 * libm::exp2f(-(k as f32))).to_bits());
        for x in spread.chain(multiples).chain(tiny).map(f32::from_bits) {
            for x in [x, -x] {
                let (sine, cosine) = libm::sincos(f64::from(x));
                let ([s], [c]) = {
                    let (s, c) = Lanes::<1, f32>([x]).sin_cos();
                    (s.0, c.0)
                };
                for (s, c) in [(s, c), sin_cos::<f32, Fused>(x)] {
                    let worst = ulps_single(s, sine).max(ulps_single(c, cosine));
                    assert!(worst <= 2.0, "at {x}: {worst} ulp");
                }
            }
        }
    }

    #[test]
    fn lanes_of_f32_compute_as_f32() {
        let (a, b) = ([1.5_f32, -0.0, f32::NAN, 3.0], [2.0_f32, 0.0, 1.0, -1.0]);
        let (x, y) = (Lanes(a), Lanes(b));
        assert_eq!(x.lt(y).to_array(), [true, false, false, false]);
        assert_eq!(x.le(y).to_array(), [true, true, false, false]);
        assert_eq!(
            Lanes::select(x.lt(y), y, Lanes::splat(7.0)).0,
            [2.0, 7.0, 7.0, 7.0]
        );
        for k in [0, 1, 3] {
            assert_eq!(((x + y) * x - x).0[k], (a[k] + b[k]) * a[k] - a[k]);
            assert_eq!(x.tanh().0[k], Real::tanh(a[k]));
        }
    }

    #[test]
    fn comparisons_are_false_for_nan_and_select_picks_lane_by_lane() {
        let a = Lanes::<4>([1.0, f64::NAN, -0.0, 3.0]);
        let b = Lanes::<4>([2.0, 2.0, 0.0, f64::NAN]);
        assert_eq!(a.lt(b).to_array(), [true, false, false, false]);
        assert_eq!(a.le(b).to_array(), [true, false, true, false]);
        assert_eq!(
            Lanes::select(a.le(b), Lanes::splat(1.0), Lanes::splat(-1.0)).0,
            [1.0, -1.0, 1.0, -1.0]
        );
        assert!(a.le(b).any() && !a.le(b).all() && (a.le(b) | !a.le(b)).all());
    }

    #[test]
    fn sgn_is_zero_at_both_zeros() {
        assert_eq!(
            Lanes::<4>([-2.0, -0.0, 0.0, 5.0]).sgn().0,
            [-1.0, 0.0, 0.0, 1.0]
        );
    }

    proptest! {
        #[test]
        fn arithmetic_agrees_with_f64(a in proptest::array::uniform4(-1e3..1e3_f64), b in proptest::array::uniform4(0.1..1e3_f64)) {
            let (x, y) = (Lanes(a), Lanes(b));
            for k in 0..4 {
                prop_assert_eq!(((x + y) * x - x / y).0[k], (a[k] + b[k]) * a[k] - a[k] / b[k]);
                prop_assert_eq!(x.clamp_to(-y, y).0[k], a[k].clamp_to(-b[k], b[k]));
                prop_assert_eq!(y.sqrt().0[k], libm::sqrt(b[k]));
            }
        }
    }
}
