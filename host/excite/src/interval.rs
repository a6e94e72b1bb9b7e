//! Interval arithmetic that encloses all values of a formula.
//!
//! Moore 1966. Each operation rounds outwards, so the result contains the true range. It may be wider, because every
//! occurrence of a variable counts as a separate variable.

use core::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

use rig_shared::scalar::{Mask, Real};

/// All numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Interval {
    pub low: f64,
    pub high: f64,
}

/// Result of a comparison of two intervals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    yes: bool,
    no: bool,
}

impl Mask for Answer {
    fn all(self) -> bool {
        !self.no
    }
    fn any(self) -> bool {
        self.yes
    }
}

impl BitAnd for Answer {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self {
            yes: self.yes && other.yes,
            no: self.no || other.no,
        }
    }
}

impl BitOr for Answer {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self {
            yes: self.yes || other.yes,
            no: self.no && other.no,
        }
    }
}

impl Not for Answer {
    type Output = Self;
    fn not(self) -> Self {
        Self {
            yes: self.no,
            no: self.yes,
        }
    }
}

impl Interval {
    /// Builds the interval from two bounds in either order.
    pub(super) fn hull(a: f64, b: f64) -> Self {
        Self {
            low: a.min(b),
            high: a.max(b),
        }
    }

    /// Widens it by `by` on both sides.
    pub(super) fn widened(self, by: f64) -> Self {
        Self {
            low: self.low - by,
            high: self.high + by,
        }
        .outwards()
    }

    /// Returns the largest absolute value.
    pub(super) fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    fn outwards(self) -> Self {
        Self {
            low: self.low.next_down(),
            high: self.high.next_up(),
        }
    }

    fn join(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Returns the range of sin(x + shift), `shift` a multiple of π/2, from its values at both ends.
    fn wave(self, at_ends: [f64; 2], peak: f64) -> Self {
        use core::f64::consts::{PI, TAU};
        // Returns true if a point of the grid `from + k·2π` may lie inside; allows for rounding of large angles.
        let slack = 1e-15 * (1.0 + self.magnitude());
        let holds = |from: f64| {
            ((self.low - slack - from) / TAU).ceil() <= ((self.high + slack - from) / TAU).floor()
        };
        let ends = Self::hull(at_ends[0], at_ends[1]).outwards().outwards();
        Self {
            low: if holds(peak + PI) {
                -1.0
            } else {
                ends.low.max(-1.0)
            },
            high: if holds(peak) { 1.0 } else { ends.high.min(1.0) },
        }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            low: self.low + other.low,
            high: self.high + other.high,
        }
        .outwards()
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self {
            low: self.low - other.high,
            high: self.high - other.low,
        }
        .outwards()
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let products = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        Self {
            low: products.into_iter().fold(f64::INFINITY, f64::min),
            high: products.into_iter().fold(f64::NEG_INFINITY, f64::max),
        }
        .outwards()
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.low <= 0.0 && other.high >= 0.0 {
            return Self {
                low: f64::NEG_INFINITY,
                high: f64::INFINITY,
            };
        }
        let inverse = Self::hull(1.0 / other.low, 1.0 / other.high).outwards();
        self * inverse
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            low: -self.high,
            high: -self.low,
        }
    }
}

macro_rules! assigning {
    ($trait:ident $method:ident $op:tt) => {
        impl $trait for Interval {
            fn $method(&mut self, other: Self) {
                *self = *self $op other;
            }
        }
    };
}

assigning!(AddAssign add_assign +);
assigning!(SubAssign sub_assign -);
assigning!(MulAssign mul_assign *);
assigning!(DivAssign div_assign /);

/// Applies an increasing function to both ends.
fn growing(x: Interval, f: impl Fn(f64) -> f64) -> Interval {
    Interval {
        low: f(x.low),
        high: f(x.high),
    }
    .outwards()
    .outwards()
}

impl Real for Interval {
    type Mask = Answer;
    const ZERO: Self = Self {
        low: 0.0,
        high: 0.0,
    };
    const ONE: Self = Self {
        low: 1.0,
        high: 1.0,
    };

    fn from_f64(value: f64) -> Self {
        Self {
            low: value,
            high: value,
        }
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin_low, cos_low) = Real::sin_cos(self.low);
        let (sin_high, cos_high) = Real::sin_cos(self.high);
        (
            self.wave([sin_low, sin_high], core::f64::consts::FRAC_PI_2),
            self.wave([cos_low, cos_high], 0.0),
        )
    }
    fn sqrt(self) -> Self {
        growing(self, f64::sqrt)
    }
    fn exp(self) -> Self {
        growing(self, f64::exp)
    }
    fn tanh(self) -> Self {
        growing(self, f64::tanh)
    }
    /// Encloses for bases ≥ 1 or ≤ 1, for which x^e is monotone in each argument; the hull over all four corners covers
    /// both.
    fn powf(self, exponent: Self) -> Self {
        let corners = [
            self.low.powf(exponent.low),
            self.low.powf(exponent.high),
            self.high.powf(exponent.low),
            self.high.powf(exponent.high),
        ];
        Self {
            low: corners.into_iter().fold(f64::INFINITY, f64::min),
            high: corners.into_iter().fold(f64::NEG_INFINITY, f64::max),
        }
        .outwards()
        .outwards()
    }
    fn abs(self) -> Self {
        let inside = self.low <= 0.0 && self.high >= 0.0;
        Self {
            low: if inside {
                0.0
            } else {
                self.low.abs().min(self.high.abs())
            },
            high: self.magnitude(),
        }
    }
    fn lt(self, other: Self) -> Answer {
        Answer {
            yes: self.low < other.high,
            no: self.high >= other.low,
        }
    }
    fn le(self, other: Self) -> Answer {
        Answer {
            yes: self.low <= other.high,
            no: self.high > other.low,
        }
    }
    fn select(mask: Answer, yes: Self, no: Self) -> Self {
        match (mask.yes, mask.no) {
            (true, false) => yes,
            (false, true) => no,
            _ => yes.join(no),
        }
    }
    fn squared(self) -> Self {
        let size = self.abs();
        Self {
            low: size.low * size.low,
            high: size.high * size.high,
        }
        .outwards()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn formula<T: Real>(x: T, y: T) -> T {
        let (s, c) = (x * y).sin_cos();
        s * x.squared() + c / (T::from_f64(2.5) + s) - (x - y).abs() * y.sgn() + (x + y).tanh()
    }

    #[test]
    fn every_value_lies_within() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        for _ in 0..2000 {
            let mut pick = |scale: f64| scale * (2.0 * random.random::<f64>() - 1.0);
            let x = Interval::hull(pick(4.0), pick(4.0));
            let y = Interval::hull(pick(1.0), pick(1.0));
            let range = formula(x, y);
            for k in 0..=8 {
                for l in 0..=8 {
                    let at = |i: Interval, k: i32| i.low + (i.high - i.low) * f64::from(k) / 8.0;
                    let value = formula(at(x, k), at(y, l));
                    assert!(
                        range.low <= value && value <= range.high,
                        "{x:?} {y:?} {range:?} {value}"
                    );
                }
            }
        }
    }

    #[test]
    fn narrow_intervals_stay_narrow() {
        for x in [0.3, 1.57, 3.2, -8.0] {
            let (s, c) = Interval::hull(x, x + 1e-6).sin_cos();
            assert!(s.high - s.low < 1.1e-6 && c.high - c.low < 1.1e-6);
        }
        let whole = Interval::hull(-10.0, 10.0).sin_cos();
        assert_eq!((whole.0.low, whole.1.high), (-1.0, 1.0));
    }
}
