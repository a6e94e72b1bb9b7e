//! Counts the operations of a step of the on-line estimator.
#![allow(clippy::unwrap_used)]

use super::tests::{LOWER, RATE, TRUTH, UPPER, motion, torque};
use super::*;

/// A number that counts its operations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Counted(f64);

std::thread_local! {
    static OPERATIONS: core::cell::Cell<[u32; 3]> = const { core::cell::Cell::new([0; 3]) };
}

fn count(kind: usize) {
    OPERATIONS.with(|c| {
        let mut n = c.get();
        n[kind] += 1;
        c.set(n);
    });
}

macro_rules! counted {
    ($($op:ident $f:ident $assign:ident $g:ident $sign:tt $kind:expr;)*) => {$(
        impl core::ops::$op for Counted {
            type Output = Self;
            fn $f(self, o: Self) -> Self { count($kind); Self(self.0 $sign o.0) }
        }
        impl core::ops::$assign for Counted {
            fn $g(&mut self, o: Self) { count($kind); self.0 = self.0 $sign o.0; }
        }
    )*};
}
counted! {
    Add add AddAssign add_assign + 0;
    Sub sub SubAssign sub_assign - 0;
    Mul mul MulAssign mul_assign * 0;
    Div div DivAssign div_assign / 1;
}
impl core::ops::Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}
impl crate::scalar::Real for Counted {
    type Mask = bool;
    const ZERO: Self = Self(0.0);
    const ONE: Self = Self(1.0);
    fn from_f64(value: f64) -> Self {
        Self(value)
    }
    fn sin_cos(self) -> (Self, Self) {
        count(2);
        (Self(self.0.sin()), Self(self.0.cos()))
    }
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    fn exp(self) -> Self {
        Self(self.0.exp())
    }
    fn tanh(self) -> Self {
        Self(self.0.tanh())
    }
    fn powf(self, e: Self) -> Self {
        Self(self.0.powf(e.0))
    }
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    fn lt(self, o: Self) -> bool {
        self.0 < o.0
    }
    fn le(self, o: Self) -> bool {
        self.0 <= o.0
    }
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
}

/// The cost stated in `one_link`: [sums and products, divisions, sine and cosine] of the most expensive step.
#[test]
fn operations_are_as_stated() {
    let settings = EstimatorSettings::for_band(LOWER.map(Counted), UPPER.map(Counted));
    let mut e = OneLinkEstimator::new(&settings, Counted(RATE)).unwrap();
    let (mut max_operations, mut sum, mut used) = ([0; 3], [0_u64; 3], 0);
    for k in 0..30_000 {
        let m = motion(f64::from(k) / RATE, 0.0);
        OPERATIONS.with(|c| c.set([0; 3]));
        let update = e.step(Counted(m[0]), Counted(m[1]), Counted(torque(&TRUTH, m)));
        let n = OPERATIONS.with(core::cell::Cell::get);
        if update == Update::Used {
            used += 1;
            (0..3).for_each(|i| sum[i] += u64::from(n[i]));
        }
        (0..3).for_each(|i| max_operations[i] = n[i].max(max_operations[i]));
    }
    std::println!(
        "operations at most {max_operations:?}, mean {:?}",
        sum.map(|s| s / used)
    );
    assert!(
        max_operations[0] <= 788 && max_operations[1] <= 18 && max_operations[2] == 1,
        "{max_operations:?}"
    );
}
