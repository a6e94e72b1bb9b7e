//! Dual numbers: a value together with its exact derivatives in `N` directions.
//!
//! a + a'·ε with ε² = 0 (Clifford 1873; Griewank & Walther 2008, ch. 3). Every formula over [`Real`] evaluated with
//! [`Dual`] gives its value and, without truncation error, its directional derivatives. At a kink or a jump (`abs`,
//! `sgn`, `select`) the derivative is that of the branch taken; for `sgn` it is 0.

use core::array;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::scalar::Real;

/// A value and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T, const N: usize> {
    /// The value.
    pub value: T,
    /// Its derivatives by the `N` independent variables.
    pub derivative: [T; N],
}

impl<T: Real, const N: usize> Dual<T, N> {
    /// Returns a constant.
    #[inline(always)]
    pub fn constant(value: T) -> Self {
        Self {
            value,
            derivative: [T::ZERO; N],
        }
    }

    /// Returns the independent variable with that index; a constant if the index is out of range.
    #[inline(always)]
    pub fn variable(value: T, index: usize) -> Self {
        Self {
            value,
            derivative: array::from_fn(|k| if k == index { T::ONE } else { T::ZERO }),
        }
    }

    /// Returns the value of a function, with the chain rule for its slope.
    #[inline(always)]
    fn chain(self, value: T, slope: T) -> Self {
        Self {
            value,
            derivative: self.derivative.map(|d| slope * d),
        }
    }

    #[inline(always)]
    fn zip(self, other: Self, value: T, f: impl Fn(T, T) -> T) -> Self {
        Self {
            value,
            derivative: array::from_fn(|k| f(self.derivative[k], other.derivative[k])),
        }
    }
}

impl<T: Real, const N: usize> Default for Dual<T, N> {
    #[inline(always)]
    fn default() -> Self {
        Self::constant(T::ZERO)
    }
}

impl<T: Real, const N: usize> Add for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, self.value + other.value, |a, b| a + b)
    }
}

impl<T: Real, const N: usize> Sub for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, self.value - other.value, |a, b| a - b)
    }
}

// The product and quotient rules mix operators.
#[allow(clippy::suspicious_arithmetic_impl)]
impl<T: Real, const N: usize> Mul for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the product rule
    fn mul(self, other: Self) -> Self {
        self.zip(other, self.value * other.value, |a, b| {
            a * other.value + self.value * b
        })
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl<T: Real, const N: usize> Div for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the quotient rule
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.zip(other, quotient, |a, b| (a - quotient * b) / other.value)
    }
}

impl<T: Real, const N: usize> Neg for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -T::ONE)
    }
}

macro_rules! assigning {
    ($trait:ident $method:ident $op:tt) => {
        impl<T: Real, const N: usize> $trait for Dual<T, N> {
            #[inline(always)]
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

impl<T: Real, const N: usize> Real for Dual<T, N> {
    type Mask = T::Mask;
    const ZERO: Self = Self {
        value: T::ZERO,
        derivative: [T::ZERO; N],
    };
    const ONE: Self = Self {
        value: T::ONE,
        derivative: [T::ZERO; N],
    };

    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Self::constant(T::from_f64(value))
    }
    #[inline(always)]
    fn from_u32(value: u32) -> Self {
        Self::constant(T::from_u32(value))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, T::from_f64(0.5) / root)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let power = self.value.exp();
        self.chain(power, power)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        let tanh = self.value.tanh();
        self.chain(tanh, T::ONE - tanh * tanh)
    }
    /// The derivative by the exponent needs a logarithm, which [`Real`] does not have: exponents count as constants.
    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        let e = exponent.value;
        self.chain(self.value.powf(e), e * self.value.powf(e - T::ONE))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.chain(self.value.abs(), self.value.sgn())
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.value.lt(other.value)
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        self.value.le(other.value)
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        yes.zip(no, T::select(mask, yes.value, no.value), |a, b| {
            T::select(mask, a, b)
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::multibody::{Chain, JointGeometry, JointKind, inverse_dynamics};

    /// A function that uses every operation of the trait.
    fn every<T: Real>(x: T, y: T) -> T {
        let (s, c) = (x * y).sin_cos();
        let mut sum = (s / (c + T::from_f64(3.0))).exp() + (x * x + y).sqrt();
        sum += (x - y).abs().powf(T::from_f64(1.5));
        sum -= x.tanh() * y.squared();
        sum *= T::ONE - x.max(y) / T::from_f64(7.0);
        sum /= -T::ONE - x.squared();
        sum
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        for (x, y) in [(0.3, 1.2), (1.7, 0.4), (-0.6, 2.5)] {
            let dual = every(Dual::<f64, 2>::variable(x, 0), Dual::variable(y, 1));
            let h = 1e-5;
            let by_x = (every(x + h, y) - every(x - h, y)) / (2.0 * h);
            let by_y = (every(x, y + h) - every(x, y - h)) / (2.0 * h);
            assert_eq!(dual.value, every(x, y));
            assert!((dual.derivative[0] - by_x).abs() < 1e-8, "{dual:?} {by_x}");
            assert!((dual.derivative[1] - by_y).abs() < 1e-8, "{dual:?} {by_y}");
        }
    }

    #[test]
    fn the_torque_s_slope_over_acceleration_is_the_inertia() {
        // A point mass of 2 kg at 0.5 m: 0.5 kg·m² at any position.
        let joint = JointGeometry {
            kind: JointKind::Revolute,
            alpha: core::f64::consts::FRAC_PI_2,
            a: 0.0,
            theta: 0.0,
            d: 0.0,
        };
        let chain = Chain::<Dual<f64, 2>>::new(&[joint], [0.0, 0.0, -9.81]).unwrap();
        let mut row = [Dual::constant(0.0); 14];
        for (place, value) in [(0, 2.0), (1, 1.0), (7, 0.5), (9, 0.5)] {
            row[place] = Dual::constant(value);
        }
        let q = 0.7_f64;
        let mut tau = [Dual::constant(0.0)];
        inverse_dynamics(
            &chain,
            &[row],
            &[Dual::variable(q, 0)],
            &[Dual::constant(0.4)],
            &[Dual::variable(3.0, 1)],
            &mut tau,
        )
        .unwrap();
        assert!((tau[0].value - (1.5 + 9.81 * q.cos())).abs() < 1e-12);
        assert!((tau[0].derivative[0] + 9.81 * q.sin()).abs() < 1e-12);
        assert!((tau[0].derivative[1] - 0.5).abs() < 1e-12);
    }
}
