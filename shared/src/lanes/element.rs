//! The number in a lane.

use core::fmt::Debug;
use core::ops::{BitAnd, BitOr, Not};

use crate::scalar::Scalar;

/// A number that fills lanes: `f32` or `f64`. It holds what the two do not share, above all the constants of
/// [`Real::sin_cos`](crate::scalar::Real::sin_cos) of lanes.
pub trait Element: Scalar + PartialOrd + 'static {
    /// Whole number of the same size. All bits set is true, 0 is false.
    type Bits: Copy
        + Debug
        + Default
        + Eq
        + BitAnd<Output = Self::Bits>
        + BitOr<Output = Self::Bits>
        + Not<Output = Self::Bits>;

    /// Largest |x|, rad, for which [`Real::sin_cos`](crate::scalar::Real::sin_cos) of lanes keeps its stated error: the
    /// number of quarter turns still fits into the bits that the first two parts of π/2 leave free.
    const ANGLE_LIMIT: Self;
    /// 1/2
    const HALF: Self;
    /// 2/π
    const QUARTERS: Self;
    /// 1.5 times the number from which on only whole numbers exist: its addition rounds to the nearest integer and
    /// leaves that integer in the low bits of the sum.
    const ROUND: Self;
    /// π/2 in three parts. The first two are so short that their products with a number of quarter turns are exact.
    const HALF_PI: [Self; 3];
    /// π/2 in three parts of full length, for products that are added without rounding.
    const HALF_PI_FUSED: [Self; 3];
    /// (sin r − r)/r³ as a polynomial in r², |r| ≤ π/4, interpolated at the Chebyshev points with 70 digits. It is
    /// minimax up to a small factor.
    const SINE: &'static [Self];
    /// (cos r − 1 + r²/2)/r⁴ likewise.
    const COSINE: &'static [Self];

    /// Returns the truth value as bits.
    fn mask(truth: bool) -> Self::Bits;

    /// Returns `yes` if the mask is true, otherwise `no`.
    fn pick(mask: Self::Bits, yes: Self, no: Self) -> Self;

    /// Returns sine and cosine of r plus a number of quarter turns, given those of r; `count` is that number plus
    /// [`Self::ROUND`]. With `by_sign` the choice is by the sign bit, as processors with fused operations do it.
    fn turned(sine: Self, cosine: Self, count: Self, by_sign: bool) -> (Self, Self);
}

/// The functions that handle the bits of a number.
macro_rules! bits {
    ($element:ty, $bits:ty) => {
        type Bits = $bits;

        #[inline(always)]
        fn mask(truth: bool) -> $bits {
            if truth { !0 } else { 0 }
        }

        #[inline(always)]
        fn pick(mask: $bits, yes: Self, no: Self) -> Self {
            Self::from_bits((yes.to_bits() & mask) | (no.to_bits() & !mask))
        }

        #[inline(always)]
        fn turned(sine: Self, cosine: Self, count: Self, by_sign: bool) -> (Self, Self) {
            const TOP: u32 = <$bits>::BITS - 1;
            let quadrant = count.to_bits();
            let sine_sign = (quadrant & 2) << (TOP - 1);
            let cosine_sign = (quadrant.wrapping_add(1) & 2) << (TOP - 1);
            let (s, c) = if by_sign {
                let odd = (quadrant << TOP).cast_signed() < 0;
                if odd { (cosine, sine) } else { (sine, cosine) }
            } else {
                let odd = (0 as $bits).wrapping_sub(quadrant & 1);
                (Self::pick(odd, cosine, sine), Self::pick(odd, sine, cosine))
            };
            (
                Self::from_bits(s.to_bits() ^ sine_sign),
                Self::from_bits(c.to_bits() ^ cosine_sign),
            )
        }
    };
}

impl Element for f64 {
    bits!(f64, u64);

    const ANGLE_LIMIT: Self = 1.0e5;
    const HALF: Self = 0.5;
    const QUARTERS: Self = core::f64::consts::FRAC_2_PI;
    /// 1.5·2⁵²
    const ROUND: Self = 6755399441055744.0;
    /// The first two have 37 significant bits, which leaves 16 for the count.
    const HALF_PI: [Self; 3] = [
        1.5707963267923333,
        2.5633441515839558e-12,
        1.0562999066987428e-23,
    ];
    const HALF_PI_FUSED: [Self; 3] = [
        core::f64::consts::FRAC_PI_2,
        6.123233995736766e-17,
        -1.4973849048591698e-33,
    ];
    /// Truncation below 2·10⁻¹⁷ of sin r.
    const SINE: &'static [Self] = &[
        -0.16666666666666666,
        0.008333333333330946,
        -0.0001984126983675497,
        2.755731610068312e-06,
        -2.5051131455447428e-08,
        1.591810123167728e-10,
    ];
    /// Truncation below 10⁻¹⁸.
    const COSINE: &'static [Self] = &[
        0.041666666666666664,
        -0.0013888888888887395,
        2.4801587298763433e-05,
        -2.7557317270560385e-07,
        2.087614602470193e-09,
        -1.1382614869434128e-11,
    ];
}

impl Element for f32 {
    bits!(f32, u32);

    const ANGLE_LIMIT: Self = 400.0;
    const HALF: Self = 0.5;
    const QUARTERS: Self = core::f32::consts::FRAC_2_PI;
    /// 1.5·2²³
    const ROUND: Self = 12_582_912.0;
    /// The first two have 16 significant bits, which leaves 8 for the count.
    const HALF_PI: [Self; 3] = [1.570_800_8, -4.454_399_5e-6, -5.564_431_6e-11];
    const HALF_PI_FUSED: [Self; 3] = [
        core::f32::consts::FRAC_PI_2,
        -4.371_139e-8,
        -1.715_124_5e-15,
    ];
    /// Truncation below 1.4·10⁻⁸ of sin r, a quarter of a unit in the last place.
    const SINE: &'static [Self] = &[-0.166_666_64, 0.008_332_748, -0.000_195_878_9];
    /// Truncation below 10⁻⁹.
    const COSINE: &'static [Self] = &[0.041_666_664, -0.001_388_830_2, 2.454_794_2e-5];
}
