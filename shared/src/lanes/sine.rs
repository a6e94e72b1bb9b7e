//! Sine and cosine without branches.

use super::element::Element;
use super::mul_add::{MulAdd, Rounded};

#[inline(always)]
fn horner<T: Element, F: MulAdd<T>>(c: &[T], z: T) -> T {
    let mut sum = T::ZERO;
    if let Some((last, others)) = c.split_last() {
        sum = *last;
        for c in others.iter().rev() {
            sum = F::mul_add(z, sum, *c);
        }
    }
    sum
}

/// Returns sine and cosine of an angle, rad, |x| ≤ [`Element::ANGLE_LIMIT`].
#[inline(always)]
pub(crate) fn sin_cos<T: Element, F: MulAdd<T>>(x: T) -> (T, T) {
    let rounded = F::mul_add(x, T::QUARTERS, T::ROUND);
    let count = rounded - T::ROUND;
    let (sine, cosine) = if F::FUSED {
        first_quadrant_fused::<T, F>(x, count)
    } else {
        first_quadrant(x, count)
    };
    T::turned(sine, cosine, rounded, F::FUSED)
}

/// Returns sine and cosine of x minus `count` right angles.
#[inline(always)]
fn first_quadrant<T: Element>(x: T, count: T) -> (T, T) {
    // The remainder as a sum r + tail: near multiples of π/2 the leading digits cancel, and the tail holds them.
    let first = x - count * T::HALF_PI[0];
    let second = count * T::HALF_PI[1];
    let difference = first - second;
    let shadow = first - difference;
    let lost = (first - (difference + shadow)) + (shadow - second);
    let low = lost - count * T::HALF_PI[2];
    let r = difference + low;
    let tail = (difference - r) + low;

    let z = r * r;
    let half = T::HALF * z;
    let head = T::ONE - half;
    let sine = r + (r * z * horner::<T, Rounded>(T::SINE, z) + tail * head);
    let rest = z * z * horner::<T, Rounded>(T::COSINE, z) - r * tail;
    (sine, head + (((T::ONE - head) - half) + rest))
}

/// The same with fused operations. They need no tail: the remainder is accurate to half a unit in its last place.
#[inline(always)]
fn first_quadrant_fused<T: Element, F: MulAdd<T>>(x: T, count: T) -> (T, T) {
    // Exact: x and the product are multiples of half a unit in the last place of 1 (or x is below 0.8 and the count 0),
    // and their difference is below 1.
    let first = F::mul_add(-count, T::HALF_PI_FUSED[0], x);
    let second = F::mul_add(-count, T::HALF_PI_FUSED[1], first);
    let r = F::mul_add(-count, T::HALF_PI_FUSED[2], second);
    let z = r * r;
    let sine = F::mul_add(r * z, horner::<T, F>(T::SINE, z), r);
    let half = F::mul_add(z, horner::<T, F>(T::COSINE, z), -T::HALF);
    (sine, F::mul_add(z, half, T::ONE))
}
