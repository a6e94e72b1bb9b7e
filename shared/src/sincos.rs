//! Sine and cosine with single-precision arithmetic only.
//!
//! libm computes in double precision, for which the microcontroller has no hardware: some 2000 of its cycles, in a
//! control tick that has 17 000 in total.
//!
//! x = k·π/2 + r with |r| ≤ π/4. The multiple of π/2 is subtracted in three parts, so short that k times the first two
//! is exact (Cody and Waite 1980, ch. 8). Minimax polynomials on that interval follow, x³·P(x²) and x⁴·Q(x²) (Remez's
//! exchange, largest error 1.8·10⁻⁹ and 1.0·10⁻¹⁰ before rounding).

/// Largest |x|, rad, up to which k times the parts of π/2 is exact.
const FURTHEST: f32 = 8192.0;

/// π/2 in parts of 8, 11 and 24 bits.
const HALF_PI: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

const SINE: [f32; 3] = [-0.166_666_51, 8.331_978e-3, -1.949_557e-4];
const COSINE: [f32; 3] = [4.166_664_7e-2, -1.388_736_7e-3, 2.443_838e-5];

/// Returns sine and cosine of an angle in rad.
///
/// Not inlined: models, effects and motions call it, and the chip's fast memory has no room for copies.
#[inline(never)]
pub(crate) fn sincosf(x: f32) -> (f32, f32) {
    // The negation sends NaN to `far`, which returns NaN.
    if !(x.abs() <= FURTHEST) {
        return far(x);
    }
    let turns = x * core::f32::consts::FRAC_2_PI;
    let quarter = (turns + 0.5_f32.copysign(turns)) as i32;
    let k = quarter as f32;
    let r = ((x - k * HALF_PI[0]) - k * HALF_PI[1]) - k * HALF_PI[2];
    let z = r * r;
    let sine = r + r * z * (SINE[0] + z * (SINE[1] + z * SINE[2]));
    let cosine = 1.0 - 0.5 * z + z * z * (COSINE[0] + z * (COSINE[1] + z * COSINE[2]));
    match quarter & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Angles beyond [`FURTHEST`]: slow, and never used by a rig.
#[cold]
#[inline(never)]
fn far(x: f32) -> (f32, f32) {
    libm::sincosf(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of one unit in the last place near ±1, and many turns away.
    #[test]
    fn error_stays_below_a_unit_in_the_last_place_of_one() {
        for (reach, count) in [(1.0_f32, 100_000), (100.0, 400_000), (FURTHEST, 800_000)] {
            for k in -count..=count {
                let x = reach * (k as f32 / count as f32);
                let (sine, cosine) = sincosf(x);
                let (s, c) = libm::sincos(f64::from(x));
                let error = (f64::from(sine) - s)
                    .abs()
                    .max((f64::from(cosine) - c).abs());
                assert!(error < f64::from(f32::EPSILON), "{x}: {error:e}");
            }
        }
    }

    #[test]
    fn small_angles_are_their_own_sine_and_signs_are_kept() {
        for x in [0.0_f32, 1e-30, -1e-10, 3e-5] {
            let (sine, cosine) = sincosf(x);
            assert!(sine.is_sign_negative() == x.is_sign_negative());
            assert!((sine - x).abs() <= 1e-7 * x.abs());
            assert_eq!(cosine, 1.0);
        }
    }

    #[test]
    fn far_away_and_beyond_it_agrees_with_libm() {
        for x in [8193.0_f32, -1e6, 3e30] {
            assert_eq!(sincosf(x), libm::sincosf(x));
        }
        for x in [f32::NAN, f32::INFINITY] {
            let (sine, cosine) = sincosf(x);
            assert!(sine.is_nan() && cosine.is_nan());
        }
    }
}
