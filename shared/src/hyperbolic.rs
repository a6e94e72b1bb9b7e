//! The hyperbolic tangent in single precision, with one exponential if needed. Control ticks call it several times,
//! mostly far from 0, where it is ±1.

/// From this |x| on the single nearest to tanh is 1: 2·exp(−2x) is below half of the last digit before 1.
const ONE_FROM: f32 = 9.02;
/// Up to this |x| the odd series up to x¹¹ is more accurate: its truncation error is 1.2·10⁻⁸ of the value.
const SERIES_TO: f32 = 0.35;

/// Coefficients of x³ to x¹¹ (Abramowitz and Stegun 1964, 4.5.64).
const SERIES: [f32; 5] = [
    -1.0 / 3.0,
    2.0 / 15.0,
    -17.0 / 315.0,
    62.0 / 2835.0,
    -1382.0 / 155_925.0,
];

/// Hyperbolic tangent.
#[inline(never)]
pub(crate) fn tanhf(x: f32) -> f32 {
    let size = x.abs();
    if size >= ONE_FROM {
        return 1.0_f32.copysign(x);
    }
    if size < SERIES_TO {
        let square = x * x;
        let [a, b, c, d, e] = SERIES;
        let tail = a + square * (b + square * (c + square * (d + square * e)));
        return x + x * square * tail;
    }
    // NaN reaches this line and stays NaN.
    let value = 1.0 - 2.0 / (libm::expf(2.0 * size) + 1.0);
    value.copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_within_a_few_units_in_the_last_place_everywhere() {
        let mut worst = 0.0_f64;
        for k in 0..=2_000_000 {
            let x = k as f32 * 5e-6;
            let (found, truth) = (f64::from(tanhf(x)), libm::tanh(f64::from(x)));
            assert_eq!(tanhf(-x), -tanhf(x));
            if x > 0.0 {
                worst = worst.max((found / truth - 1.0).abs());
            }
        }
        assert!(worst < 5e-7, "{worst:e}");
        for (x, y) in [(20.0, 1.0), (f32::INFINITY, 1.0), (1e-30, 1e-30)] {
            assert_eq!(tanhf(x), y);
        }
        assert!(tanhf(f32::NAN).is_nan());
    }
}
