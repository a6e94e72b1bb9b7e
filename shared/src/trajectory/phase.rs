//! The phase of a swept sine in whole numbers. After thousands of turns an `f32` has no digits for the angle. 64 bits
//! of a turn's fraction have, and their multiplication takes four instructions of the microcontroller.
//!
//! Turns are kept modulo one, as multiples of 2⁻⁶⁴. Constants are computed once, in double precision. Their rounding
//! bends the sweep a little (by its length in µs times 2⁻⁶⁴: 3·10⁻¹² in a minute) but adds no jitter.
//!
//! Leaves out: lanes; sweeps above 10⁵ Hz or over more than 31 octaves, which no rig gets.

use super::sweep::Sweep;
use crate::scalar::Scalar;

/// Highest frequency of a sweep, Hz.
pub(super) const MAX_HZ: f64 = 1.0e5;
/// Largest number of octaves of a logarithmic sweep.
pub(super) const MAX_OCTAVES: f64 = 31.0;
/// A logarithmic sweep over fewer octaves runs as a linear one. The two differ by less than 10⁻⁸ of the phase, and the
/// logarithmic formula would be the difference of two large numbers.
const MIN_OCTAVES: f64 = 1.0 / 4096.0;

/// Returns the upper half of a product.
///
/// Not inlined: a phase needs a dozen of them, and the chip's fast memory has no room for copies.
#[inline(never)]
fn high(a: u64, b: u64) -> u64 {
    let low = |x: u64| x & 0xFFFF_FFFF;
    let (a1, a0, b1, b0) = (a >> 32, low(a), b >> 32, low(b));
    let first = a1 * b0 + ((a0 * b0) >> 32);
    let second = a0 * b1 + low(first);
    a1 * b1 + (first >> 32) + (second >> 32)
}

/// 2^(i/16), multiples of 2⁻⁶³; 1/2! to 1/6!, of 2⁻³²; the natural logarithm of 2, of 2⁻⁶⁴.
#[rustfmt::skip]
const POWERS: [u64; 16] = [
    0x8000_0000_0000_0000, 0x85aa_c367_cc48_7b15, 0x8b95_c1e3_ea8b_d6e7, 0x91c3_d373_ab11_c336,
    0x9837_f051_8db8_a96f, 0x9ef5_3260_91a1_11ae, 0xa5fe_d6a9_b151_38ea, 0xad58_3eea_42a1_4ac6,
    0xb504_f333_f9de_6484, 0xbd08_a39f_580c_36bf, 0xc567_2a11_5506_dadd, 0xce24_8c15_1f84_80e4,
    0xd744_fcca_d69d_6af4, 0xe0cc_deec_2a94_e111, 0xeac0_c6e7_dd24_392f, 0xf525_7d15_2486_cc2c,
];
const TAIL: [u64; 5] = [
    0x8000_0000,
    0x2aaa_aaab,
    0x0aaa_aaab,
    0x0222_2222,
    0x005b_05b0,
];
const LN_2: u64 = 0xb172_17f7_d1cf_79ac;

/// Returns 2^(share/2⁶⁴), a multiple of 2⁻⁶³: sixteenths of the octave from a table, the rest by the exponential's
/// series 1 + z + z²·(1/2! + z/3! + …), z below 0.044. The brackets, in 32 bits, are off by 10⁻⁹, the whole by 10⁻¹².
#[inline(always)]
fn exp2(share: u64) -> u64 {
    const ONE: u64 = 1 << 63;
    let sixteenth = (share >> 60) as usize;
    let rest = high(share & (u64::MAX >> 4), LN_2);
    let short = rest >> 32;
    let [first, a, b, c, d] = TAIL;
    let times = |factor: u64| (factor * short) >> 32;
    let brackets = first + times(a + times(b + times(c + times(d))));
    let tail = ((high(rest, rest) >> 24) * brackets) >> 8;
    let series = ONE + (rest >> 1) + (tail >> 1);
    high(*POWERS.get(sixteenth).unwrap_or(&ONE), series) << 1
}

/// Constants for the turns and the frequency of a sweep at any time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Phase<T> {
    /// Share of the length per µs, 2⁻⁶⁴.
    share: u64,
    law: Law,
    /// Change of the frequency, Hz/s, or of its logarithm, 1/s.
    rate: T,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    /// Turns = µs · (start ± share · change): turns per µs, 2⁻⁶⁴.
    Linear {
        start: u64,
        change: u64,
        falls: bool,
    },
    /// Turns = ± scale · (2^(± octaves · share) − 1), scale = mantissa · 2^(exponent − 65).
    Logarithmic {
        /// 2⁻⁵⁸ octaves.
        octaves: u64,
        falls: bool,
        mantissa: u64,
        exponent: i32,
        /// Fraction of the scale, 2⁻⁶⁴ turns.
        fraction: u64,
    },
}

/// State of a sweep at a time.
pub(super) struct Point<T> {
    /// Fraction of a turn, −½ to ½.
    pub(super) turns: T,
    /// Frequency, Hz.
    pub(super) hz: T,
    /// First derivative of the frequency, Hz/s.
    pub(super) slope: T,
    /// Second derivative of the frequency, Hz/s².
    pub(super) bend: T,
}

/// Returns 2^exponent.
fn power_of_two(exponent: i32) -> f64 {
    libm::ldexp(1.0, exponent)
}

/// Returns a number from 0 to 1 that is given in multiples of 2⁻⁶⁴.
#[inline(always)]
fn fraction<T: Scalar>(value: u64) -> T {
    let unit = T::from_f64(1.0 / 4_294_967_296.0);
    (T::from_u32((value >> 32) as u32) + T::from_u32(value as u32) * unit) * unit
}

impl<T: Scalar> Phase<T> {
    /// Constant phase 0, for motions other than sweeps.
    pub(super) const STILL: Self = Self {
        share: 0,
        law: Law::Linear {
            start: 0,
            change: 0,
            falls: false,
        },
        rate: T::ZERO,
    };

    /// Returns the constants of a sweep from one frequency (Hz) to another.
    pub(super) fn new(start_hz: f64, end_hz: f64, sweep: Sweep, duration_us: u32) -> Self {
        let duration_us = duration_us.max(1);
        let octaves = libm::log2(end_hz / start_hz);
        let falls = end_hz < start_hz;
        // Casts from floating point saturate, and turn NaN into zero: no value overflows its word.
        let seconds = f64::from(duration_us) * 1e-6;
        let (rate, law) = if sweep == Sweep::Linear || !(octaves.abs() >= MIN_OCTAVES) {
            let per_us = |hz: f64| (hz * 1e-6 * power_of_two(64)) as u64;
            let law = Law::Linear {
                start: per_us(start_hz),
                change: per_us(0.5 * (end_hz - start_hz).abs()),
                falls,
            };
            ((end_hz - start_hz) / seconds, law)
        } else {
            let rate = octaves * core::f64::consts::LN_2 / seconds;
            let scale = start_hz / rate.abs();
            let (mantissa, exponent) = libm::frexp(scale);
            let law = Law::Logarithmic {
                octaves: (octaves.abs().min(MAX_OCTAVES) * power_of_two(58)) as u64,
                falls,
                mantissa: (mantissa * power_of_two(64)) as u64,
                exponent: exponent + 1,
                fraction: ((scale - libm::floor(scale)) * power_of_two(64)) as u64,
            };
            (rate, law)
        };
        Self {
            rate: T::from_f64(rate),
            share: u64::MAX / u64::from(duration_us),
            law,
        }
    }

    /// Returns the state at a whole µs of a sweep with this start frequency and this total change, Hz.
    #[inline(always)]
    pub(super) fn at(&self, micros: u32, start_hz: T, change_hz: T) -> Point<T> {
        let share = self.share * u64::from(micros);
        let (turns, hz) = match self.law {
            Law::Linear {
                start,
                change,
                falls,
            } => {
                let change = high(change, share);
                let mean = if falls {
                    start.wrapping_sub(change)
                } else {
                    start.wrapping_add(change)
                };
                let hz = start_hz + change_hz * fraction(share);
                (mean.wrapping_mul(u64::from(micros)), hz)
            }
            Law::Logarithmic {
                octaves,
                falls,
                mantissa,
                exponent,
                fraction: own,
                ..
            } => {
                let way = high(octaves, share) as i64;
                let way = if falls { -way } else { way };
                let (whole, part) = ((way >> 58) as i32, (way as u64) << 6);
                let power = exp2(part);
                let product = high(mantissa, power);
                let shift = exponent + whole;
                let turns = match u32::try_from(shift) {
                    Ok(left) => product.checked_shl(left).unwrap_or_default(),
                    Err(_) => product
                        .checked_shr(shift.unsigned_abs())
                        .unwrap_or_default(),
                };
                let gained = turns.wrapping_sub(own);
                let octave = T::from_u32(1_u32.checked_shl(whole.unsigned_abs()).unwrap_or(1));
                let octave = if whole < 0 { T::ONE / octave } else { octave };
                let hz = start_hz * octave * T::from_f64(2.0) * fraction(power);
                (if falls { gained.wrapping_neg() } else { gained }, hz)
            }
        };
        let [slope, bend] = match self.law {
            Law::Linear { .. } => [self.rate, T::ZERO],
            Law::Logarithmic { .. } => [self.rate * hz, self.rate.squared() * hz],
        };
        let backwards = turns >> 63 != 0;
        let size: T = fraction(if backwards {
            turns.wrapping_neg()
        } else {
            turns
        });
        Point {
            turns: if backwards { -size } else { size },
            hz,
            slope,
            bend,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_two_are_right_to_twelve_digits() {
        for k in 0..100_000_u64 {
            let share = k.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let found = exp2(share) as f64 / power_of_two(63);
            let truth = libm::exp2(share as f64 / power_of_two(64));
            assert!((found / truth - 1.0).abs() < 1e-12, "{share:x}");
        }
        assert_eq!(exp2(0), 1 << 63);
    }

    /// Compares with the law in double precision, up and down, over many turns.
    #[test]
    fn turns_are_the_integral_of_the_frequency() {
        let length = 60_000_000;
        let seconds = 60.0;
        for (from, to) in [
            (0.2, 8.0),
            (8.0, 0.2),
            (3.0, 3.0),
            (1.0, 1.0001),
            (50.0, 1000.0),
        ] {
            for sweep in [Sweep::Linear, Sweep::Logarithmic] {
                let phase = Phase::new(from, to, sweep, length);
                for k in 0..=2000_u32 {
                    let micros = length / 2000 * k;
                    let t = f64::from(micros) * 1e-6;
                    let ratio: f64 = to / from;
                    let straight = sweep == Sweep::Linear || libm::log2(ratio).abs() < MIN_OCTAVES;
                    let (turns, hz) = if straight {
                        let slope = (to - from) / seconds;
                        (t * (from + 0.5 * slope * t), from + slope * t)
                    } else {
                        let rate = libm::log(ratio) / seconds;
                        let hz = from * libm::exp(rate * t);
                        ((hz - from) / rate, hz)
                    };
                    let point = phase.at(micros, from, to - from);
                    let off = point.turns - turns;
                    // Rounding of the constants and of the double.
                    let off = (off - libm::round(off)).abs();
                    assert!(
                        off < 3e-12 * seconds * from.max(hz),
                        "{from} {to} {sweep:?} at {t}: {off:e} turns"
                    );
                    assert!((point.hz / hz - 1.0).abs() < 1e-9, "{from} {to} at {t}");
                }
            }
        }
    }
}
