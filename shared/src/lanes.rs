//! Several samples side by side, so that one formula serves a batch.
//!
//! [`Lanes<N>`] is an array of `f64`. Every operation is a loop over it, which the compiler turns into vector
//! instructions of the caller's width. Four or eight lanes fit the desktop's registers.
//!
//! [`Real::sin_cos`] is branch-free (Cody and Waite 1980: reduction by π/2 in three parts, then polynomials of degree
//! 13 and 14). Its error is at most 2 units in the last place for |x| ≤ [`ANGLE_LIMIT`] (measured: it differs from libm
//! by at most 1, also at the doubles nearest to the multiples of π/2). Beyond it the error grows, and from 2³¹ on the
//! result is invalid. The same bound holds with fused operations ([`MulAdd`]), which the block kernels use if
//! available. `exp`, `tanh` and `powf` use libm lane by lane.

use core::array;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

use crate::scalar::{Mask, Real};

/// Largest |x|, rad, for which [`Real::sin_cos`] of [`Lanes`] keeps its stated error: the number of quarter turns still
/// fits into the 16 bits that the first two parts of π/2 leave free.
pub const ANGLE_LIMIT: f64 = 1.0e5;

/// Rule for adding a product to a number.
pub trait MulAdd: Copy {
    /// True if the product is added without rounding.
    const FUSED: bool;

    /// a·b + c
    fn mul_add(a: f64, b: f64, c: f64) -> f64;
}

/// Product and sum rounded one after the other: the same bits on every machine.
///
/// The caller chooses the fused kind if the machine has an instruction for it; otherwise it is a slow function.
#[derive(Clone, Copy, Debug)]
pub struct Rounded;

impl MulAdd for Rounded {
    const FUSED: bool = false;

    #[inline(always)]
    fn mul_add(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
}

/// `N` real numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Lanes<const N: usize>(pub [f64; N]);

/// `N` truth values, with all bits set if true, so that comparisons and selections stay in vector registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct LaneMask<const N: usize>([u64; N]);

impl<const N: usize> LaneMask<N> {
    /// Returns the truth values as an array.
    #[inline(always)]
    pub fn to_array(self) -> [bool; N] {
        array::from_fn(|k| self.0[k] != 0)
    }
}

impl<const N: usize> Mask for LaneMask<N> {
    #[inline(always)]
    fn all(self) -> bool {
        self.0.iter().fold(!0, |all, &m| all & m) != 0
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(0, |any, &m| any | m) != 0
    }
}

impl<const N: usize> BitAnd for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(array::from_fn(|k| self.0[k] & other.0[k]))
    }
}

impl<const N: usize> BitOr for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(array::from_fn(|k| self.0[k] | other.0[k]))
    }
}

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(array::from_fn(|k| !self.0[k]))
    }
}

impl<const N: usize> Default for Lanes<N> {
    #[inline(always)]
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<const N: usize> Lanes<N> {
    /// The same value in every lane.
    #[inline(always)]
    pub const fn splat(value: f64) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self(array::from_fn(|k| f(self.0[k])))
    }
}

macro_rules! lane_operator {
    ($trait:ident $method:ident $assign_trait:ident $assign_method:ident $op:tt) => {
        impl<const N: usize> $trait for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(array::from_fn(|k| self.0[k] $op other.0[k]))
            }
        }
        impl<const N: usize> $assign_trait for Lanes<N> {
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

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

/// π/2 in three parts; the first two have 37 significant bits, so their products with a 16-bit count are exact.
const HALF_PI: [f64; 3] = [
    1.5707963267923333,
    2.5633441515839558e-12,
    1.0562999066987428e-23,
];

/// π/2 in three parts of 53 bits, for products that are added without rounding.
const HALF_PI_FUSED: [f64; 3] = [
    core::f64::consts::FRAC_PI_2,
    6.123233995736766e-17,
    -1.4973849048591698e-33,
];

/// 1.5·2⁵²: its addition rounds to the nearest integer and leaves that integer in the low bits of the sum.
const ROUND: f64 = 6755399441055744.0;

/// (sin r − r)/r³ as a polynomial in r², |r| ≤ π/4, interpolated at the Chebyshev points with 70 digits. It is minimax
/// up to a small factor; truncation below 2·10⁻¹⁷ of sin r.
const SINE: [f64; 6] = [
    -0.16666666666666666,
    0.008333333333330946,
    -0.0001984126983675497,
    2.755731610068312e-06,
    -2.5051131455447428e-08,
    1.591810123167728e-10,
];

/// (cos r − 1 + r²/2)/r⁴ likewise; truncation below 10⁻¹⁸.
const COSINE: [f64; 6] = [
    0.041666666666666664,
    -0.0013888888888887395,
    2.4801587298763433e-05,
    -2.7557317270560385e-07,
    2.087614602470193e-09,
    -1.1382614869434128e-11,
];

#[inline(always)]
fn horner<F: MulAdd>(c: &[f64; 6], z: f64) -> f64 {
    let (last, others) = (c[5], &c[..5]);
    let mut sum = last;
    for c in others.iter().rev() {
        sum = F::mul_add(z, sum, *c);
    }
    sum
}

#[inline(always)]
fn pick(mask: u64, yes: f64, no: f64) -> f64 {
    f64::from_bits((yes.to_bits() & mask) | (no.to_bits() & !mask))
}

#[inline(always)]
pub(crate) fn sin_cos<F: MulAdd>(x: f64) -> (f64, f64) {
    let rounded = F::mul_add(x, core::f64::consts::FRAC_2_PI, ROUND);
    let count = rounded - ROUND;
    let quadrant = rounded.to_bits();
    let (sine, cosine) = if F::FUSED {
        first_quadrant_fused::<F>(x, count)
    } else {
        first_quadrant(x, count)
    };
    let sine_sign = (quadrant & 2) << 62;
    let cosine_sign = (quadrant.wrapping_add(1) & 2) << 62;
    let (s, c) = if F::FUSED {
        // Processors with fused operations select by the sign bit.
        let odd = (quadrant << 63).cast_signed() < 0;
        if odd { (cosine, sine) } else { (sine, cosine) }
    } else {
        let odd = 0u64.wrapping_sub(quadrant & 1);
        (pick(odd, cosine, sine), pick(odd, sine, cosine))
    };
    (
        f64::from_bits(s.to_bits() ^ sine_sign),
        f64::from_bits(c.to_bits() ^ cosine_sign),
    )
}

/// Returns sine and cosine of x minus `count` right angles.
#[inline(always)]
fn first_quadrant(x: f64, count: f64) -> (f64, f64) {
    // The remainder as a sum r + tail: near multiples of π/2 the leading digits cancel, and the tail holds them.
    let first = x - count * HALF_PI[0];
    let second = count * HALF_PI[1];
    let difference = first - second;
    let shadow = first - difference;
    let lost = (first - (difference + shadow)) + (shadow - second);
    let low = lost - count * HALF_PI[2];
    let r = difference + low;
    let tail = (difference - r) + low;

    let z = r * r;
    let half = 0.5 * z;
    let head = 1.0 - half;
    let sine = r + (r * z * horner::<Rounded>(&SINE, z) + tail * head);
    let rest = z * z * horner::<Rounded>(&COSINE, z) - r * tail;
    (sine, head + (((1.0 - head) - half) + rest))
}

/// The same with fused operations. They need no tail: the remainder is accurate to half a unit in its last place.
#[inline(always)]
fn first_quadrant_fused<F: MulAdd>(x: f64, count: f64) -> (f64, f64) {
    // Exact: x and the product are multiples of 2⁻⁵³ (or x is below 0.8 and the count 0), their difference is below 1.
    let first = F::mul_add(-count, HALF_PI_FUSED[0], x);
    let second = F::mul_add(-count, HALF_PI_FUSED[1], first);
    let r = F::mul_add(-count, HALF_PI_FUSED[2], second);
    let z = r * r;
    let sine = F::mul_add(r * z, horner::<F>(&SINE, z), r);
    let half = F::mul_add(z, horner::<F>(&COSINE, z), -0.5);
    (sine, F::mul_add(z, half, 1.0))
}

impl<const N: usize> Real for Lanes<N> {
    type Mask = LaneMask<N>;
    const ZERO: Self = Self([0.0; N]);
    const ONE: Self = Self([1.0; N]);

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self::splat(value)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let mut sine = self;
        let mut cosine = self;
        for k in 0..N {
            let (s, c) = sin_cos::<Rounded>(self.0[k]);
            sine.0[k] = s;
            cosine.0[k] = c;
        }
        (sine, cosine)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(libm::sqrt)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.map(libm::exp)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        self.map(libm::tanh)
    }
    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        Self(array::from_fn(|k| libm::pow(self.0[k], exponent.0[k])))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f64::abs)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<N> {
        LaneMask(array::from_fn(
            |k| {
                if self.0[k] < other.0[k] { !0 } else { 0 }
            },
        ))
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<N> {
        LaneMask(array::from_fn(
            |k| {
                if self.0[k] <= other.0[k] { !0 } else { 0 }
            },
        ))
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        Self(array::from_fn(|k| pick(mask.0[k], yes.0[k], no.0[k])))
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

    impl MulAdd for Fused {
        const FUSED: bool = true;

        fn mul_add(a: f64, b: f64, c: f64) -> f64 {
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
                    .zip([(s.0[k], c.0[k]), sin_cos::<Fused>(chunk[k])])
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
            .filter(|x| x.abs() <= ANGLE_LIMIT && *x != 0.0)
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
